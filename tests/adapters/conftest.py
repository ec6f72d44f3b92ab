"""Every adapter that Carom registers of the engines in the extra `all`; those of others are in tests/engines."""

import pytest
from tests.scene_builders import Named

from carom.engines.api import Adapter
from carom.engines.registry import load_adapter

NAMES = ["box2d", "mujoco", "pic", "pit", "pybullet", "pymunk"]
ENGINES = [name for name in NAMES if load_adapter(name).engine.module]


@pytest.fixture(params=NAMES)
def adapter(request: pytest.FixtureRequest, named: Named) -> Adapter:
    """Each of Carom's adapters in turn."""
    return named(request.param)


@pytest.fixture(params=ENGINES)
def engine(request: pytest.FixtureRequest, named: Named) -> Adapter:
    """Each adapter of an external engine in turn."""
    return named(request.param)
