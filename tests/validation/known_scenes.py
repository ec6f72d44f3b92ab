"""Scenes for, and errors of, Carom's event-driven PIC where the answer is known: Galperin, collapse, touching discs."""

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from tests.scene_builders import disc_at, staged, wall_at

from carom.model.scene import Scene
from carom.model.trace import Outcome
from carom.solvers.event_driven.run import EventDrivenRun

#: Impacts kept at a time.
_CHUNK = 100_000


def _chunks(scene: Scene, impacts: int) -> Iterator[tuple[EventDrivenRun, NDArray[np.void]]]:
    """Run for some impacts and yield the run and its impacts, a chunk at a time, so that memory stays small."""
    run, last_s = EventDrivenRun(scene), 0.0
    for until in range(_CHUNK, impacts + _CHUNK, _CHUNK):
        outcome = run.advance_to(math.inf, min(until, impacts))
        found = run.log.array()
        assert not (np.diff(found["time_s"], prepend=last_s) < 0.0).any(), "an impact comes before the one ahead of it"
        last_s = run.time_s
        yield run, found
        if outcome is not Outcome.MAX_IMPACTS:
            return
        run = EventDrivenRun(scene, resume=run.state())


def build_galperin_scene(k: int) -> Scene:
    """Return Galperin's billiard with masses 1 and 100^k."""
    bodies = disc_at(3.0, 0.0), disc_at(6.0, 0.0, -1.0, 0.0, m=100.0**k), wall_at(0.0, 0.0, 1.0, 0.0)
    return staged(f"stress/galperin-{k}", *bodies, duration_s=25.0)  # the slowest, k = 2, ends at 19.3 s


def measure_galperin_error(scene: Scene) -> float:
    """Return the largest error of any impact's instant and velocities, over the bound that its roundings set.

    Unfolded, the pair of discs is a point on a straight line that crosses rays at multiples of theta (Galperin 2003):
    the n-th impact is at ``(X - x cot(n theta) / sqrt(M)) / V``. Each impact turns the path by some tens of roundings,
    2^-53 each, so n of them by 64 n 2^-53 at most; a turned path meets its ray late by the derivative of the cotangent.
    Infinite where the number of impacts is wrong.
    """
    root = math.sqrt(scene.discs[1].mass_kg)
    theta = math.atan2(1.0, root)
    count = math.ceil(math.pi / theta) - 1
    # Gaps to the wall, radii and the diameter between taken out.
    light, heavy = 3.0 - 0.5, 6.0 - 0.5 - 1.0
    done, worst = 0, 0.0
    for _, found in _chunks(scene, count + 10):
        n = np.arange(done + 1, done + len(found) + 1)
        ray = n * theta
        across = light / root
        time = heavy - across / np.tan(ray)
        turned = np.where(n % 2 == 0, math.pi - ray, ray + theta - math.pi)
        roundings = 64 * n * 2.0**-53
        late = np.abs(found["time_s"] - time) / (roundings * (time + across / np.sin(ray) ** 2))
        speed = np.abs(found["velocity_first_after"][:, 0] - root * np.sin(turned)) / (roundings * root)
        worst = float(np.max([worst, late.max(), speed.max()]))
        with_wall = found["second"] < 0
        if not np.array_equal(with_wall, n % 2 == 0):
            return math.inf
        done += len(found)
    return worst if done == count else math.inf


def build_collapse_scene() -> Scene:
    """Return a scene of inelastic collapse: three discs between two walls that lose nearly all at each impact."""
    return staged(
        "stress/collapse",
        disc_at(0.5, 0.0, 1.0, 0.0),
        disc_at(2.5, 0.0),
        disc_at(4.5, 0.0, -1.0, 0.0),
        wall_at(0.0, 0.0, 1.0, 0.0),
        wall_at(5.0, 0.0, -1.0, 0.0),
        restitution=0.02,
        duration_s=20.0,
    )


def build_touching_scene() -> Scene:
    """Return a start in which every disc touches its neighbours: a triangle of ten, struck at its tip."""
    radius, apex = 0.25, math.sqrt(3) / 2
    triangle = [(2 * radius * (k - row / 2), 2 * radius * apex * row) for row in range(4) for k in range(row + 1)]
    discs = disc_at(0.0, -0.5, 0.0, 1.0, r=radius), *(disc_at(x, y, r=radius) for x, y in triangle)
    return staged("stress/touching", *discs, duration_s=1.0)
