"""Loads the installed engines that can run in the play page."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

from carom.engines.api.checks import supports
from carom.engines.protocol.adapter import ProgramAdapter
from carom.engines.registry import load_adapter, require_named
from carom.errors import InputError
from carom.model.scene import Need
from carom.web.engine_script import PageEngine, build_page_engine
from carom.web.packages import PACKAGES

#: Engines that the page contains by default, because they are small and need no WebAssembly.
DEFAULT_ENGINES = ("matter", "planck")

#: Features of scenes that an engine may not support, in the order in which the page lists them.
_NEEDS = (
    *(Need.SPIN, Need.FRICTION, Need.SEGMENTS, Need.ARCS, Need.WALL_MATERIALS, Need.DRIVEN_WALLS, Need.DRIVEN_DISCS),
    *(Need.LEGS, Need.BELTS, Need.EDGE_BELTS, Need.ROLLING_RESISTANCE, Need.DAMPING, Need.TABLE_FRICTION),
)


def load_page_engines(names: Iterable[str], *, required: bool) -> list[PageEngine]:
    """Return the installed engines with the given names.

    Raises:
        InputError: An engine can't run in a page, or is required but not installed.
    """
    engines = []
    for name in names:
        require_named(name)
        adapter = load_adapter(name)
        if name not in PACKAGES or not isinstance(adapter, ProgramAdapter):
            raise InputError(f"the page can't run {name}: choose from {', '.join(PACKAGES)}")
        engine = build_page_engine(name, Path(adapter.folder) / "engine.toml")
        if engine is not None:
            lacks = tuple(need.value for need in _NEEDS if not supports(adapter.capabilities, need))
            engines.append(replace(engine, lacks=lacks))
        elif required:
            raise InputError(f"{name} is not installed: {adapter.manifest.install}")
    return engines
