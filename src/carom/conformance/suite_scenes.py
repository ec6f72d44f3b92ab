"""Scenes of the suite: names of catalogue scenes, and builders of scenes that each test one feature."""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from typing import Any

from carom.catalogue.groups.classics_walled import FLOOR
from carom.catalogue.staging import build_disc
from carom.comparator.thresholds import THRESHOLDS
from carom.engines.api.declarations import Capabilities
from carom.model.scene import Chain, Disc, Ring, Scene, Wall

#: Names of the suite's scenes from the catalogue. New catalogue scenes are not added automatically, so that existing
#: adapters get no new cases. The list has no scene with several possible answers, and no chaotic scene.
CATALOGUE_SCENES = (
    "paper/missed",
    "paper/late",
    "paper/wrong-direction",
    "paper/multiple",
    "classics/head-on",
    "classics/oblique-3-4-5",
    "classics/inelastic-oblique",
    "classics/perfectly-inelastic",
    "classics/deflection",
    "classics/graze",
    "classics/miss",
    "classics/touching-apart",
    "classics/mass-ratio-1000",
    "classics/bullet",
    "classics/box",
    "classics/restitution-ladder",
    "classics/slanted-wall",
    "classics/bank-shot",
    "classics/sorting",
    "classics/cradle-gaps",
    "spin/grip",
    "spin/slide",
    "spin/striker-slide",
    "spin/throw-slide",
    "spin/throw-stick",
    "spin/gearing",
    "spin/english-stick",
    "spin/english-slide",
)

#: Names of the scenes for the profile `located`: head-on, off-centre, inelastic and successive impacts, impacts on
#: walls, and impacts with friction.
LOCATED_SCENES = (
    "paper/missed",
    "paper/late",
    "classics/head-on",
    "classics/oblique-3-4-5",
    "classics/perfectly-inelastic",
    "classics/slanted-wall",
    "classics/cradle-gaps",
    "spin/grip",
    "spin/throw-slide",
    "spin/english-stick",
)

#: Step size for all other scenes, in seconds. The step size is a power of two, so that floats represent step boundaries
#: exactly.
DT_S = 1 / 128

#: Number of steps after which the bodies in the scene of `build_rubbing` touch.
TOUCH_STEPS = 8


def _build_scene(name: str, discs: Sequence[Disc], duration_s: float, **fields: Any) -> Scene:
    return Scene(name=f"conformance-{name}", discs=discs, duration_s=duration_s, **fields)


def build_crowd() -> Scene:
    """Return nine discs of different masses that collide and fly apart, without walls or immovable discs."""
    discs = []
    for i in range(9):
        angle = 2 * math.pi * i / 9
        velocity = cmath.rect(-(1.5 + 0.1 * (i % 4)), angle + 0.05 * i)
        discs.append(build_disc(cmath.rect(2.0 + 0.13 * i, angle), velocity, 0.25, 1.0 + 0.5 * (i % 3)))
    return _build_scene("crowd", discs, 2.5)


def build_walled_box() -> Scene:
    """Return the scene of `build_crowd` within four walls."""
    normals = ((1, 0), (0, 1), (-1, 0), (0, -1))
    walls = [Wall(point_m=(3.6 * -nx, 3.6 * -ny), normal=(nx, ny)) for nx, ny in normals]
    return _build_scene("box", build_crowd().discs, 2.5, walls=walls)


def build_approach(speed_m_s: float = 3.0, gap_m: float = 1.01, x_m: float = 0.0, radius_m: float = 0.5) -> Scene:
    """Return a disc that meets an equal disc at rest head-on. The struck disc gets the velocity of the other disc."""
    discs = [build_disc(x_m, speed_m_s, radius_m), build_disc(x_m + 2 * radius_m + gap_m, 0, radius_m)]
    return _build_scene(f"approach-{speed_m_s:g}-{x_m:g}-{radius_m:g}", discs, 2 * gap_m / speed_m_s)


def build_single_disc(speed_m_s: float = 1.0, x_m: float = 0.0, radius_m: float = 0.5, mass_kg: float = 1.0) -> Scene:
    """Return a scene of a few steps with one free disc."""
    name = f"alone-{speed_m_s:g}-{x_m:g}-{radius_m:g}" + (f"-{mass_kg:g}" if mass_kg != 1.0 else "")
    return _build_scene(name, [build_disc(x_m, speed_m_s, radius_m, mass_kg)], 4 * DT_S)


def build_spinning_disc(spin_rad_s: float) -> Scene:
    """Return a scene with one free spinning disc."""
    return _build_scene(f"spinning-{spin_rad_s:g}", [build_disc(0, 1, 0.5, spin_rad_s=spin_rad_s)], 4 * DT_S)


def build_bullet(phase: float) -> Scene:
    """Return a fast disc that meets a disc at rest head-on.

    In 1/60 s, the fast disc moves farther than the sum of both diameters.
    """
    start_m = -0.3 - 100 / 60 * (2 + phase)
    return _build_scene(f"bullet-{phase:g}", [build_disc(start_m, 100, 0.05), build_disc(0, 0, 0.25, 3)], 6 / 60)


def build_bounce_and_pair(restitution: float, wall_restitution: float, *, wall: bool) -> Scene:
    """Return a disc of 1 kg at 1 m/s that meets a disc of 2 kg at -2 m/s. With `wall`, a third disc hits a wall."""
    name = f"restitution-{restitution:g}-{wall_restitution:g}"
    discs, laws = [build_disc(0, 1, 0.5), build_disc(2.01, -2, 0.5, 2.0)], dict[str, Any]()
    if wall:
        discs.append(build_disc(9j, 3j, 0.5, 1.5))
        laws["walls"] = [Wall(point_m=(0, 10.01), normal=(0, -1))]
    return _build_scene(name, discs, 0.75, restitution=restitution, wall_restitution=wall_restitution, **laws)


_EDGE_PLACES = [(complex(1.51 * side, side), -3 * side) for side in (-1, 1)]


def _build_head_on(
    name: str,
    capabilities: Capabilities,
    places: Sequence[tuple[complex, float]],
    wall: Wall | Chain | Ring,
    duration_s: float = 0.6,
    **laws: Any,
) -> Scene:
    """Return a scene of discs that meet a wall head-on.

    `places` contains the centre and the velocity along x of each disc.
    """
    restitution, discs = capabilities.restitution[1], [build_disc(place, speed, 0.5) for place, speed in places]
    laws |= {"walls": [wall], "wall_restitution": restitution}
    return _build_scene(f"{name}-{restitution:g}", discs, duration_s, **laws)


def build_two_sided_edge(capabilities: Capabilities) -> Scene:
    """Return a single edge that two discs meet head-on at 3 m/s, one from each side."""
    return _build_head_on("edge", capabilities, _EDGE_PLACES, Chain(points_m=[(0, -2), (0, 2)]))


def build_two_sided_circle(capabilities: Capabilities) -> Scene:
    """Return a circle that two discs meet head-on at 3 m/s, one from inside and one from outside."""
    return _build_head_on("circle", capabilities, [(0.99, 3), (4.51, -3)], Ring(centre_m=(0, 0), radius_m=2.5))


def build_outside_circle(capabilities: Capabilities) -> Scene:
    """Return a circle that a disc meets head-on from outside at 3 m/s."""
    return _build_head_on("outside", capabilities, [(4.51, -3)], Ring(centre_m=(0, 0), radius_m=2.5))


def build_starting_paddle(capabilities: Capabilities) -> Scene:
    """Return a half-plane that starts to move after 0.25 s, at 1 m/s.

    A disc meets the half-plane at -3 m/s and leaves at (1 + 4 e) m/s.
    """
    legs = [{"from_s": 0.0, "velocity_m_s": (0.0, 0.0)}, {"from_s": 0.25, "velocity_m_s": (1.0, 0.0)}]
    return _build_head_on("legs", capabilities, [(2.01, -3)], Wall(point_m=(0, 0), normal=(1, 0), legs=legs), 0.8)


def build_belt(capabilities: Capabilities) -> Scene:
    """Return a half-plane with a surface speed of 9 m/s.

    A disc meets the half-plane head-on at 3 m/s and slips on its surface.
    """
    friction, wall = min(0.25, capabilities.friction[1]), Wall(point_m=(0, 0), normal=(1, 0), surface_speed_m_s=9.0)
    return _build_head_on(f"belt-{friction:g}", capabilities, [(1.51, -3)], wall, wall_friction=friction)


def build_edge_belt(capabilities: Capabilities) -> Scene:
    """Return an edge with a surface speed of 9 m/s. Two discs meet the edge, one from each side, and slip on it."""
    friction, edge = min(0.25, capabilities.friction[1]), Chain(points_m=[(0, -2), (0, 2)], surface_speed_m_s=9.0)
    return _build_head_on(f"edge-belt-{friction:g}", capabilities, _EDGE_PLACES, edge, wall_friction=friction)


def build_two_walls(first: float, second: float) -> Scene:
    """Return two half-planes with different restitutions. Discs meet the half-planes head-on at 3 m/s."""
    left = Wall(point_m=(-3, 0), normal=(1, 0), restitution=first)
    right = Wall(point_m=(3, 0), normal=(-1, 0), restitution=second)
    discs = [build_disc(complex(1.49 * side, side), 3 * side, 0.5) for side in (-1, 1)]
    return _build_scene(f"walls-{first:g}-{second:g}", discs, 0.6, walls=[left, right], wall_restitution=first)


def build_paddle(capabilities: Capabilities, *, edge: bool = False) -> Scene:
    """Return a half-plane or edge that moves at 1 m/s. A disc meets the wall at -3 m/s and leaves at (1 + 4 e) m/s."""
    name, moves = f"paddle-{'edge' if edge else 'wall'}", {"velocity_m_s": (1, 0)}
    wall = Chain(points_m=[(0, -2), (0, 2)], **moves) if edge else Wall(point_m=(0, 0), normal=(1, 0), **moves)
    return _build_head_on(name, capabilities, [(1.51, -3)], wall)


def build_mallet(capabilities: Capabilities) -> Scene:
    """Return a driven disc at 1 m/s. A free disc meets the driven disc at -3 m/s and leaves at (1 + 4 e) m/s."""
    restitution = capabilities.restitution[1]
    discs = [build_disc(0, 1, 0.5, math.inf, driven=True), build_disc(2.01, -3, 0.5)]
    return _build_scene(f"mallet-{restitution:g}", discs, 0.6, restitution=restitution)


def build_post(*, first: bool = False) -> Scene:
    """Return a disc of 2 kg that meets an immovable disc at 3 m/s. With `first`, the immovable disc is disc 0."""
    discs = [build_disc(0, 3, 0.5, 2.0), build_disc(2.01, 0, 0.5, math.inf)]
    return _build_scene("post-first", discs[::-1], 0.6) if first else _build_scene("post", discs, 0.6)


def build_posts() -> Scene:
    """Return a scene of two overlapping immovable discs. Nothing happens in this scene."""
    return _build_scene("posts", [build_disc(x, 0, 1, math.inf) for x in (0, 1)], 0.1)


def build_fall() -> Scene:
    """Return a disc that falls for half a second."""
    return _build_scene("fall", [build_disc(0, 1, 0.5)], 0.5, gravity_m_s2=(0, -8))


def build_damped_disc(*, spins: bool) -> Scene:
    """Return a damped disc that moves for half a second. With `spins`, the disc also spins."""
    disc = build_disc(0, 0.6 - 0.8j, 0.5, spin_rad_s=1.0 if spins else 0.0)
    return _build_scene(f"slowing{'-spin' * spins}", [disc], 0.5, damping_per_s=0.8)


def build_rolling_disc() -> Scene:
    """Return a disc that rolls for half a second on a floor with rolling resistance."""
    laws = {"restitution": 0.0, "wall_restitution": 0.0, "friction": 0.5, "wall_friction": 0.5}
    fields = {"walls": [FLOOR], "wall_rolling_resistance": 0.1, "gravity_m_s2": (0, -8), **laws}
    return _build_scene("rolling", [build_disc(0.5j, 1, 0.5, spin_rad_s=-2)], 0.5, **fields)


def build_sliding_disc() -> Scene:
    """Return a disc on a table that slows it down for half a second."""
    return _build_scene("table", [build_disc(0, 0.6 - 0.8j, 0.5)], 0.5, table_deceleration_m_s2=0.5)


def build_mixed_contacts(*, wall: bool, restitution: float) -> Scene:
    """Return two discs that meet off-centre. With `wall`, the first disc also bounces off a slanted wall.

    If the restitution is below 1, discs separate slowly and still overlap for some steps. Contacts during these steps
    have no impulse.
    """
    walls = [Wall(point_m=(-1, 0), normal=(1, 0.2))] if wall else []
    discs = [build_disc(0, 3, 0.5), build_disc(1.72 + 0.3j, -1 + 0.1j, 0.5, 2)]
    return _build_scene("contacts", discs, 3.0, walls=walls, restitution=restitution, wall_restitution=restitution)


def build_rubbing(
    capabilities: Capabilities,
    friction: float,
    wall_friction: float,
    inertia_factor: float = 0.5,
    restitution: float = 1.0,
) -> Scene:
    """Return two discs that collide along x and slip on each other. If walls are supported, a third disc hits a wall.

    The bodies touch just before the end of a step, so that they overlap only slightly at the end of the step. The
    overlap is smaller than the allowed rounding error, but not lost in the rounding of floats. So the normal and the
    lever arm of friction are correct even in an engine that computes them from overlapping positions.
    """
    factor = inertia_factor if capabilities.spin else math.inf
    turns = math.isfinite(factor)
    # All bodies approach at 3 m/s.
    late_s = TOUCH_STEPS * DT_S - 0.25 * THRESHOLDS.rounding_of(capabilities.float_bits) / 3
    discs = [
        build_disc(place - velocity * late_s, velocity, 0.5, mass, spin_rad_s=spin * turns, inertia_factor=factor)
        for place, velocity, spin, mass in (
            (0, 2 + 0.5j, 6.0, 1.0),
            (1, -1 - 0.25j, 2.0, 2.0),
            (9.5j, 2 + 3j, -8.0, 1.5),
        )
    ]
    laws: dict[str, Any] = {"friction": friction, "restitution": restitution, "wall_restitution": restitution}
    if capabilities.walls:
        laws |= {"walls": [Wall(point_m=(0, 10), normal=(0, -1))], "wall_friction": wall_friction}
    name = f"friction-{friction:g}-{wall_friction:g}-{inertia_factor:g}"
    return _build_scene(name, discs if capabilities.walls else discs[:2], 2 * TOUCH_STEPS * DT_S, **laws)


def build_rubbing_crowd(capabilities: Capabilities, friction: float, restitution: float) -> Scene:
    """Return the scene of `build_crowd` with spinning discs and friction. If walls are supported, add four walls."""
    scene = build_walled_box() if capabilities.walls else build_crowd()
    spun = {"spin_rad_s": 4.0} if capabilities.spin else {"inertia_factor": math.inf}
    discs = [disc.model_copy(update={k: v * (-1) ** i for k, v in spun.items()}) for i, disc in enumerate(scene.discs)]
    update = {"name": "conformance-rubbing", "discs": tuple(discs), "friction": friction, "wall_friction": friction}
    return scene.model_copy(update=update | {"restitution": restitution, "wall_restitution": restitution})
