"""No module imports itself by way of others, not even where only the types are meant."""

from __future__ import annotations

import grimp


def test_no_imports_go_in_a_circle() -> None:
    """From no module does a chain of imports lead back to it, those under `TYPE_CHECKING` counted."""
    graph = grimp.build_graph("carom", exclude_type_checking_imports=False)
    modules = graph.modules - {"carom"}  # the package itself names what it offers, and fetches it when it is asked for
    assert modules
    circles = {
        module
        for module in modules
        for imported in graph.find_modules_directly_imported_by(module) & modules
        if imported != module and graph.chain_exists(importer=imported, imported=module)
    }
    assert not circles
