"""Every adapter that Carom registers, and two ways to drive one through the seam alone."""

from __future__ import annotations

from collections.abc import Callable
from importlib import metadata

import pytest

from carom import Scene
from carom.adapter import Adapter, Observation, Setting
from carom.registry import ENTRY_POINT_GROUP, load_adapter, unavailable_reason

NAMES = sorted(
    point.name for point in metadata.entry_points(group=ENTRY_POINT_GROUP) if point.value.startswith("carom_adapters.")
)
ENGINES = [name for name in NAMES if load_adapter(name).engine.module]


def _available(name: str) -> Adapter:
    adapter = load_adapter(name)
    if reason := unavailable_reason(adapter.engine):
        pytest.skip(reason)
    return adapter


@pytest.fixture(params=NAMES)
def adapter(request: pytest.FixtureRequest) -> Adapter:
    """Each of Carom's adapters in turn."""
    return _available(request.param)


@pytest.fixture(params=ENGINES)
def engine(request: pytest.FixtureRequest) -> Adapter:
    """Each adapter of an external engine in turn."""
    return _available(request.param)


@pytest.fixture
def named() -> Callable[[str], Adapter]:
    """One adapter by its name; the test is skipped where its engine is missing."""
    return _available


@pytest.fixture
def drive() -> Callable[..., list[Observation]]:
    """Run a scene to its end, and give what was observed at the start and after every step."""

    def run(
        adapter: Adapter, scene: Scene, dt_s: float, profile: str = "tuned", **changes: Setting
    ) -> list[Observation]:
        world = adapter.prepare(scene, {**adapter.profiles[profile].settings(dt_s), **changes})
        try:
            seen = [world.observe()]
            for _ in range(scene.step_count(dt_s)):
                world.advance(1)
                seen.append(world.observe())
        finally:
            world.close()
        return seen

    return run


@pytest.fixture
def finish() -> Callable[..., Observation]:
    """Run a scene to its end in one go, and give what is observed there."""

    def run(adapter: Adapter, scene: Scene, dt_s: float, profile: str = "tuned", **changes: Setting) -> Observation:
        world = adapter.prepare(scene, {**adapter.profiles[profile].settings(dt_s), **changes})
        try:
            world.advance(scene.step_count(dt_s))
            return world.observe()
        finally:
            world.close()

    return run
