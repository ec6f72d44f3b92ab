"""Functions that build scenes of a few bodies in a few lines, in SI units."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, TypeVar

from tests.in_process_pool import InProcessPool

import carom
from carom import Chain, Disc, Ring, Scene, Trace, Wall
from carom.engines.api import Adapter, Observation
from carom.execution.results import Results
from carom.model.walls import AnyWall

T = TypeVar("T")

#: What the fixtures `named`, `drive` and `finish` are.
Named = Callable[[str], Adapter]
Drive = Callable[..., list[Observation]]
Finish = Callable[..., Observation]


def require_value(value: T | None) -> T:
    """Return a value that must not be None; otherwise the test fails."""
    assert value is not None
    return value


def disc_at(
    x: float, y: float, vx: float = 0.0, vy: float = 0.0, *, r: float = 0.5, m: float = 1.0, **more: Any
) -> Disc:
    """Return a disc at a place with a velocity, a radius and a mass; `more` is spin, inertia and drive."""
    return Disc(**{"position_m": (x, y), "velocity_m_s": (vx, vy), "radius_m": r, "mass_kg": m, **more})


def wall_at(x: float, y: float, nx: float, ny: float, **more: Any) -> Wall:
    """Return a wall through a point, with the normal that points into the free side; `more` is its law and drive."""
    return Wall(point_m=(x, y), normal=(nx, ny), **more)


def drive_on_legs(*legs: tuple[float, tuple[float, float]]) -> dict[str, Any]:
    """Return the drive of a body that has a velocity from each of some instants on."""
    return {"legs": [{"from_s": begin, "velocity_m_s": velocity} for begin, velocity in legs]}


def staged(name: str, *bodies: Disc | AnyWall, **fields: Any) -> Scene:
    """Return the scene of some bodies; `fields` are the others of a scene."""
    discs = [body for body in bodies if isinstance(body, Disc)]
    walls = [body for body in bodies if not isinstance(body, Disc)]
    return Scene(name=name, discs=discs, walls=walls, **fields)


def build_line_scene(
    *positions: float, velocities: tuple[float, ...], restitution: float = 1.0, duration_s: float = 10.0
) -> Scene:
    """Return discs of 1 kg and radius 0.5 on the x axis."""
    return staged(
        "line",
        *[disc_at(x, 0.0, v, 0.0) for x, v in zip(positions, velocities, strict=True)],
        restitution=restitution,
        duration_s=duration_s,
    )


def with_discs(scene: Scene, **fields: Any) -> Scene:
    """Return the scene with these fields of its discs changed."""
    return scene.model_copy(update={"discs": tuple(disc.model_copy(update=fields) for disc in scene.discs)})


def alter_impact(trace: Trace, k: int, **fields: Any) -> Trace:
    """Return the trace with these fields of impact k changed."""
    impacts = trace.impacts.copy()
    for name, value in fields.items():
        impacts[name][k] = value
    return replace(trace, impacts=impacts)


def build_crushed_rows() -> list[tuple[Scene, float]]:
    """Return scenes whose discs on a line are crushed, and the time: free space divided by closing speed."""
    left, right = wall_at(0.0, 0.0, 1.0, 0.0), wall_at(4.0, 0.0, -1.0, 0.0)
    drive = {"velocity_m_s": (-0.5, 0.0)}
    comes = right.model_copy(update=drive)
    held = {"m": math.inf, "driven": True}
    disc, mallet = disc_at(1.0, 0.0, -1.0, r=0.25), disc_at(2.5, 0.0, -0.5, **held)
    two = disc, disc_at(2.5, 0.0, 0.25, r=0.25)
    # Faces of edges, an end of one, and posts from outside and from inside, 2 m from the left wall or there.
    rack, behind = Chain(points_m=[(2.0, -1.0), (2.0, 1.0)], **drive), Chain(points_m=[(0.0, -1.0), (0.0, 1.0)])
    spike, post = Chain(points_m=[(-1.0, 0.0), (0.0, 0.0)]), Ring(centre_m=(2.5, 0.0), radius_m=0.5, **drive)
    thick, cup = spike.model_copy(update={"half_width_m": 0.25}), Ring(centre_m=(1.0, 0.0), radius_m=1.0, **drive)
    rough = {"friction": 0.25, "wall_friction": 0.5, "wall_tangential_restitution": 0.5}
    rows: list[tuple[float, Sequence[Disc | AnyWall], dict[str, Any]]] = [
        # 2.5 m less the mallet's half and the disc's whole width, at 0.5 m/s
        (1.5 / 0.5, (disc, mallet, left), {}),
        (2.0 / 0.75, (disc, disc_at(-1.0, 0.0, 0.25, **held), mallet), {}),
        (
            1.5 / 0.5,
            (disc_at(0.0, 1.0, 0.0, -1.0, r=0.25), disc_at(0.0, 2.5, 0.0, -0.5, **held), wall_at(0, 0, 0, 1)),
            {"gravity_m_s2": (0.0, -2.0)},
        ),
        (3.0 / 0.5, (*two, left, comes), {}),
        (3.0 / 0.5, (disc, disc_at(2.5, 0.0, 0.25, r=0.25, m=3.0), left, comes), rough),
        (1.5 / 0.5, (disc, mallet, left), {"restitution": 0.875, "wall_restitution": 0.75}),
        (1.5 / 0.5, (disc, rack, spike), rough),
        (1.5 / 0.5, (disc, mallet, behind), {"gravity_m_s2": (1.0, 0.0)}),
        (1.25 / 0.5, (disc, post, thick), {}),
        (1.5 / 0.5, (disc, cup, spike), {}),
        (3.0 / 0.5, (*two, spike, comes), rough),
    ]
    return [
        (staged(f"row {k}", *bodies, **fields, duration_s=8.0), crushed_s)
        for k, (crushed_s, bodies, fields) in enumerate(rows)
    ]


def run_cross_check(scenes: Any, engines: Sequence[str], **options: Any) -> Results:
    """Return the results of a cross-check in this process, without timing."""
    return carom.cross_check(scenes, engines, timing=False, pool=InProcessPool(), **options)
