"""Installed engines that can run in the play page."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

from carom.engines.protocol.adapter import ProgramAdapter
from carom.engines.registry import load_adapter, require_named
from carom.errors import InputError
from carom.model.scene import Need
from carom.web.engine_script import PageEngine, page_engine
from carom.web.packages import PACKAGES

#: Engines of the page by default: small, and without WebAssembly.
DEFAULT_ENGINES = ("matter", "planck")


def page_engines(names: Iterable[str], *, required: bool) -> list[PageEngine]:
    """Return the installed engines with the given names.

    Raises:
        InputError: An engine can't run in a page, or is required but not installed.
    """
    found = []
    for name in names:
        require_named(name)
        adapter = load_adapter(name)
        if name not in PACKAGES or not isinstance(adapter, ProgramAdapter):
            raise InputError(f"the page can't run {name}: choose from {', '.join(PACKAGES)}")
        engine = page_engine(name, Path(adapter.folder) / "engine.toml")
        if engine is not None:
            has = adapter.capabilities
            needed = {
                Need.SPIN: has.spin,
                Need.FRICTION: has.friction[1] > 0.0,
                Need.SEGMENTS: has.segments,
                Need.ARCS: has.arcs,
                Need.WALL_MATERIALS: has.wall_materials,
                Need.DRIVEN_WALLS: has.driven_walls,
                Need.DRIVEN_DISCS: has.driven_discs,
                Need.LEGS: has.legs,
                Need.BELTS: has.belts,
                Need.EDGE_BELTS: has.edge_belts,
                Need.ROLLING_RESISTANCE: has.rolling_resistance,
                Need.DAMPING: has.damping,
                Need.TABLE_FRICTION: False,  # no engine supports table friction
            }
            found.append(replace(engine, lacks=tuple(need.value for need, there in needed.items() if not there)))
        elif required:
            raise InputError(f"{name} is not installed: {adapter.manifest.install}")
    return found
