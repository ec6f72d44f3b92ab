"""Unexpected behaviour of Rapier, and the equality of its two builds."""

import numpy as np
import pytest
from tests.cases import each
from tests.scene_builders import Drive, Named, disc_at, staged

from carom import Scene
from carom.catalogue import find_scenes
from carom.engines.api import Adapter, Observation, Setting

#: Relative rounding of a 32-bit float.
ROUNDING = 2.0**-23


def test_rapier_moves_bodies_before_it_applies_restitution(rapier: Adapter, drive: Drive) -> None:
    """In the step of a bounce both discs first move with half the speed, as if e were 0, then exchange velocities."""
    dt_s = 1 / 64
    for phase in range(16):
        discs = disc_at(-2 - phase / 16 * 4 * dt_s, 0, 4), disc_at(0, 0)
        seen = drive(rapier, staged("bounce", *discs, duration_s=1.0), dt_s)
        hit = next(k for k, one in enumerate(seen) if one.contacts)
        moved = seen[hit].position_m - seen[hit - 1].position_m
        assert moved[:, 0] == pytest.approx([4 / 2 * dt_s] * 2, abs=4 * ROUNDING)
        assert seen[hit].velocity_m_s[:, 0] == pytest.approx([0, 4], abs=4 * 4 * ROUNDING)


DT_S = 1 / 60
SCENES = [entry.scene for entry in find_scenes(["paper", "classics", "gravity", "engines"])]
#: What the package from npm leaves as it is shipped, and how it lifts the limit of speeds.
AS_NPM: dict[str, Setting] = {
    "static_contact_natural_frequency": 60.0,
    "length_unit": 1024.0,
    "normalized_max_linear_velocity": 400.0,
}


def list_contacts(observation: Observation) -> set[tuple[object, ...]]:
    """Reported contacts of a step, in no order; normals are made unit vectors by two libraries' square roots."""
    contacts = observation.contacts
    return {(one.first, one.second, one.time_s, one.impulse_n_s, *map(np.float32, one.normal)) for one in contacts}


@each("scene", SCENES)
@each("profile, changes", [("default", {}), ("tuned", AS_NPM), ("swept", AS_NPM)])
def test_rapier_wheel_and_npm_package_are_bit_identical(
    scene: Scene, profile: str, changes: dict[str, Setting], named: Named, drive: Drive
) -> None:
    """Positions, velocities and contacts of both builds are equal after every step, with equal settings."""
    plane = drive(named("rapier2d"), scene, DT_S, profile)
    space = drive(named("rapier"), scene, DT_S, profile, **changes)
    for one, other in zip(plane, space, strict=True):
        np.testing.assert_array_equal(one.position_m, other.position_m)
        np.testing.assert_array_equal(one.velocity_m_s, other.velocity_m_s)
        assert list_contacts(one) == list_contacts(other)
