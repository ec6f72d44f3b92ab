"""Comparison of PIC with small steps without modes of contact, on random scenes; no energy may be gained.

One to three discs are thrown on floors, slopes, edges that end, and between walls, with friction, rolling resistance
and any restitution. Each run is compared up to its end, or to just before the first impact without a unique answer, or
the end by name. Places have to agree to the order of small steps, g h T, refined up to 64 times, or approach by at
least half each time.

In some scenes they do neither. A fall by such steps is off by g h T / 2, and bounces, friction and impacts in a step
give as much again: so they run the scene from a start about g h T away. Where discs strike one another, PIC's own end
is a hundred times as far off from such a start: from several of these it has to be as far off as small steps are.
"""

import itertools
import math
import random
from collections.abc import Sequence

import numpy as np
from tests.checker.small_steps import run_small_steps
from tests.scene_builders import disc_at, staged

from carom import Chain, Scene, Wall, solve_pic
from carom.model.energy import kinetic_energy
from carom.model.trace import Trace

G = 10.0

Places = Sequence[Sequence[float]]

#: At first, and how often their number is multiplied by four at most where the ends are not near enough before.
STEPS, REFINED = 400, 3
#: How many starts nearby are run where the ends are not near enough.
STARTS = 12

#: What is said where nothing is wrong.
AGREES, PARTS, SHORT = "agrees", "agrees as far as starts nearby do", "too short"
RIGHT = {AGREES, PARTS, SHORT}


def draw_contact_scene(seed: int) -> Scene:
    """Return a scene of one to three discs on a floor, a slope or edges, now and then begun in contact."""
    rng = random.Random(seed)
    walls: list[Wall | Chain] = []
    if rng.random() < 0.3:
        end, rise = rng.uniform(2.9, 4.0), rng.uniform(-1.0, 1.0)
        walls.append(Chain(points_m=((-6.0, 0.0), (end, 0.0), (end + 2.0, rise))[: rng.choice((2, 3))]))
    else:
        walls.append(Wall(point_m=(0.0, 0.0), normal=(0.0, 1.0)))
    walls += [Wall(point_m=(-3.0, 0.0), normal=(0.6, 0.8))] * rng.choice((0, 1))
    walls += [Wall(point_m=(7.0, 0.0), normal=(-1.0, 0.0))] * rng.choice((0, 1))
    discs = [
        disc_at(
            -1.2 + 1.7 * i,
            rng.choice((0.5, rng.uniform(0.5, 2.0))),
            rng.uniform(-4, 4),
            spin_rad_s=rng.choice((0.0, rng.uniform(-6, 6))),
            inertia_factor=rng.choice((0.4, 0.5, 1.0)),
        )
        for i in range(rng.choice((1, 1, 2, 3)))
    ]
    return staged(
        f"contact {seed}",
        *discs,
        *walls,
        restitution=rng.choice((0.5, 0.9, 1.0)),
        wall_restitution=rng.choice((0.0, 0.3, 0.6)),
        wall_friction=rng.choice((0.0, 0.1, 0.4, 0.8)),
        wall_rolling_resistance=rng.choice((0.0, 0.02, 0.2, 0.6)),
        gravity_m_s2=(0.0, -G),
        duration_s=rng.uniform(0.5, 2.5),
    )


def check_scene(scene: Scene) -> str:
    """Return what has come of a scene: one of `RIGHT` where nothing is wrong, a sentence where something is."""
    trace = solve_pic(scene, max_impacts=2000)
    until_s = trace.end_time_s
    if trace.ambiguous or until_s < scene.duration_s:
        first = min([until_s, *(float(trace.impacts["time_s"][row]) for row in trace.ambiguous)])
        until_s = 0.98 * first
        if until_s < 0.02:
            return SHORT
        trace = solve_pic(scene, until_s=until_s)
    if broken := _find_violation(scene, until_s):
        return broken
    offs: list[float] = []
    for power in range(REFINED + 1):
        steps = STEPS * 4**power
        places = run_small_steps(scene, steps, until_s).places
        offs.append(_largest_distance(places, trace.final_position_m.tolist()))
        if not math.isfinite(offs[-1]):
            return f"{scene.name}: off by {offs}"
        if power and offs[-1] < G * until_s * until_s / steps:
            return AGREES
    if all(finer <= 0.5 * coarser for coarser, finer in itertools.pairwise(offs)):
        return AGREES
    known = G * until_s * until_s / steps
    if offs[-1] < known + _measure_start_spread(scene, trace, known):
        return PARTS
    return f"{scene.name}: small steps are off by {', '.join(f'{off:.2g}' for off in offs)} m at {until_s} s"


def _largest_distance(places: Places, others: Places) -> float:
    return max(math.dist(a, b) for a, b in zip(places, others, strict=True))


def _measure_start_spread(scene: Scene, trace: Trace, off_m: float) -> float:
    """Return how far PIC's end moves at most for starts `off_m` away, and as much more by the end.

    A disc on a floor stays on it: it is moved along, and others upwards, away from all walls below. A start from which
    a run ends earlier says nothing.
    """
    rng, until_s, largest_m = random.Random(scene.name), trace.end_time_s, 0.0
    for _ in range(STARTS):
        discs = []
        for disc in scene.discs:
            (x, y), (u, v), (dx, dy, du, dw) = disc.position_m, disc.velocity_m_s, (rng.uniform(-1, 1) for _ in "four")
            moved = {
                "position_m": (x + dx * off_m, y + abs(dy) * off_m * (y != disc.radius_m)),
                "velocity_m_s": (u + du * off_m / until_s, v),
                "spin_rad_s": disc.spin_rad_s + dw * off_m / until_s / disc.radius_m,
            }
            discs.append(disc.model_copy(update=moved))
        near = solve_pic(Scene(**{**dict(scene), "discs": discs}), until_s=until_s, max_impacts=2000)
        if near.end_time_s == until_s:
            largest_m = max(
                largest_m, _largest_distance(near.final_position_m.tolist(), trace.final_position_m.tolist())
            )
    return largest_m


def _find_violation(scene: Scene, until_s: float) -> str:
    """Return what a run breaks of what must hold: no energy is gained, and nothing sinks into a half-plane."""
    energy = math.inf
    for part in (0.0, 0.25, 0.5, 0.75, 1.0):
        trace = solve_pic(scene, until_s=part * until_s)
        height = trace.final_position_m[:, 1]
        now = kinetic_energy(scene, trace.final_velocity_m_s, trace.final_spin_rad_s) + G * float(height.sum())
        if not now <= energy + 1e-11 * max(1.0, abs(now)):
            return f"{scene.name}: energy grows from {energy} to {now} J by {trace.end_time_s} s"
        energy = now
        for wall in (wall for wall in scene.walls if isinstance(wall, Wall)):
            gaps = (trace.final_position_m - wall.point_m) @ np.array(wall.normal) - scene.arrays.radius_m
            if not gaps.min() >= -1e-14 * 10.0:
                return f"{scene.name}: {gaps.min()} m deep in a wall at {trace.end_time_s} s"
    return ""
