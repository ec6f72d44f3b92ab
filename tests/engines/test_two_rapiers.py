"""Rapier twice, its plane build from npm and the wheel of its spatial one: one engine, wherever settings are one."""

from __future__ import annotations

import numpy as np
import pytest
from tests.engines.staged import Drive, Named

from carom import Scene
from carom.adapter import Observation, Setting
from carom.scenes import find_scenes

DT_S = 1 / 60
SCENES = [entry.scene for entry in find_scenes(["paper", "classics", "gravity", "engines"])]
#: What the package from npm leaves as it is shipped, and how it lifts the limit of speeds.
AS_NPM: dict[str, Setting] = {
    "static_contact_natural_frequency": 60.0,
    "length_unit": 1024.0,
    "normalized_max_linear_velocity": 400.0,
}


def impacts(look: Observation) -> set[tuple[object, ...]]:
    """What is told of a step's contacts, in no order; normals are made unit vectors by two libraries' square roots."""
    return {
        (
            contact.first,
            contact.second,
            contact.time_s,
            contact.impulse_n_s,
            *np.asarray(contact.normal, np.float32).tolist(),
        )
        for contact in look.contacts
    }


@pytest.mark.parametrize("scene", SCENES, ids=lambda scene: scene.name)
@pytest.mark.parametrize(("profile", "changes"), [("default", {}), ("tuned", AS_NPM), ("swept", AS_NPM)])
def test_both_are_the_same_to_the_bit(
    scene: Scene, profile: str, changes: dict[str, Setting], named: Named, drive: Drive
) -> None:
    """After every step all positions and velocities are equal, and contacts with their times, normals and impulses."""
    plane = drive(named("rapier2d"), scene, DT_S, profile)
    space = drive(named("rapier"), scene, DT_S, profile, **changes)
    for one, other in zip(plane, space, strict=True):
        np.testing.assert_array_equal(one.position_m, other.position_m)
        np.testing.assert_array_equal(one.velocity_m_s, other.velocity_m_s)
        assert impacts(one) == impacts(other)


@pytest.mark.parametrize(("name", "same"), [("paper/multiple", True), ("classics/slanted-wall", False)])
def test_the_tuned_ones_part_at_fixed_bodies(name: str, same: bool, named: Named, drive: Drive) -> None:
    """The wheel leaves overlaps with walls alone, which npm's can't be told: without walls they are the same."""
    (scene,) = (scene for scene in SCENES if scene.name == name)
    changes = {setting: value for setting, value in AS_NPM.items() if setting != "static_contact_natural_frequency"}
    plane = drive(named("rapier2d"), scene, DT_S, "tuned")
    space = drive(named("rapier"), scene, DT_S, "tuned", **changes)
    assert same == all((one.position_m == other.position_m).all() for one, other in zip(plane, space, strict=True))
