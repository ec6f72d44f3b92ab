"""What Carom's own event-driven PIC must stand: conservation, no overlap, time that only advances, an end to collapse.

These are measured within the run, impact by impact, which no adapter shows; so they are of the event-driven form alone.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from tests.drawn import jittered, scene_of
from tests.stage import disc_at, staged, wall_at

from carom.scene import Disc, Scene, Wall
from carom.solvers.event_driven.run import EventDrivenRun
from carom.trace import Outcome, kinetic_energy

#: Impacts kept at a time.
_CHUNK = 100_000


def mixed_gas() -> Scene:
    """Return thirty discs of radii 1:1.7 and masses 1:49 in a box, a third of which they cover."""
    return scene_of(jittered(np.random.default_rng(1), 30, spread=1.8), 10.0)


def _chunks(scene: Scene, impacts: int) -> Iterator[tuple[EventDrivenRun, NDArray[np.void]]]:
    """Run for so many impacts and yield the run and its impacts, a chunk at a time, so that memory stays small."""
    run = EventDrivenRun(scene)
    for until in range(_CHUNK, impacts + _CHUNK, _CHUNK):
        outcome = run.advance_to(math.inf, min(until, impacts))
        yield run, run.log.array()
        if outcome is not Outcome.MAX_IMPACTS:
            return
        run = EventDrivenRun(scene, resume=run.state())


def energy(scene: Scene, impacts: int) -> float:
    """Return by how much energy is off after so many impacts, relative."""
    start = kinetic_energy(scene, np.array([disc.velocity_m_s for disc in scene.discs]))
    run = EventDrivenRun(scene, record="none")
    run.advance_to(math.inf, impacts)
    return abs(kinetic_energy(scene, run.velocities()) / start - 1.0)


def momentum(scene: Scene, impacts: int) -> float:
    """What the momentum at the end has that neither the start had nor the walls gave, over mass times speed in all."""
    mass = np.array([disc.mass_kg for disc in scene.discs])
    start = np.array([disc.velocity_m_s for disc in scene.discs])
    pushes: list[NDArray[np.float64]] = []
    velocity = start
    for run, found in _chunks(scene, impacts):
        walls = found[found["second"] < 0]
        push = (walls["velocity_first_after"] - walls["velocity_first_before"]) * mass[walls["first"]][:, None]
        pushes.append(np.array([math.fsum(push[:, 0]), math.fsum(push[:, 1])]))
        velocity = run.velocities()
    left = mass @ velocity - mass @ start - np.sum(pushes, axis=0)
    return float(np.hypot(*left) / np.sum(mass * np.hypot(*start.T)))


def backwards(scene: Scene, impacts: int) -> float:
    """Seconds by which an impact came before the one ahead of it, at worst."""
    last, worst = 0.0, 0.0
    for _, found in _chunks(scene, impacts):
        if len(found):
            steps = np.diff(found["time_s"], prepend=last)
            worst, last = float(np.maximum(worst, -steps.min())), float(found["time_s"][-1])
    return worst


def overlap(scene: Scene, impacts: int) -> float:
    """Return the deepest overlap of two bodies over what rounding explains, looked for a thousand times on the way.

    The run stops at an instant that is a float, within half a unit in its last place of the impact; there each body is
    off by its speed times that, and by the roundings of its coordinates: of the product, of the sum, and of the instant
    at which its path began.
    """
    radius = np.array([disc.radius_m for disc in scene.discs])
    run, worst = EventDrivenRun(scene, record="none"), 0.0
    extent = max(abs(c) + disc.radius_m for disc in scene.discs for c in disc.position_m)
    for until in np.linspace(0, impacts, 1001)[1:]:
        run.advance_to(math.inf, int(until))
        place, speed = run.positions(), np.hypot(*run.velocities().T)
        off = speed * math.ulp(run.time_s) + 4 * math.ulp(extent)
        for i in range(len(radius) - 1):
            distance = np.hypot(*(place[i + 1 :] - place[i]).T)
            depth = np.max((radius[i] + radius[i + 1 :] - distance) / (off[i] + off[i + 1 :]))
            worst = float(np.maximum(worst, depth))
        for wall in scene.half_planes():
            depth = np.max((radius - (place - wall.point_m) @ np.array(wall.normal)) / off)
            worst = float(np.maximum(worst, depth))
    return worst


def galperin(k: int) -> Scene:
    """Return Galperin's billiard with masses 1 and 100^k."""
    return Scene(
        name=f"stress/galperin-{k}",
        discs=[disc_at(3.0, 0.0), disc_at(6.0, 0.0, -1.0, 0.0, m=100.0**k)],
        walls=[Wall(point_m=(0.0, 0.0), normal=(1.0, 0.0))],
        duration_s=25.0,  # the slowest, k = 2, has its last impact at 19.3 s
    )


def galperin_error(scene: Scene) -> float:
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


def collapsing() -> Scene:
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


def touching() -> Scene:
    """Return a start in which every disc touches its neighbours: a triangle of ten, struck at its tip."""
    radius, apex = 0.25, math.sqrt(3) / 2
    discs = [Disc(position_m=(0.0, -0.5), velocity_m_s=(0.0, 1.0), radius_m=radius)]
    for row in range(4):
        discs += [
            Disc(position_m=(2 * radius * (k - row / 2), 2 * radius * apex * row), radius_m=radius)
            for k in range(row + 1)
        ]
    return staged(
        "stress/touching", *discs, description="Ten touching discs, struck by one that touches.", duration_s=1.0
    )
