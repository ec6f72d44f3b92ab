"""The optional dependencies of a written report, the extra `report`."""

from __future__ import annotations

import importlib.util

from carom.errors import MissingExtraError

__all__ = ["rendered", "require_report_extra"]


def require_report_extra() -> None:
    """See to it that jinja2 and matplotlib are there.

    Raises:
        MissingExtraError: One of them is not installed.
    """
    for module in ("jinja2", "matplotlib"):
        if importlib.util.find_spec(module) is None:
            raise MissingExtraError(f"a report needs {module}, which is not installed: pip install 'carom[report]'")


def rendered(template: str, **values: object) -> str:
    """Return a page of the report made from its template; every name is escaped, and none may be missing.

    Raises:
        MissingExtraError: jinja2 or matplotlib is not installed.
    """
    require_report_extra()
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("carom.report"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template(template).render(**values)
