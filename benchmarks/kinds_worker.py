"""Scenes and timings of `benchmarks.kinds`, which passes this module as text to a Python interpreter.

The interpreter can have another version of Carom, so the module uses only functions whose interface does not change.
Each line of standard input is one request:

- ``pic KIND DISCS IMPACTS RECORD SOLVES LIMIT`` times `carom.solve_pic` up to a number of impacts.
- ``pit KIND DISCS FRAMES RECORD SOLVES LIMIT`` times `carom.solve_pit` over a number of frames; RECORD is ignored.

The module prints the processor time in seconds and the number of events of one run: frames, or impacts and changes
between sliding, rolling and rest. If a request takes longer than LIMIT seconds, the module prints ``inf 0``.
"""

from __future__ import annotations

import math
import random
import signal
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

from carom import Chain, Disc, Scene, Wall, solve_pic, solve_pit

RADIUS_M = 0.25
FRAME_RATE_HZ = 60.0
#: Weak gravity: falling through the whole box does not double the speed of discs, so speeds stay comparable.
WEAK_GRAVITY_M_S2 = (0.0, -0.1)
#: Duration of scenes. Timed runs are shorter, because they end after a number of impacts.
LONG_S = 1e5
SEGMENTS = 100
#: The scene "contact": the balls above a floor are in a row, and the outer two roll off the ends of the floor.
BALLS_PER_FLOOR = 10
FLOOR_M = 17.0
FLOOR_SPACING_M = 25.0
CONTACT_S = 10.0

_SEED = 1


def square_gas(discs: int, most_spin_rad_s: float = 0.0) -> list[Disc]:
    """Return equal discs on a square lattice around the origin, one per square metre, in random directions at 1 m/s."""
    side = math.ceil(math.sqrt(discs))
    spacing = math.sqrt(discs) / side
    places = [((k % side + 0.5 - side / 2) * spacing, (k // side + 0.5 - side / 2) * spacing) for k in range(discs)]
    return _moving(places, most_spin_rad_s)


def round_gas(discs: int) -> tuple[list[Disc], float]:
    """Return discs within a circle around the origin, and the radius of a circle that contains all discs."""
    side = math.ceil(math.sqrt(discs))
    lattice = [(x + 0.5, y + 0.5) for x in range(-side, side) for y in range(-side, side)]
    places = sorted(lattice, key=lambda place: math.hypot(*place))[:discs]
    return _moving(places, 0.0), math.hypot(*places[-1]) + 1.2 * RADIUS_M


def _moving(places: list[tuple[float, float]], most_spin_rad_s: float) -> list[Disc]:
    draw = random.Random(_SEED)  # noqa: S311 - no secret
    discs = []
    for place in places:
        angle = draw.uniform(0.0, 2.0 * math.pi)
        spin = draw.uniform(-most_spin_rad_s, most_spin_rad_s)
        velocity = (math.cos(angle), math.sin(angle))
        discs.append(Disc(position_m=place, velocity_m_s=velocity, radius_m=RADIUS_M, spin_rad_s=spin))
    return discs


def box(discs: int, recedes_m_s: float = 0.0) -> list[Wall]:
    """Return the walls of a square box around the origin, with a square metre per disc. The first wall may recede."""
    half = math.sqrt(discs) / 2
    normals = ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0))
    walls = [Wall(point_m=(-half * x, -half * y), normal=(x, y)) for x, y in normals]
    return [walls[0].model_copy(update={"velocity_m_s": (-recedes_m_s, 0.0)}), *walls[1:]]


def polygon(apothem: float) -> list[Chain]:
    """Return a closed chain: a regular polygon around the origin with an inscribed circle of radius `apothem`."""
    radius = apothem / math.cos(math.pi / SEGMENTS)
    angles = [2.0 * math.pi * k / SEGMENTS for k in range(SEGMENTS)]
    return [Chain(points_m=[(radius * math.cos(angle), radius * math.sin(angle)) for angle in angles], closed=True)]


def boxed_gas(discs: int, *, most_spin_rad_s: float = 0.0, recedes_m_s: float = 0.0, **laws: Any) -> Scene:
    """Return a scene with discs in a box."""
    gas = square_gas(discs, most_spin_rad_s)
    return Scene(name="gas in a box", discs=gas, walls=box(discs, recedes_m_s), duration_s=LONG_S, **laws)


def enclosed_gas(discs: int, **laws: Any) -> Scene:
    """Return a scene with discs in a closed chain of 100 segments."""
    gas, apothem = round_gas(discs)
    return Scene(name="gas in a chain", discs=gas, walls=polygon(apothem), duration_s=LONG_S, **laws)


def dropped_balls(discs: int) -> Scene:
    """Return a scene in which ten balls are dropped on each of several floors, and come to rest or roll off.

    Balls that reach the end of a floor are fast, because PIC ends a run if a ball rolls slowly over an end.
    """
    balls, floors = list[Disc](), list[Chain]()
    for floor in range(-(-discs // BALLS_PER_FLOOR)):
        draw = random.Random(floor)  # noqa: S311 - no secret
        left = FLOOR_SPACING_M * floor
        floors.append(Chain(points_m=[(left, 0.0), (left + FLOOR_M, 0.0)]))
        for k in range(min(BALLS_PER_FLOOR, discs - len(balls))):
            speed = draw.uniform(-1.0, 1.0)
            if k in (0, BALLS_PER_FLOOR - 1):
                speed = draw.uniform(3.0, 4.0) * (-1.0 if k == 0 else 1.0)
            place = (left + 4.0 + k, draw.uniform(0.5, 1.5))
            balls.append(Disc(position_m=place, velocity_m_s=(speed, 0.0), radius_m=RADIUS_M))
    return Scene(
        name="balls dropped on floors",
        discs=balls,
        walls=floors,
        restitution=0.8,
        wall_restitution=0.4,
        friction=0.1,
        wall_friction=0.1,
        wall_rolling_resistance=0.02,
        gravity_m_s2=(0.0, -9.81),
        duration_s=CONTACT_S,
    )


_ROUGH = {"friction": 0.1, "wall_friction": 0.1}

#: Kinds of motion, each with the function that builds its scene from the number of discs.
KINDS: dict[str, Callable[[int], Scene]] = {
    "plain": boxed_gas,
    "friction": lambda discs: boxed_gas(discs, most_spin_rad_s=1.0, **_ROUGH),
    "driven": lambda discs: boxed_gas(discs, recedes_m_s=1e-3),
    "chain": enclosed_gas,
    "damping": lambda discs: boxed_gas(discs, damping_per_s=1e-3),
    "gravity": lambda discs: boxed_gas(discs, gravity_m_s2=WEAK_GRAVITY_M_S2),
    "gravity-friction": lambda discs: boxed_gas(discs, most_spin_rad_s=1.0, gravity_m_s2=WEAK_GRAVITY_M_S2, **_ROUGH),
    "table": lambda discs: boxed_gas(discs, table_deceleration_m_s2=0.01),
    "gravity-chain": lambda discs: enclosed_gas(discs, gravity_m_s2=WEAK_GRAVITY_M_S2),
    "contact": dropped_balls,
}


@cache
def _scene(kind: str, discs: int, frames: int = 0) -> Scene:
    """Return a scene, for PIT with a duration of `frames` frames.

    The arrays are computed here, outside of the timing.
    """
    scene = KINDS[kind](discs)
    if frames:
        scene = scene.model_copy(update={"duration_s": frames / FRAME_RATE_HZ})
    assert scene.arrays is not None  # noqa: S101 - computed here and kept
    return scene


class _TimeLimitError(Exception):
    """A request has reached its time limit."""


@contextmanager
def _time_limit(seconds: float) -> Iterator[None]:
    """Raise `_TimeLimitError` in the `with` block after some seconds of processor time."""

    def end(*_: object) -> None:
        raise _TimeLimitError

    signal.signal(signal.SIGPROF, end)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)


def _timed(solve: Callable[[], int], solves: int, limit_s: float) -> tuple[float, int]:
    events = 0
    try:
        with _time_limit(limit_s):
            begin = time.thread_time()
            for _ in range(solves):
                events = solve()
            return time.thread_time() - begin, events
    except _TimeLimitError:
        return math.inf, 0


def time_pic(kind: str, discs: int, impacts: int, record: str, solves: int, limit_s: float) -> tuple[float, int]:
    """Return the total seconds of some runs of PIC, and the number of events of one run."""
    scene = _scene(kind, discs)

    def solve() -> int:
        trace = solve_pic(scene, max_impacts=impacts, record=record)
        return int(trace.counts["impacts"]) + (0 if trace.modes is None else len(trace.modes))

    return _timed(solve, solves, limit_s)


def time_pit(kind: str, discs: int, frames: int, _: str, solves: int, limit_s: float) -> tuple[float, int]:
    """Return the total seconds of some runs of PIT, and the number of frames of one run."""
    scene = _scene(kind, discs, frames)

    def solve() -> int:
        solve_pit(scene, frame_rate_hz=FRAME_RATE_HZ)
        return frames

    return _timed(solve, solves, limit_s)


def _main() -> None:
    for line in sys.stdin:
        method, kind, discs, size, record, solves, limit_s = line.split()
        timed = time_pic if method == "pic" else time_pit
        print(*timed(kind, int(discs), int(size), record, int(solves), float(limit_s)), flush=True)


if __name__ == "__main__":
    _main()
