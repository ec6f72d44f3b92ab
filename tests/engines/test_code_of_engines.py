"""Engines that `make engines` installs: what each ships, and settings to paste with the adapter's digits."""

from __future__ import annotations

import math
import shutil
from pathlib import Path

import numpy as np
import pytest
from tests.adapters.pasted import adapters_end, programs_end
from tests.adapters.shipped import assert_default_is_shipped, worst_difference
from tests.engines.shipped import OF_ENGINES
from tests.stage import Named, disc_at, staged, wall_at

import carom_adapters.npm
from carom import Chain, Scene, Wall
from carom.adapter import CodedAdapter, Need, unsupported_reason
from carom.scenes import all_scenes

#: Adapters of packages, and of programs of node.
PYTHON, NODE = (
    ("rapier", "dart", "drake", "ode", "newton"),
    ("planck", "matter", "box2d3", "jolt", "rapier2d", "cannon", "p2", "havok", "physx"),
)
NPM = Path(carom_adapters.npm.__file__).parent


def corner(restitution: float, wall_restitution: float, friction: float = 0.0) -> Scene:
    """Discs in a corner, under gravity, one of them immovable."""
    return staged(
        "a corner",
        disc_at(0.6, 1.0, 2.0, -1.0, r=0.2, m=1.5),
        disc_at(1.5, 0.9, -1.0, 0.5, r=0.3),
        disc_at(2.5, 1.0, r=0.25, m=math.inf),
        wall_at(0, 0, 0, 1),
        wall_at(0, 0, 1, 0.1),
        restitution=restitution,
        wall_restitution=wall_restitution,
        friction=friction,
        wall_friction=friction,
        gravity_m_s2=(0.0, -9.81),
        duration_s=1.0,
    )


#: Walls and a disc that stand at first, and then go.
_LEGS = [{"from_s": begin, "velocity_m_s": velocity} for begin, velocity in ((0.0, (0.0, 0.0)), (0.31, (0.5, -0.25)))]
_CORNER = corner(0.9, 0.8)
TOLD = _CORNER.model_copy(
    update={
        "discs": (*_CORNER.discs[:2], disc_at(2.5, 1.0, r=0.25, m=math.inf, driven=True, legs=_LEGS)),
        "walls": (
            Wall(point_m=(0, 0), normal=(0, 1), legs=[*_LEGS, {"from_s": 0.5, "velocity_m_s": (0.0, 0.125)}]),
            Chain(points_m=[(-1, -1), (-1, 2), (3, 2)], half_width_m=0.05, legs=_LEGS),
        ),
    }
)
#: Restitutions of discs above those of walls and below them: some engines take the larger of two. Drake has 1 alone.
SCENES = {
    "lossy walls": corner(0.9, 0.8),
    "lossy discs": corner(0.7, 0.9),
    "rough": corner(0.9, 0.8, friction=0.3),
    "elastic": corner(1.0, 1.0),
    "told": TOLD,
    "multiple": all_scenes()["paper/multiple"].scene,
    "box": all_scenes()["classics/box"].scene,
    "bullet": all_scenes()["classics/bullet"].scene,
}


@pytest.mark.parametrize("name", [*PYTHON, *NODE])
def test_what_is_pasted_gives_the_adapters_digits(named: Named, name: str, tmp_path: Path) -> None:
    """The program of each profile, run without Carom, ends with every digit of the adapter, on three scenes or more."""
    adapter = named(name)
    assert isinstance(adapter, CodedAdapter)
    if name in NODE:  # a module of node finds its engine beside it
        shutil.copy(NPM / "package.json", tmp_path)
        (tmp_path / "node_modules").symlink_to(NPM / "node_modules")
    for profile in (one for one in adapter.profiles.values() if not one.located):
        compared = 0
        for scene in SCENES.values():
            dt_s = 1 / scene.frame_rate_hz
            if unsupported_reason(scene, profile.capabilities or adapter.capabilities, dt_s, located=False):
                continue
            expected = adapters_end(adapter, scene, next(k for k, v in adapter.profiles.items() if v is profile), dt_s)
            text = adapter.code(scene, profile.settings(dt_s), "Two lines --\nof a heading.")
            assert "carom" not in text.lower()
            found = programs_end(text, tmp_path, node=name in NODE)
            if Need.SPIN not in scene.needs and Need.FRICTION not in scene.needs:
                expected[:, 4] = found[:, 4] = 0.0  # nobody asks how a disc turns that nothing turns
            assert (np.abs(expected[:, 2:4]) > 0).any()
            np.testing.assert_array_equal(found, expected)
            compared += 1
        assert compared >= 3


@pytest.mark.parametrize("name", OF_ENGINES)
def test_default_uses_what_is_shipped(name: str, named: Named) -> None:
    """Each value that `default` uses is the engine's own, read from it, but for what the profile lists as changed."""
    adapter = named(name)
    assert_default_is_shipped(adapter, OF_ENGINES[name]())


@pytest.mark.parametrize("name", OF_ENGINES)
def test_default_runs_as_the_bare_engine(name: str, named: Named) -> None:
    """Discs end where the bare engine has them, of which only what is listed is changed, to the roundings of a turn."""
    adapter = named(name)
    shipped = OF_ENGINES[name]()
    assert worst_difference(adapter, shipped) <= shipped.roundings
