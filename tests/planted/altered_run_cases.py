"""What must be said of each doctored run, and why: faults from nothing to gross, each with its grades by hand.

Where a hand's reckoning leaves one grade, the table names one. Where it leaves a few (the cost of an error of a
millionth relative to that of sampling depends on every impact of a crowd), it names the best and the worst that may be.
"""

import dataclasses
import math
import re
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from tests.planted.altered_runs import DT, GAS, GRAVITY, Run, change_law, change_states, record_pic, remove_impacts
from tests.scene_builders import disc_at, staged, wall_at

from carom import Scene
from carom.comparator import Grade, Verdict
from carom.model.step_windows import States
from carom.model.trace import IMPACT_DTYPE, SPIN_DTYPE

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Rung:
    """One size of a fault: the best and the worst grade that may be given, and a verdict that must be said."""

    size: float
    best: Grade
    worst: Grade
    says: Verdict | None = None


def parse_rungs(said: str) -> tuple[Rung, ...]:
    """Return rungs from words: sizes, their grade or the best-worst, and perhaps the verdict that must be said."""
    rungs = []
    for group in said.split(", "):
        sizes, grades, verdict = re.fullmatch(r"([-\d.e ]+) ([a-z-]+) ?(\w*)", group).groups()  # type: ignore[union-attr]
        best, _, worst = grades.upper().partition("-")
        says = Verdict[verdict.upper()] if verdict else None
        rungs += [Rung(float(size), Grade[best], Grade[worst or best], says) for size in sizes.split()]
    return tuple(rungs)


@dataclass(frozen=True)
class Fault:
    """A fault that grows.

    Attributes:
        name: What it is called.
        plant: Takes the size, where 0 is no fault; of a fault of a crowd, first a right run and the time.
        rungs: From the least to the gross, with what must be said where the fault begins beyond the horizon.
        why: How that follows.
    """

    name: str
    plant: Callable[..., Run]
    rungs: tuple[Rung, ...]
    why: str


#: The disc that has the faults of one disc.
ONE = 3


def _change_law(name: str, run: Run, time_s: float, size: float) -> Run:
    return change_law(run, time_s, **{name: getattr(run.scene, name) - size}) if size else run


def _shift_disc(rows: Array, extra: Array) -> Array:
    shown = rows.copy()
    shown[:, ONE] += extra
    return shown


CROWD = (
    Fault(
        "passes through",
        lambda run, time_s, size: remove_impacts(run, time_s) if size else run,
        parse_rungs("0 exact, 1 wrong passed_through"),
        "every pair that meets goes on unturned, in a box that it leaves",
    ),
    Fault(
        "restitution of discs",
        lambda run, time_s, size: _change_law("restitution", run, time_s, size),
        parse_rungs(
            "0 exact, 1e-10 close-sampled, 1e-6 1e-4 close-inaccurate, 1e-2 sampled-inaccurate, 0.475 inaccurate"
        ),
        "half of size times the closing speed is missing after an impact: 5e-11 of it is more than ten roundings, and "
        "only head-on is 1e-4 of it a hundredth of what a step late costs (a tenth of the speed or more)",
    ),
    Fault(
        "restitution of walls",
        lambda run, time_s, size: _change_law("wall_restitution", run, time_s, size),
        parse_rungs("0 exact, 1e-10 1e-6 close-inaccurate, 1e-4 1e-2 0.5 inaccurate"),
        "a wall's normal is the same wherever the disc is found, so that sampling costs no velocity there: what is "
        "wrong with it is the solver's",
    ),
    Fault(
        "one disc drifts, m/s",
        lambda run, time_s, size: change_states(
            run, time_s, place=lambda p, t: _shift_disc(p, t[:, 0] * np.array([size, 0.0]))
        ),
        parse_rungs("0 exact, 1e-10 1e-6 close-inaccurate, 1e-4 inaccurate, 1e-2 1 inaccurate-wrong"),
        "a place that no velocity leads to, step after step; a disc that has drifted by a radius is turned where "
        "nothing is near, and passes through where it is shown",
    ),
    Fault(
        "one disc moved once, m",
        lambda run, time_s, size: change_states(
            run, time_s, place=lambda p, t: _shift_disc(p, np.array([size, 0.0]) * np.ones_like(t[:, 0]))
        ),
        parse_rungs("0 exact, 1e-10 1e-6 close-inaccurate, 1e-4 inaccurate, 0.054 1 inaccurate-wrong"),
        "it is elsewhere in one step, beyond what a velocity explains, and its impacts happen where nothing touches it",
    ),
    Fault(
        "velocities shown short",
        lambda run, time_s, size: change_states(run, time_s, speed=lambda v, _: v * (1.0 - size)),
        parse_rungs("0 exact, 1e-10 1e-9 close-inaccurate, 1e-6 1e-3 inaccurate, 0.1 inaccurate-wrong"),
        "discs move by more than their velocities say in every step, and all change at once with nothing near; above "
        "1 % of its speed such a change is a turn that nothing explains",
    ),
)

#: Friction and spins for the same crowd.
ROUGH_GAS = GAS.model_copy(
    update={
        "name": "rough-gas-of-12",
        "friction": 0.2,
        "wall_friction": 0.2,
        "discs": tuple(
            disc.model_copy(update={"spin_rad_s": 3.0 * (-1.0) ** k * (1 + k / 12)}) for k, disc in enumerate(GAS.discs)
        ),
    }
)


def _friction(run: Run, time_s: float, size: float) -> Run:
    friction = run.scene.friction * (1.0 - size)
    return change_law(run, time_s, friction=friction, wall_friction=friction) if size else run


ROUGH = (
    Fault(
        "friction too weak",
        _friction,
        parse_rungs("0 exact, 1e-10 1e-6 close-inaccurate, 1e-2 sampled-inaccurate, 1 inaccurate"),
        "sliding impacts are off by that share of friction's push: all of it is as much as the tangential velocity",
    ),
    Fault(
        "spins drift, rad/s a second",
        lambda run, time_s, size: change_states(run, time_s, spin=lambda w, t: w + size * t),
        parse_rungs("0 exact, 1e-10 exact-inaccurate, 1e-6 close-inaccurate, 1e-2 inaccurate, 10 inaccurate-wrong"),
        "spins change with nothing near",
    ),
)


# One ball or two on a floor. What the ball does at each instant is written down here: it is dropped from 1.5 m, lands
# at e = 0 and stays.

DROP_M, RADIUS_M, LATER_S, END_S = 1.5, 0.5, 1.2, 2.0
LANDS_S = math.sqrt(2.0 * DROP_M / GRAVITY)
FLOOR = wall_at(0.0, 0.0, 0.0, 1.0)
FALLING = {"gravity_m_s2": (0.0, -GRAVITY), "wall_restitution": 0.0, "duration_s": END_S}

THUD = staged("thud", disc_at(0.0, RADIUS_M + DROP_M, r=RADIUS_M), FLOOR, **FALLING)
RESTING = staged("resting", disc_at(0.0, RADIUS_M, r=RADIUS_M), FLOOR, **FALLING)
#: One rests from the start, so that the reference ends at once; another is dropped 5 m next to it.
BESIDE = staged(
    "beside", disc_at(0.0, RADIUS_M, r=RADIUS_M), disc_at(5.0, RADIUS_M + DROP_M, r=RADIUS_M), FLOOR, **FALLING
)

#: Height of the centre above its place at rest, and velocity upwards, at a time.
Path = Callable[[float], tuple[float, float]]


def free_fall(since_s: float, speed: float = 0.0) -> tuple[float, float]:
    """Return how high a free disc is, and how fast, so long after it left at a speed."""
    return speed * since_s - 0.5 * GRAVITY * since_s**2, speed - GRAVITY * since_s


def drop_path(time_s: float) -> tuple[float, float]:
    """Return the path of the ball that is dropped and stays."""
    height, speed = free_fall(time_s)
    return (DROP_M + height, speed) if time_s < LANDS_S else (0.0, 0.0)


def drop_path_until(then: Path) -> Path:
    """Return the path of the ball that stays until `LATER_S`, and then does something else."""
    return lambda time_s: drop_path(time_s) if time_s < LATER_S else then(time_s - LATER_S)


def build_run(scene: Scene, *paths: Path, lands: int | None = None) -> Run:
    """Return the run of discs that move up and down on these paths; disc `lands` reports its impact with the floor."""
    times = np.arange(scene.step_count(DT) + 1, dtype=np.float64) * DT
    moves = np.array([[path(float(time)) for path in paths] for time in times])
    position = np.zeros((len(times), len(paths), 2))
    velocity = np.zeros_like(position)
    position[:, :, 0] = [disc.position_m[0] for disc in scene.discs]
    position[:, :, 1], velocity[:, :, 1] = RADIUS_M + moves[:, :, 0], moves[:, :, 1]
    still, falls = (0.0, 0.0), (0.0, -GRAVITY * LANDS_S)
    rows = [] if lands is None else [(LANDS_S, lands, -1, (0.0, -1.0), falls, still, still, still)]
    spins = np.zeros(len(rows), SPIN_DTYPE)
    return Run(scene, States(times, position, velocity, velocity[:, :, 0]), np.array(rows, IMPACT_DTYPE), spins)


def _rest_path(_: float) -> tuple[float, float]:
    return 0.0, 0.0


#: What rests sinks by no more than this a second where it is held by its velocity alone: |g| h^2 / 2 a step.
SAG_M_S = 0.5 * GRAVITY * DT

FALLS = (
    Fault(
        "falls through the floor",
        lambda size: build_run(THUD, drop_path if not size else fall_through_path, lands=None if size else 0),
        parse_rungs("0 exact, 1 wrong passed_through"),
        "it meets the floor at 0.553 s and goes on unturned",
    ),
    Fault(
        "bounces, and falls through it",
        lambda size: build_run(THUD, drop_path_until(free_fall) if size else drop_path, lands=0),
        parse_rungs("0 exact, 1 wrong passed_through"),
        "what rests is held: 0.65 s after it has come to rest it falls through what held it",
    ),
    Fault(
        "flung from rest, m/s",
        lambda size: build_run(
            THUD, drop_path_until(lambda since_s: free_fall(since_s, size)) if size else drop_path, lands=0
        ),
        parse_rungs("0 exact, 2 wrong, 50 wrong turned_alone"),
        "what rests leaves with no other body near, faster than a step of gravity explains",
    ),
    Fault(
        "sinks at rest, m/s",
        lambda size: build_run(
            THUD, drop_path_until(lambda since_s: (-size * since_s, 0.0)) if size else drop_path, lands=0
        ),
        parse_rungs(
            f"0 exact, 1e-10 1e-3 close-sampled, {0.9 * SAG_M_S} sampled, {1.5 * SAG_M_S} 0.2 inaccurate sinks, "
            "5 inaccurate-wrong"
        ),
        "held by its velocity alone it sinks by |g| h^2 / 2 a step, which checking once per step explains; faster is a "
        "solver's, and no other limit is set",
    ),
    Fault(
        "bounces half as high as it should not, m/s",
        lambda size: build_run(THUD, _hop_path(size) if size else drop_path, lands=0),
        parse_rungs("0 exact, 1 3 inaccurate-wrong"),
        "restitution 0 asks for no bounce: 1 m/s and 3 m/s of 5.4 m/s are restitutions of .18 and .55",
    ),
)


def fall_through_path(time_s: float) -> tuple[float, float]:
    """Return the path of a ball that no floor stops."""
    height, speed = free_fall(time_s)
    return DROP_M + height, speed


def _hop_path(speed: float) -> Path:
    """Return the path of a ball that leaves the floor at a speed at which it should stay, lands again and stays."""
    back_s = LANDS_S + 2.0 * speed / GRAVITY

    def path(time_s: float) -> tuple[float, float]:
        if time_s < LANDS_S:
            return drop_path(time_s)
        return free_fall(time_s - LANDS_S, speed) if time_s < back_s else (0.0, 0.0)

    return path


#: With no impact of the reference there is nothing to be exact about.
FROM_REST = (
    Fault(
        "falls from rest",
        lambda size: build_run(RESTING, free_fall if size else _rest_path),
        parse_rungs("0 exact, 1 wrong passed_through"),
        "it lies on the floor at the start and falls 20 m through it",
    ),
    Fault(
        "a second disc falls through",
        lambda size: build_run(BESIDE, _rest_path, fall_through_path if size else drop_path, lands=None if size else 1),
        parse_rungs("0 exact, 1 wrong passed_through"),
        "one disc at rest ends the reference, and not the other's fall",
    ),
)


# Two equal discs, the one still, head-on at 4 m/s: mathematics lets them exchange their velocities when they meet.

SPEED, MEETS_S = 4.0, 30.25 * DT
BESIDE_M = 1.0 + SPEED * MEETS_S  # contact distance 1 m
PAIR = staged("pair", disc_at(0.0, 0.0, SPEED, 0.0), disc_at(BESIDE_M, 0.0), duration_s=2.0)


def build_passing_run(steps: float, aside_m: float = 0.0, phase: float = 0.0) -> Run:
    """Return two discs that pass through each other, in overlap for some steps; 0 for faithful ones.

    Off centre by `aside_m`, less than 1 m, they never have one centre. They touch so large a part of a step after a
    state: at 0 one of an even number of steps shows them at their nearest, where they neither close nor part.
    """
    if not steps:
        return record_pic(PAIR)
    inside_m = math.sqrt(1.0 - aside_m**2)  # contact distance 1 m: half of the way on which they overlap
    speed = 2.0 * inside_m / (steps * DT)
    touch_s = (15 + phase) * DT
    discs = disc_at(0.0, 0.0, speed, 0.0), disc_at(inside_m + touch_s * speed, aside_m)
    scene = staged("pass", *discs, duration_s=1.0 + steps * DT)
    return dataclasses.replace(remove_impacts(record_pic(scene), 0.0), scene=scene)


def build_pushing_run(steps: float) -> Run:
    """Return two discs that push each other for some steps from the touch on, evenly.

    The relative velocity goes in equal parts from what it was to what it should be, and places follow from velocities.
    """
    right = record_pic(PAIR)
    if not steps:
        return right
    times, lasts_s = right.states.time_s, steps * DT
    pushed = np.clip((times - MEETS_S) / lasts_s, 0.0, 1.0)
    position, velocity = right.states.position_m.copy(), right.states.velocity_m_s.copy()
    relative = SPEED - 2.0 * SPEED * pushed  # from closing at 4 m/s to parting
    centre = SPEED / 2.0
    closed = SPEED * np.minimum(times, MEETS_S) + np.where(
        times > MEETS_S,
        lasts_s * SPEED * (pushed - pushed**2) - SPEED * np.maximum(times - MEETS_S - lasts_s, 0.0),
        0.0,
    )
    for disc, sign, start in ((0, 1.0, 0.0), (1, -1.0, BESIDE_M)):
        velocity[:, disc, 0] = centre + sign * relative / 2.0
        position[:, disc, 0] = start + centre * times + sign * closed / 2.0
    # A step that begins before they touch is reported only by its end, so a push of n steps is seen in n + 1.
    return dataclasses.replace(
        right, states=States(times, position, velocity, right.states.spin_rad_s), lasts=math.ceil(steps) + 1
    )


#: How many steps bodies are in each other: fewer than a window is cut after, just as many, and more.
STEPS = (1, 2, 7, 8, 9, 15, 16, 17, 33, 120)

#: Windows are cut after eight steps: faults of fewer steps, of just eight, and of many more.
LONG = (
    Fault(
        "passes through slowly, steps",
        build_passing_run,
        parse_rungs(f"0 exact, {' '.join(map(str, STEPS))} wrong passed_through"),
        "they overlap for that many steps and part on the far side, no velocity changed; of an even number of steps "
        "there is a state in which they have one centre",
    ),
    Fault(
        "pushes for steps",
        build_pushing_run,
        parse_rungs("0 exact, 1 sampled, 4 7 8 9 16 17 24 40 inaccurate late"),
        "an even push of n steps acts n / 2 steps late; one step late is what sampling may cost",
    ),
)
