"""What engines make of walls of edges: thin ones, those in pieces, driven ones, and two places pushed at once.

Rows of engines that are no part of `all` are run with `-m engines`: adapters build walls of capsules, lines and boxes.
"""

import math
from typing import Any

import numpy as np
import pytest
from tests.adapters.engine_scenes import build_floor_scene, build_thin_wall_scene
from tests.cases import each, release_after
from tests.scene_builders import Finish, Named, disc_at, drive_on_legs, staged

from carom import Chain
from carom.catalogue import all_scenes
from carom.engines.api import Adapter, AdapterError

STARTS = 16

#: Error of velocities after a bounce, relative to the speed; 1e-6 in other engines.
ROUNDING = {"box2d3": 1e-5, "rapier2d": 1e-5, "mujoco": 1e-12, "pybullet": 1e-12}


def optional_engine_rows(**profiles: str) -> list[Any]:
    """Return rows of engine, profile and half width, without thickness and with, of engines not in `all`."""
    return [
        pytest.param(name, profile, width, marks=pytest.mark.engines)
        for name, several in profiles.items()
        for profile in several.split()
        for width in (0.0, 0.02)
    ]


@each("q", release_after(1, [3.0, 0.9, 1.5, 20.0]))
@each(
    "name, profile, half_width_m",
    [
        *(("pymunk", "default", 0.0), ("pymunk", "tuned", 0.0), ("mujoco", "no-ccd", 0.02)),
        ("pybullet", "no-ccd", 0.0),
        *optional_engine_rows(jolt="tuned", physx="tuned", p2="default tuned", cannon="default tuned"),
        *optional_engine_rows(matter="tuned", rapier2d="tuned ccd"),
    ],
)
def test_discrete_engines_tunnel_as_often_as_the_closed_form(
    named: Named, finish: Finish, name: str, profile: str, half_width_m: float, q: float
) -> None:
    """A share max(0, 1 - 1/q) of even starts passes a thin wall at q reaches a step, to one of sixteen."""
    scenes = [build_thin_wall_scene(q, k / STARTS, half_width_m=half_width_m) for k in range(STARTS)]
    passed = sum(finish(named(name), scene, 1 / 60, profile).position_m[0, 0] > 0 for scene in scenes)
    assert abs(passed - STARTS * max(0.0, 1 - 1 / q)) <= 1


@each("q", release_after(2, [0.9, 19.0, 1.5, 3.0]))
@each(
    "name, profile, half_width_m",
    [
        *(("box2d", "default", 0.0), ("box2d", "tuned", 0.0), ("mujoco", "tuned", 0.0), ("pybullet", "tuned", 0.0)),
        *optional_engine_rows(
            jolt="swept", p2="swept", physx="swept", rapier="default tuned", box2d3="default tuned swept"
        ),
        *optional_engine_rows(rapier2d="default swept"),  # of contacts ahead: from segments and capsules
    ],
)
def test_swept_discs_never_pass_a_thin_wall(
    named: Named, finish: Finish, name: str, profile: str, half_width_m: float, q: float
) -> None:
    """With a sweep a disc comes back from each of sixteen starts, its velocity reversed to rounding."""
    for k in range(STARTS):
        scene = build_thin_wall_scene(q, k / STARTS, half_width_m=half_width_m)
        speed = scene.discs[0].velocity_m_s[0]
        seen = finish(named(name), scene, 1 / 60, profile)
        np.testing.assert_allclose(seen.velocity_m_s[0], (-speed, 0.0), atol=ROUNDING.get(name, 1e-6) * speed)


@each(
    "name",
    [
        *("pymunk", "box2d", "mujoco", "pybullet"),
        *(
            pytest.param(name, marks=pytest.mark.engines)
            for name in ["planck", "box2d3", "rapier2d", "rapier", "jolt", "physx", "havok", "p2", "cannon", "matter"]
        ),
    ],
)
def test_a_leg_begins_at_the_step_at_or_after_its_instant(named: Named, finish: Finish, name: str) -> None:
    """A leg that begins within a step starts with the next step, so its body is behind by its speed times that."""
    dt_s, rounding = 1 / 64, 2e-6
    for k in range(0, STARTS, 5):
        legs = drive_on_legs((0.0, (0.0, 0.0)), (0.25 + k / STARTS * dt_s, (2.0, -1.0)))
        late = disc_at(0.0, 0.0, r=0.25, m=math.inf, driven=True, **legs)
        scene = staged("late", disc_at(0.75, -0.25, r=0.25), late, duration_s=1.0)
        seen = finish(named(name), scene, dt_s, "tuned")
        moved_s = 0.75 - (k > 0) * dt_s
        np.testing.assert_allclose(seen.position_m[1], (2 * moved_s, -moved_s), rtol=0, atol=rounding)
        np.testing.assert_allclose(seen.velocity_m_s[1], (2.0, -1.0), rtol=0, atol=rounding)
        # The other disc is struck along a normal that the step decides, and by no more than twice the speed.
        assert 0.0 < float(np.hypot(*seen.velocity_m_s[0])) <= 2 * math.hypot(2, 1) + 10 * rounding


@each("profile", ["default", "tuned"])
def test_pybullet_contacts_are_projected_into_the_plane(named: Named, profile: str) -> None:
    """In a box of moving edges normals have unit length, and impulses along them are the change of momentum."""
    scene, adapter = all_scenes()["driven/moving-box"].scene, named("pybullet")
    world = adapter.prepare(scene, adapter.profiles[profile].settings(1 / 60))
    last, contacts = world.observe(), 0
    for _ in range(scene.step_count(1 / 60)):
        world.advance(1)
        now = world.observe()
        pushed = sum((np.multiply(c.normal, c.impulse_n_s or 0.0) for c in now.contacts), start=np.zeros(2))
        change = scene.discs[0].mass_kg * (now.velocity_m_s[0] - last.velocity_m_s[0])
        np.testing.assert_allclose(-pushed, change, rtol=0, atol=1e-14)
        assert all(abs(math.hypot(*contact.normal) - 1.0) <= 1e-15 for contact in now.contacts)
        last, contacts = now, contacts + len(now.contacts)
    world.close()
    assert contacts > 10


def test_pybullet_refuses_spinning_or_fast_driven_discs(pybullet: Adapter) -> None:
    """Bullet bends the path of a driven disc that spins, and clamps its speed to 100 m/s, so both are refused."""
    for velocity, spin in (((-1.0, 0.0), 2.0), ((-101.0, 0.0), 0.0)):
        mallet = disc_at(0.5, 0, *velocity, m=math.inf, driven=True, spin_rad_s=spin)
        scene = staged("mallet", disc_at(-1, 0, 2), mallet, duration_s=1.0)
        with pytest.raises(AdapterError, match="driven"):
            pybullet.prepare(scene, pybullet.profiles["tuned"].settings(1 / 60))


@each(
    "name, profile, least, most, by_m_s",
    [
        ("pymunk", "default", 1, STARTS, 1.0),
        ("pymunk", "tuned", 0, 0, 1e-12),
        ("box2d", "default", 1, STARTS, 1.0),
        ("box2d", "tuned", 0, 0, 0.0),
        *(
            pytest.param(*row, marks=pytest.mark.engines)
            for row in (
                ("jolt", "default", 1, 4, 1e-3),  # without `mEnhancedInternalEdgeRemoval`, which tuned has
                ("jolt", "tuned", 0, 0, 1e-3),
                ("physx", "default", 16, 16, 1e-3),  # inelastic below 2 m/s: it slides, and catches on each joint
                ("physx", "tuned", 0, 0, 1e-3),
                ("havok", "default", 1, 6, 1e-3),
                ("p2", "tuned", 0, 0, 1e-3),
                ("cannon", "tuned", 0, 3, 1e-3),
                ("matter", "tuned", 1, 5, 1e-3),
                ("box2d3", "default", 1, 4, 1e-3),
                ("box2d3", "tuned", 0, 0, 1e-3),
                ("box2d3", "swept", 0, 0, 1e-3),
                ("rapier2d", "default", 1, 7, 1.0),
                ("rapier2d", "tuned", 1, 7, 1.0),
            )
        ),
    ],
)
def test_number_of_discs_that_catch_on_floor_joints(
    named: Named, finish: Finish, name: str, profile: str, least: int, most: int, by_m_s: float
) -> None:
    """A floor in ten pieces deflects the listed numbers of 16 discs; in one piece, none in planar engines."""
    for half_width_m in (0.0,) if name in {"pymunk", "box2d"} else (0.0, 0.02):
        caught = 0
        for start in range(STARTS):
            floors = [build_floor_scene(pieces, start / STARTS, half_width_m=half_width_m) for pieces in (1, 10)]
            whole, pieced = (finish(named(name), floor, 1 / 60, profile).velocity_m_s[0] for floor in floors)
            if name in {"box2d3", "rapier2d"}:
                np.testing.assert_allclose(whole, (5.0, 2.0), atol=5 * ROUNDING[name])
            caught += bool(np.abs(pieced - whole).max() > by_m_s)
        assert least <= caught <= most


@each("name, rounding", [("pymunk", 1e-12), ("pybullet", 1e-12), ("mujoco", 1e-9), ("box2d", 1e-5)])
def test_pushes_of_two_edges_are_reported_as_one_contact(named: Named, name: str, rounding: float) -> None:
    """In a corner of a chain one contact has the whole change of velocity that both edges cause in a step."""
    lands = 0.31  # between two steps, so that both are found in one
    disc = disc_at(0.25 + 3 * lands, 0.25 + 4 * lands, -3, -4, r=0.25)
    walls = Chain(points_m=[(5, 0), (0, 0), (0, 5)])
    scene = staged("corner", disc, walls, duration_s=1.0)
    adapter = named(name)
    world = adapter.prepare(scene, adapter.profiles["tuned"].settings(1 / 60))
    told, velocity = [], np.array([-3.0, -4.0])
    for _ in range(30):
        world.advance(1)
        seen = world.observe()
        told += [contact.impulse_n_s * np.array(contact.normal) for contact in seen.contacts]
        if len(told) == 1 and seen.contacts:
            velocity = velocity - told[0]
            np.testing.assert_allclose(seen.velocity_m_s[0], velocity, rtol=0, atol=rounding)
    world.close()
    assert len(told) == 1
    np.testing.assert_allclose(velocity, [3.0, 4.0], rtol=0, atol=rounding)
    assert math.hypot(*told[0]) == pytest.approx(10.0, abs=rounding)
