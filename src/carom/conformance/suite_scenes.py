"""Scenes of the suite that test one feature each. `known_answers` lists the suite's scenes from the catalogue."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from carom.comparator.thresholds import THRESHOLDS
from carom.engines.api.declarations import Capabilities
from carom.model.scene import Chain, Disc, Ring, Scene, Wall

#: Step of the suite's own scenes. The step is a power of two, so that step boundaries are exact floats.
DT_S = 1 / 128

#: Number of steps after which the bodies of `rubbing` touch.
TOUCH_STEPS = 8


def build_crowd() -> Scene:
    """Return nine discs of different masses that collide and fly apart, without walls or immovable discs."""
    discs = []
    for i in range(9):
        angle, distance = 2 * math.pi * i / 9, 2.0 + 0.13 * i
        inwards = (-math.cos(angle + 0.05 * i), -math.sin(angle + 0.05 * i))
        speed = 1.5 + 0.1 * (i % 4)
        discs.append(
            Disc(
                position_m=(distance * math.cos(angle), distance * math.sin(angle)),
                velocity_m_s=(speed * inwards[0], speed * inwards[1]),
                radius_m=0.25,
                mass_kg=1.0 + 0.5 * (i % 3),
            )
        )
    return Scene(name="conformance-crowd", discs=discs, duration_s=2.5)


def build_walled_box() -> Scene:
    """Return the crowd within four walls."""
    walls = [
        Wall(point_m=(-3.6, 0), normal=(1, 0)),
        Wall(point_m=(0, -3.6), normal=(0, 1)),
        Wall(point_m=(3.6, 0), normal=(-1, 0)),
        Wall(point_m=(0, 3.6), normal=(0, -1)),
    ]
    return Scene(name="conformance-box", discs=build_crowd().discs, walls=walls, duration_s=2.5)


def build_approach(speed_m_s: float = 3.0, gap_m: float = 1.01, x_m: float = 0.0, radius_m: float = 0.5) -> Scene:
    """Return a disc that meets an equal disc at rest head-on. The struck disc takes over the velocity."""
    discs = [
        Disc(position_m=(x_m, 0), velocity_m_s=(speed_m_s, 0), radius_m=radius_m),
        Disc(position_m=(x_m + 2 * radius_m + gap_m, 0), radius_m=radius_m),
    ]
    duration_s = 2 * gap_m / speed_m_s
    return Scene(name=f"conformance-approach-{speed_m_s:g}-{x_m:g}-{radius_m:g}", discs=discs, duration_s=duration_s)


def build_single_disc(speed_m_s: float = 1.0, x_m: float = 0.0, radius_m: float = 0.5, mass_kg: float = 1.0) -> Scene:
    """Return a scene of a few steps with one free disc."""
    disc = Disc(position_m=(x_m, 0), velocity_m_s=(speed_m_s, 0), radius_m=radius_m, mass_kg=mass_kg)
    name = f"conformance-alone-{speed_m_s:g}-{x_m:g}-{radius_m:g}" + (f"-{mass_kg:g}" if mass_kg != 1.0 else "")
    return Scene(name=name, discs=[disc], duration_s=4 * DT_S)


def build_spinning_disc(spin_rad_s: float) -> Scene:
    """Return a scene with one free spinning disc."""
    free = build_single_disc()
    discs = (free.discs[0].model_copy(update={"spin_rad_s": spin_rad_s}),)
    return free.model_copy(update={"name": f"conformance-spinning-{spin_rad_s:g}", "discs": discs})


def build_bullet(phase: float) -> Scene:
    """Return a fast disc that meets a disc at rest head-on, and would pass through it within a step of 1/60 s."""
    step_m = 100 / 60
    start_m = -0.3 - step_m * (2 + phase)
    discs = [
        Disc(position_m=(start_m, 0), velocity_m_s=(100, 0), radius_m=0.05, mass_kg=1),
        Disc(position_m=(0, 0), radius_m=0.25, mass_kg=3),
    ]
    return Scene(name=f"conformance-bullet-{phase:g}", discs=discs, duration_s=6 / 60)


def build_bounce_and_pair(restitution: float, wall_restitution: float, *, wall: bool) -> Scene:
    """Return a disc of 1 kg at 1 m/s that meets a disc of 2 kg at -2 m/s; with `wall`, also a disc and a wall."""
    discs = [
        Disc(position_m=(0, 0), velocity_m_s=(1, 0), radius_m=0.5, mass_kg=1.0),
        Disc(position_m=(2.01, 0), velocity_m_s=(-2, 0), radius_m=0.5, mass_kg=2.0),
    ]
    if wall:
        discs.append(Disc(position_m=(0, 9), velocity_m_s=(0, 3), radius_m=0.5, mass_kg=1.5))
    return Scene(
        name=f"conformance-restitution-{restitution:g}-{wall_restitution:g}",
        discs=discs,
        walls=[Wall(point_m=(0, 10.01), normal=(0, -1))] if wall else [],
        restitution=restitution,
        wall_restitution=wall_restitution,
        duration_s=0.75,
    )


def _build_head_on(
    name: str, places: Sequence[tuple[float, float, float]], walls: Sequence[Any], **fields: Any
) -> Scene:
    """Return a scene of discs that meet walls head-on. `places` has x, y and the velocity along x of each disc."""
    discs = [Disc(position_m=(x, y), velocity_m_s=(speed, 0), radius_m=0.5) for x, y, speed in places]
    return Scene(**{"name": f"conformance-{name}", "discs": discs, "walls": walls, "duration_s": 0.6, **fields})


def build_two_sided_edge(restitution: float) -> Scene:
    """Return a single edge that two discs meet head-on at 3 m/s, one from either side."""
    places, edge = [(side * 1.51, side, -3 * side) for side in (-1, 1)], Chain(points_m=[(0, -2), (0, 2)])
    return _build_head_on(f"edge-{restitution:g}", places, [edge], wall_restitution=restitution)


def build_two_sided_circle(restitution: float) -> Scene:
    """Return a circle that two discs meet head-on at 3 m/s, one from inside and one from outside."""
    circle = Ring(centre_m=(0, 0), radius_m=2.5)
    return _build_head_on(
        f"circle-{restitution:g}", [(0.99, 0, 3), (4.51, 0, -3)], [circle], wall_restitution=restitution
    )


def build_outside_circle(restitution: float) -> Scene:
    """Return a circle that a disc meets head-on from outside at 3 m/s."""
    circle = Ring(centre_m=(0, 0), radius_m=2.5)
    return _build_head_on(f"outside-{restitution:g}", [(4.51, 0, -3)], [circle], wall_restitution=restitution)


def build_starting_paddle(restitution: float) -> Scene:
    """Return a half-plane that moves at 1 m/s after 0.25 s.

    A disc meets the half-plane at -3 m/s and leaves at (1 + 4 e) m/s.
    """
    legs = [{"from_s": 0.0, "velocity_m_s": (0.0, 0.0)}, {"from_s": 0.25, "velocity_m_s": (1.0, 0.0)}]
    wall = Wall(point_m=(0, 0), normal=(1, 0), legs=legs)
    laws = {"wall_restitution": restitution, "duration_s": 0.8}
    return _build_head_on(f"legs-{restitution:g}", [(2.01, 0, -3)], [wall], **laws)


def build_belt(friction: float, restitution: float) -> Scene:
    """Return a half-plane with a surface speed of 9 m/s. A disc meets it head-on at 3 m/s and slips on it."""
    wall = Wall(point_m=(0, 0), normal=(1, 0), surface_speed_m_s=9.0)
    laws = {"wall_restitution": restitution, "wall_friction": friction}
    return _build_head_on(f"belt-{friction:g}-{restitution:g}", [(1.51, 0, -3)], [wall], **laws)


def build_edge_belt(friction: float, restitution: float) -> Scene:
    """Return an edge with a surface speed of 9 m/s. Two discs meet it, one from either side, and slip on it."""
    edge = Chain(points_m=[(0, -2), (0, 2)], surface_speed_m_s=9.0)
    places = [(side * 1.51, side, -3 * side) for side in (-1, 1)]
    laws = {"wall_restitution": restitution, "wall_friction": friction}
    return _build_head_on(f"edge-belt-{friction:g}-{restitution:g}", places, [edge], **laws)


def build_two_walls(first: float, second: float) -> Scene:
    """Return two half-planes with different restitutions that discs meet head-on at 3 m/s."""
    left = Wall(point_m=(-3, 0), normal=(1, 0), restitution=first)
    right = Wall(point_m=(3, 0), normal=(-1, 0), restitution=second)
    places = [(side * 1.49, side, 3 * side) for side in (-1, 1)]
    return _build_head_on(f"walls-{first:g}-{second:g}", places, [left, right], wall_restitution=first)


def build_paddle(restitution: float, *, edge: bool = False) -> Scene:
    """Return a half-plane or edge that moves at 1 m/s. A disc meets the wall at -3 m/s and leaves at (1 + 4 e) m/s."""
    shape = {"points_m": [(0, -2), (0, 2)]} if edge else {"point_m": (0, 0), "normal": (1, 0)}
    wall = {**shape, "velocity_m_s": (1, 0)}
    name = f"paddle-{'edge' if edge else 'wall'}-{restitution:g}"
    return _build_head_on(name, [(1.51, 0, -3)], [wall], wall_restitution=restitution)


def build_mallet(restitution: float) -> Scene:
    """Return a driven disc at 1 m/s. A free disc meets the driven disc at -3 m/s and leaves at (1 + 4 e) m/s."""
    discs = [
        Disc(position_m=(0, 0), velocity_m_s=(1, 0), radius_m=0.5, mass_kg=math.inf, driven=True),
        Disc(position_m=(2.01, 0), velocity_m_s=(-3, 0), radius_m=0.5),
    ]
    return Scene(name=f"conformance-mallet-{restitution:g}", discs=discs, restitution=restitution, duration_s=0.6)


def build_post(*, first: bool = False) -> Scene:
    """Return a disc of 2 kg that meets an immovable disc at 3 m/s. With `first`, the immovable disc has number 0."""
    discs = [
        Disc(position_m=(0, 0), velocity_m_s=(3, 0), radius_m=0.5, mass_kg=2.0),
        Disc(position_m=(2.01, 0), radius_m=0.5, mass_kg=math.inf),
    ]
    name = "conformance-post-first" if first else "conformance-post"
    return Scene(name=name, discs=discs[::-1] if first else discs, duration_s=0.6)


def build_posts() -> Scene:
    """Return a scene of two overlapping immovable discs, in which nothing happens."""
    discs = [Disc(position_m=(x, 0), radius_m=1, mass_kg=math.inf) for x in (0, 1)]
    return Scene(name="conformance-posts", discs=discs, duration_s=0.1)


def build_fall() -> Scene:
    """Return a disc that falls for half a second."""
    discs = [Disc(position_m=(0, 0), velocity_m_s=(1, 0), radius_m=0.5)]
    return Scene(name="conformance-fall", discs=discs, gravity_m_s2=(0, -8), duration_s=0.5)


def build_damped_disc(*, spins: bool) -> Scene:
    """Return a damped disc that moves for half a second, and with `spins` also spins."""
    disc = Disc(position_m=(0, 0), velocity_m_s=(0.6, -0.8), radius_m=0.5, spin_rad_s=1.0 if spins else 0.0)
    return Scene(name=f"conformance-slowing{'-spin' * spins}", discs=[disc], damping_per_s=0.8, duration_s=0.5)


def build_rolling_disc() -> Scene:
    """Return a disc that rolls for half a second on a floor with rolling resistance."""
    return Scene(
        name="conformance-rolling",
        discs=[Disc(position_m=(0, 0.5), velocity_m_s=(1, 0), radius_m=0.5, spin_rad_s=-2)],
        walls=[Wall(point_m=(0, 0), normal=(0, 1))],
        restitution=0.0,
        wall_restitution=0.0,
        wall_friction=0.5,
        friction=0.5,
        wall_rolling_resistance=0.1,
        gravity_m_s2=(0, -8),
        duration_s=0.5,
    )


def build_sliding_disc() -> Scene:
    """Return a disc that a table decelerates for half a second."""
    disc = Disc(position_m=(0, 0), velocity_m_s=(0.6, -0.8), radius_m=0.5)
    return Scene(name="conformance-table", discs=[disc], table_deceleration_m_s2=0.5, duration_s=0.5)


def build_mixed_contacts(*, wall: bool, restitution: float) -> Scene:
    """Return two discs that meet off centre; with `wall`, the first also bounces off a slanted wall.

    With a restitution below 1, discs still overlap for some steps while they separate slowly. Such contacts have no
    impulse.
    """
    return Scene(
        name="conformance-contacts",
        discs=[
            Disc(position_m=(0, 0), velocity_m_s=(3, 0), radius_m=0.5, mass_kg=1),
            Disc(position_m=(1.72, 0.3), velocity_m_s=(-1, 0.1), radius_m=0.5, mass_kg=2),
        ],
        walls=[Wall(point_m=(-1, 0), normal=(1, 0.2))] if wall else [],
        restitution=restitution,
        wall_restitution=restitution,
        duration_s=3.0,
    )


def build_rubbing(
    can: Capabilities, friction: float, wall_friction: float, inertia_factor: float = 0.5, restitution: float = 1.0
) -> Scene:
    """Return two discs that meet along x and slip. If walls are supported, a third disc slips on a wall.

    The bodies touch just before the end of a step. The bodies then overlap by enough for the declared float width, but
    by less than the rounding allowance. So the lever arm of friction and the normal are correct even in an engine that
    derives them from overlapping positions.
    """
    overlap = 0.25 * THRESHOLDS.rounding_of(can.float_bits)
    turns = can.spin and math.isfinite(inertia_factor)
    factor = inertia_factor if can.spin else math.inf

    def build_disc(x: float, y: float, velocity: tuple[float, float], closing: float, spin: float, mass: float) -> Disc:
        late_s = TOUCH_STEPS * DT_S - overlap / closing
        return Disc(
            position_m=(x - velocity[0] * late_s, y - velocity[1] * late_s),
            velocity_m_s=velocity,
            radius_m=0.5,
            mass_kg=mass,
            spin_rad_s=spin if turns else 0.0,
            inertia_factor=factor,
        )

    discs = [build_disc(0, 0, (2, 0.5), 3, 6, 1.0), build_disc(1, 0, (-1, -0.25), 3, 2, 2.0)]
    if can.walls:
        discs.append(build_disc(0, 9.5, (2, 3), 3, -8, 1.5))
    return Scene(
        name=f"conformance-friction-{friction:g}-{wall_friction:g}-{inertia_factor:g}",
        discs=discs,
        walls=[Wall(point_m=(0, 10), normal=(0, -1))] if can.walls else [],
        restitution=restitution,
        wall_restitution=restitution,
        friction=friction,
        wall_friction=wall_friction if can.walls else 0.0,
        duration_s=2 * TOUCH_STEPS * DT_S,
    )


def build_rubbing_crowd(can: Capabilities, friction: float, restitution: float) -> Scene:
    """Return the crowd as spinning discs with friction, in a box if walls are supported."""
    scene = build_walled_box() if can.walls else build_crowd()
    spun = {"spin_rad_s": 4.0} if can.spin else {"inertia_factor": math.inf}
    discs = [disc.model_copy(update={k: v * (-1) ** i for k, v in spun.items()}) for i, disc in enumerate(scene.discs)]
    update = {"name": "conformance-rubbing", "discs": tuple(discs), "friction": friction, "wall_friction": friction}
    return scene.model_copy(update=update | {"restitution": restitution, "wall_restitution": restitution})
