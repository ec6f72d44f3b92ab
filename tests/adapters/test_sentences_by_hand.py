"""What a report says of an engine's impacts is what the engine does alone, against quadratics: no adapter in between.

Each sentence on a scene of the groups `engines` and `gravity` that gives a number of the trajectory is derived again
from `bare_runs` (the engine by its own interface) and `by_hand` (what should happen). A sentence agrees to half of the
last of its three digits, and to as much as the same run differs by from one way to build it to another.
"""

import json
import math
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from tests.adapters.bare_runs import ENGINES, Body, Stage, States
from tests.adapters.exact_trajectories import Truth, estimate_impact_time, find_velocity_changes
from tests.cases import each
from tests.scene_builders import run_cross_check

from carom import Scene
from carom.catalogue import all_scenes, find_scenes
from carom.comparator import Verdict
from carom.engines.registry import load_adapter
from carom.report.results_file.results_jsonl import format_records

pytestmark = pytest.mark.long  # it runs two groups of scenes in each engine, twice

DT_S = 1 / 60
#: Chaotic: a bare run and an adapter's part after some seconds, by their last bits.
CHAOTIC = "engines/gas-of-25"
#: A number of three digits is off by up to half of its last one.
DIGITS = 5.1e-3
#: Two builds of a run in 32 bits, with walls of other sizes, differ by so much; of a step, a hundredth.
SINGLE, STEP = 1e-5, 0.01
NUMBER = re.compile(r"-?\d[\d.]*(?:e[-+]?\d+)?")


@dataclass(frozen=True)
class Bare:
    """A bare run of a scene, what should have happened, and what follows of the two.

    Attributes:
        stage: What was run.
        truth: What should have happened.
        states: What the engine did.
        dt_s: The step.
        end: Places and velocities at the end of the scene.
        late_s: By how much each impact is late, where as many were found as there are.
        off: Velocity errors of these, over the scene's speed.
        turned_deg: Angles between velocities after them and the true ones, in degrees.
        lost: How many impacts were not found.
    """

    stage: Stage
    truth: Truth
    states: States
    dt_s: float
    end: tuple[Any, Any]
    late_s: tuple[float, ...]
    off: tuple[float, ...]
    turned_deg: tuple[float, ...]
    lost: int

    def energy(self) -> float:
        """Kinetic energy at the end less what it should be, over that at the start."""
        movable = np.isfinite(self.truth.mass)

        def of(velocity: Any) -> float:
            return float((self.truth.mass[movable, None] * velocity[movable] ** 2).sum() / 2)

        return (of(self.end[1]) - of(self.truth.end_velocity)) / of(self.states[0, :, 2:])

    def largest_deviation(self) -> float:
        """How far places are from those of free flight, in metres: of a scene without an impact."""
        times = np.arange(len(self.states)) * self.dt_s
        free = self.states[0, :, :2] + self.states[0, :, 2:] * times[:, None, None]
        return float(np.abs(self.states[:, :, :2] - free).max())

    def first_step_error(self) -> float:
        """How far the first step ends from its parabola, in metres."""
        falls = np.isfinite(self.truth.mass)[:, None] * np.array(self.stage.gravity)
        parabola = self.states[0, :, 2:] * self.dt_s + falls * self.dt_s**2 / 2
        return float(np.hypot(*(self.states[1, :, :2] - self.states[0, :, :2] - parabola).T).max())


def _build_stage(scene: Scene) -> Stage:
    discs = [Body(one.position_m, one.velocity_m_s, one.radius_m, one.mass_kg) for one in scene.discs]
    walls = [(wall.point_m, wall.normal) for wall in scene.half_planes()]
    return Stage(tuple(discs), tuple(walls), scene.restitution, scene.wall_restitution, scene.gravity_m_s2)


def _run_bare(engine: str, profile: str, scene: Scene, float_bits: int) -> Bare:
    stage = _build_stage(scene)
    truth, steps = Truth(stage, scene.duration_s), math.ceil(scene.duration_s / DT_S - STEP)
    states = ENGINES[engine](stage, profile, DT_S, steps)[:, :, :4]
    movable = np.isfinite(truth.mass)
    falls, beyond = movable[:, None] * np.array(stage.gravity), scene.duration_s - steps * DT_S
    place, velocity = states[-1, :, :2], states[-1, :, 2:]
    end = (place + velocity * beyond + falls * (beyond**2 / 2), velocity + falls * beyond)
    late, off, turned, lost = [], [], [], 0
    least = truth.fastest * (1e-9 if float_bits == 64 else SINGLE)
    for first, second in sorted({(one.first, one.second) for one in truth.meetings}):
        true = [one for one in truth.meetings if (one.first, one.second) == (first, second)]
        found = find_velocity_changes(states, DT_S, stage, first, second, least)
        lost += len(true) - len(found)
        for one, turn in zip(true, found, strict=False) if len(true) == len(found) else ():
            at_s = estimate_impact_time(states, DT_S, stage, first, second, turn)
            late.append(at_s - one.time_s)
            # Two discs that fall alike leave as fast as they fell until then; a wall's bounce is looked at as it is.
            alike = second >= 0 and movable[[first, second]].all()
            back = min(max(at_s, turn[0] * DT_S), turn[1] * DT_S) - turn[1] * DT_S if alike else 0.0
            after = states[turn[1], :, 2:] + falls * back
            for body in (body for body in (first, second) if body >= 0 and movable[body]):
                (ax, ay), (bx, by) = after[body], one.velocity[body]
                off.append(math.hypot(ax - bx, ay - by) / truth.fastest)
                if math.hypot(bx, by) > least:
                    turned.append(abs(math.degrees(math.atan2(ax * by - ay * bx, ax * bx + ay * by))))
    return Bare(stage, truth, states, DT_S, end, tuple(late), tuple(off), tuple(turned), lost)


def _largest_of(of: Callable[[Bare], tuple[float, ...]], sign: float = 1.0) -> Callable[[Bare], float]:
    return lambda bare: max((sign * one for one in of(bare)), default=0.0)


#: Of a verdict that gives a number: which of its numbers it is, what the bare run has for it, and what the same run may
#: differ by if it is built otherwise.
SAID: Mapping[Verdict, tuple[int, Callable[[Bare], float], float]] = {
    Verdict.LATE: (0, _largest_of(lambda bare: bare.late_s), STEP * DT_S),
    Verdict.EARLY: (0, _largest_of(lambda bare: bare.late_s, -1.0), STEP * DT_S),
    Verdict.WRONG_VELOCITY: (0, _largest_of(lambda bare: bare.off), SINGLE),
    Verdict.WRONG_DIRECTION: (0, _largest_of(lambda bare: bare.turned_deg), math.degrees(SINGLE)),
    Verdict.ENERGY_GAINED: (0, Bare.energy, SINGLE),
    Verdict.ENERGY_LOST: (0, lambda bare: -bare.energy(), SINGLE),
    Verdict.MISPLACED: (
        0,
        lambda bare: np.hypot(*(bare.end[0] - bare.truth.end_place).T).max() / max(d.radius for d in bare.stage.discs),
        SINGLE,
    ),
    Verdict.WRONG_END: (
        0,
        lambda bare: np.hypot(*(bare.end[1] - bare.truth.end_velocity).T).max() / bare.truth.fastest,
        SINGLE,
    ),
    Verdict.POLYGON: (0, Bare.first_step_error, SINGLE),
    Verdict.MISSED: (0, lambda bare: bare.lost, 0.0),
    Verdict.MULTIPLE_MISSED: (0, lambda bare: bare.lost, 0.0),
    Verdict.DIVERGED: (-3, lambda bare: bare.lost, 0.0),
}
#: Contacts of MuJoCo's spring with floor and side wall overlap here: their effects are not separated.
OVERLAPPING = {("gravity/box", "mujoco", "default")}


def _iterate_sentences(engine: str) -> Iterator[tuple[str, str, Verdict, str]]:
    """Yield scene, profile, verdict and sentence of every run of the two groups."""
    scenes = [scene for scene in find_scenes(["engines", "gravity"]) if scene.name != CHAOTIC]
    found = run_cross_check(scenes, ["pic", "pit", engine], dts=[DT_S], profiles=["default", "tuned"], certified=False)
    named = {verdict.name.lower(): verdict for verdict in Verdict}
    for row in map(json.loads, format_records(found).splitlines()[1:]):
        if row["engine"] == engine and row["status"] == "ran":
            for one in row["verdicts"]:
                yield row["scene"], row["profile"], named[one["verdict"]], one["reason"]


@each("engine", list(ENGINES))
def test_report_sentences_match_bare_engine_runs(engine: str) -> None:
    """Every number in a verdict's sentence equals that of the engine's bare run, to half of its last digit."""
    bits = load_adapter(engine).capabilities.float_bits
    runs: dict[tuple[str, str], Bare] = {}
    checked, false = 0, []
    for name, profile, verdict, reason in _iterate_sentences(engine):
        if (name, engine, profile) in OVERLAPPING and verdict in {Verdict.EARLY, Verdict.LATE}:
            continue
        if (name, profile) not in runs:
            runs[name, profile] = _run_bare(engine, profile, all_scenes()[name].scene, bits)
        bare = runs[name, profile]
        if verdict is Verdict.NO_IMPACT:
            # Half a rounding of the farthest place a step.
            farthest = float(np.abs(bare.states[:, :, :2]).max())
            said, own = 0.0, bare.largest_deviation()
            differs = len(bare.states) * farthest * 2.0 ** (-24 if bits == 32 else -53)
        elif verdict in SAID:
            which, of, differs = SAID[verdict]
            said, own = float(NUMBER.findall(reason)[which]), float(of(bare))
        else:
            continue
        checked += 1
        if not abs(said - own) <= max(DIGITS * abs(own), differs):
            false.append(f"{name} {profile}: {verdict.value}: {reason}; bare: {own:.6g}")
    assert not false, "\n".join(false)
    assert checked > 60, "hardly anything was said"
