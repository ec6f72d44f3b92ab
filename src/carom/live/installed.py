"""The engines that run in the page, where the user has them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

from carom.errors import InputError
from carom.live.linked import PageEngine, page_engine
from carom.live.packages import PACKAGES
from carom.program.adapter import ProgramAdapter
from carom.registry import load_adapter, require_named

__all__ = ["DEFAULT_ENGINES", "page_engines"]

#: Small, and free of WebAssembly.
DEFAULT_ENGINES = ("matter", "planck")


def page_engines(names: Iterable[str], *, required: bool) -> list[PageEngine]:
    """Return the engines of these names that are installed.

    Raises:
        InputError: One of them does not run in a page; or is not installed, and is required.
    """
    found = []
    for name in names:
        require_named(name)
        adapter = load_adapter(name)
        if name not in PACKAGES or not isinstance(adapter, ProgramAdapter):
            raise InputError(f"the page runs {', '.join(PACKAGES)}, and not {name}")
        engine = page_engine(name, Path(adapter.folder) / "engine.toml")
        if engine is not None:
            has = adapter.capabilities
            lacks = tuple(
                name for name, there in (("spin", has.spin), ("friction", has.friction[1] > 0.0)) if not there
            )
            found.append(replace(engine, lacks=lacks))
        elif required:
            raise InputError(f"{name} is not installed: {adapter.manifest.install}")
    return found
