"""No module imports itself by way of others, not even where only the types are meant."""

from __future__ import annotations

import grimp
import pytest


@pytest.mark.parametrize("package", ["carom.comparator", "carom.report", "carom.scenes"])
def test_no_imports_go_in_a_circle(package: str) -> None:
    """From no module of the package does a chain of imports lead back to it, those under `TYPE_CHECKING` counted."""
    graph = grimp.build_graph("carom", exclude_type_checking_imports=False)
    modules = graph.find_descendants(package)
    assert modules
    circles = {
        module
        for module in modules
        for imported in graph.find_modules_directly_imported_by(module)
        if imported != package and graph.chain_exists(importer=imported, imported=module)
    }
    assert not circles
