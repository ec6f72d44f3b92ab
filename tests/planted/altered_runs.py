"""Doctored runs: what a method shows of a scene, state by state, with a fault that begins at some time.

A run is recorded from the impacts that a solver found, on free paths from impact to impact, without the code that
scores a run. `Playback` is the adapter that shows it, so that a run goes the same way as any engine's.
"""

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from carom import Scene, Trace, compare, load_scene, solve_pic, solve_pit
from carom.comparator import Score
from carom.engines.api import Capabilities, Contact, ContactTimes, Engine, Observation, Profile, Setting
from carom.execution.observation.engine_run import observe_run
from carom.model.step_windows import States
from carom.model.trace import SPIN_DTYPE

Array = NDArray[np.float64]
Rows = NDArray[np.void]

DT = 1 / 60
GRAVITY = 9.81

#: Twelve discs in a box, e = .95: 162 impacts in 9 s, of which an ulp at the start leaves 93 as they are.
GAS = load_scene(Path(__file__).with_name("gas_of_12.toml"))
GAS_HORIZON_S, GAS_BEFORE_S, GAS_AFTER_S = 4.5, 2.7, 5.4


@dataclass(frozen=True)
class Run:
    """What a method shows of a scene.

    Attributes:
        scene: The scene that it is to run.
        states: At time 0 and after each step.
        impacts: What it reports, `carom.model.trace.IMPACT_DTYPE`.
        spins: The spins of these, `carom.model.trace.SPIN_DTYPE`; None where no disc spins.
        told: Whether it returns the velocities around an impact; else they are read from the states.
        lasts: In how many steps it reports each impact, if it does not tell velocities.
    """

    scene: Scene
    states: States
    impacts: Rows
    spins: Rows | None = None
    told: bool = False
    lasts: int = 1


def record_run(trace: Trace) -> Run:
    """Return the run that has these impacts, on free paths between them, at steps of `DT`."""
    scene, count = trace.scene, trace.scene.step_count(DT)
    times = np.arange(count + 1, dtype=np.float64) * DT
    position, velocity = np.zeros((count + 1, len(scene.discs), 2)), np.zeros((count + 1, len(scene.discs), 2))
    spin = np.zeros((count + 1, len(scene.discs)))
    for number, disc in enumerate(scene.discs):
        pull = np.zeros(2) if disc.immovable else np.array(scene.gravity_m_s2)
        since, place, speed, turn = 0.0, np.array(disc.position_m), np.array(disc.velocity_m_s), disc.spin_rad_s
        own = [(k, side) for k, i in enumerate(trace.impacts) for side in ("first", "second") if i[side] == number]
        for k, side in [*own, (-1, "")]:
            until = math.inf if k < 0 else float(trace.impacts[k]["time_s"])
            rows = (times >= since) & (times < until)
            flown = (times[rows] - since)[:, None]
            position[rows, number] = place + speed * flown + 0.5 * pull * flown**2
            velocity[rows, number], spin[rows, number] = speed + pull * flown, turn
            if k >= 0:
                flown_s = until - since
                since, place = until, place + speed * flown_s + 0.5 * pull * flown_s**2
                speed = trace.impacts[k][f"velocity_{side}_after"].copy()
                turn = turn if trace.spins is None else float(trace.spins[k][f"{side}_after"])
    states = States(times, position, velocity, spin if scene.arrays.turns else None)
    return Run(scene, states, trace.impacts, trace.spins)


def record_pic(scene: Scene) -> Run:
    """Return PIC's run."""
    return record_run(solve_pic(scene))


def record_pit(scene: Scene) -> Run:
    """Return PIT's run: paths turn at step boundaries."""
    return record_run(solve_pit(scene, frame_rate_hz=1 / DT))


def find_free_step(run: Run, time_s: float) -> int:
    """Return the first step boundary from a time on at which no two bodies touch."""
    for k in range(math.ceil(time_s / DT), len(run.states)):
        if _gap(run, k) > 1e-6:  # metres: a scene may begin there, and nothing is due at once
            return k
    raise AssertionError(f"no boundary after {time_s} s is free")


def _gap(run: Run, k: int) -> float:
    place, radius = run.states.position_m[k], run.scene.arrays.radius_m
    first, second = np.triu_indices(len(place), 1)
    gaps = [np.hypot(*(place[second] - place[first]).T) - radius[first] - radius[second]]
    gaps += [(place - np.array(wall.point_m)) @ np.array(wall.normal) - radius for wall in run.scene.half_planes()]
    return float(np.min(np.concatenate(gaps)))


def change_law(run: Run, time_s: float, **law: Any) -> Run:
    """Return the run with other coefficients from a time on: true to its own law, and not to the scene's."""
    k = find_free_step(run, time_s)
    begun_s, spins = k * DT, run.states.spin_rad_s
    discs = [
        disc.model_copy(
            update={
                "position_m": tuple(map(float, run.states.position_m[k, i])),
                "velocity_m_s": tuple(map(float, run.states.velocity_m_s[k, i])),
                "spin_rad_s": 0.0 if spins is None else float(spins[k, i]),
            }
        )
        for i, disc in enumerate(run.scene.discs)
    ]
    fields = {name: getattr(run.scene, name) for name in type(run.scene).model_fields}
    left_s = (len(run.states) - 1 - k) * DT
    later = solve_pic(Scene(**{**fields, "discs": discs, "duration_s": left_s, **law}))
    then = record_run(later)
    count = len(run.states) - k  # as many steps are left, whatever the rounding of `left_s` makes of them
    states = States(
        run.states.time_s,
        np.concatenate([run.states.position_m[:k], then.states.position_m[:count]]),
        np.concatenate([run.states.velocity_m_s[:k], then.states.velocity_m_s[:count]]),
        None if spins is None else np.concatenate([spins[:k], _spins_of(then)[:count]]),
    )
    kept = run.impacts["time_s"] <= begun_s
    impacts = later.impacts.copy()
    impacts["time_s"] += begun_s
    told = None
    if run.spins is not None:
        ours = np.zeros(len(impacts), SPIN_DTYPE) if later.spins is None else later.spins
        told = np.concatenate([run.spins[kept], ours])
    return dataclasses.replace(run, states=states, impacts=np.concatenate([run.impacts[kept], impacts]), spins=told)


def _spins_of(run: Run) -> Array:
    spins = run.states.spin_rad_s
    return np.zeros(run.states.velocity_m_s.shape[:2]) if spins is None else spins


def remove_impacts(run: Run, time_s: float) -> Run:
    """Return the run with no impact at all from a time on: bodies pass through one another."""
    k = find_free_step(run, time_s)
    pull = np.array([(0.0, 0.0) if disc.immovable else run.scene.gravity_m_s2 for disc in run.scene.discs])
    flown = (run.states.time_s[k:] - run.states.time_s[k])[:, None, None]
    position, velocity = run.states.position_m.copy(), run.states.velocity_m_s.copy()
    position[k:] = position[k] + velocity[k] * flown + 0.5 * pull * flown**2
    velocity[k:] = velocity[k] + pull * flown
    spins = None if run.states.spin_rad_s is None else run.states.spin_rad_s.copy()
    if spins is not None:
        spins[k:] = spins[k]
    kept = run.impacts["time_s"] <= k * DT
    return dataclasses.replace(
        run,
        states=States(run.states.time_s, position, velocity, spins),
        impacts=run.impacts[kept],
        spins=None if run.spins is None else run.spins[kept],
    )


def change_states(run: Run, time_s: float, *, place: Any = None, speed: Any = None, spin: Any = None) -> Run:
    """Return the run with its states changed from a step after a time on; what it reports stays as it is.

    Each of `place`, `speed` and `spin` takes the states' rows and the seconds since, shapes ``(k, n, ...)`` and
    ``(k, 1, 1)`` or ``(k, 1)``, and gives the rows shown.
    """
    k = find_free_step(run, time_s)
    since = run.states.time_s[k:] - run.states.time_s[k]
    position, velocity = run.states.position_m.copy(), run.states.velocity_m_s.copy()
    spins = None if run.states.spin_rad_s is None else run.states.spin_rad_s.copy()
    if place is not None:
        position[k:] = place(position[k:], since[:, None, None])
    if speed is not None:
        velocity[k:] = speed(velocity[k:], since[:, None, None])
    if spin is not None and spins is not None:
        spins[k:] = spin(spins[k:], since[:, None])
    return dataclasses.replace(run, states=States(run.states.time_s, position, velocity, spins))


class _World:
    """A run played back."""

    def __init__(self, run: Run) -> None:
        self.settings: Mapping[str, Setting] = {"dt_s": DT}
        self._run, self._steps = run, 0

    def advance(self, steps: int) -> None:
        self._steps += steps

    def observe(self) -> Observation:
        run, k = self._run, self._steps
        times = run.impacts["time_s"]
        lasts = 1 if run.told else run.lasts
        mine = np.flatnonzero((times > (k - lasts) * DT) & (times <= k * DT) & (k > 0))
        spins = run.states.spin_rad_s
        return Observation(
            run.states.position_m[k].copy(),
            run.states.velocity_m_s[k].copy(),
            tuple(_contact(run, int(row), k) for row in mine),
            spin_rad_s=None if spins is None else spins[k].copy(),
        )

    def close(self) -> None:
        pass


def _contact(run: Run, row: int, k: int) -> Contact:
    impact = run.impacts[row]
    time_s = float(impact["time_s"])
    told = tuple(_pair(impact[f"velocity_{b}_{w}"]) for w in ("before", "after") for b in ("first", "second"))
    spins = None if run.spins is None or not run.told else tuple(map(float, run.spins[row]))
    return Contact(
        int(impact["first"]),
        int(impact["second"]),
        time_s if time_s > (k - 1) * DT else (k - 1) * DT,  # a contact that goes on is stamped by its step
        _pair(impact["normal"]),
        None,
        told if run.told else None,  # type: ignore[arg-type] # four of them
        spins_rad_s=spins,  # type: ignore[arg-type] # four of them
    )


def _pair(vector: Array) -> tuple[float, float]:
    return float(vector[0]), float(vector[1])


@dataclass(frozen=True)
class Playback:
    """The adapter that shows one run."""

    run: Run
    name: str = "doctored"
    engine: Engine = field(default_factory=lambda: Engine("Doctored"))

    @property
    def capabilities(self) -> Capabilities:
        """Able to do anything: what it is asked is what it was recorded of."""
        return Capabilities(
            gravity=True,
            restitution=(0.0, 1.0),
            spin=True,
            friction=(0.0, math.inf),
            tangential_restitution=True,
            contact_times=ContactTimes.SOLVED,
        )

    @property
    def profiles(self) -> Mapping[str, Profile]:
        """One profile."""
        return {"default": Profile("As recorded.", lambda dt_s: {"dt_s": dt_s})}

    def prepare(self, scene: Scene, settings: Mapping[str, Setting]) -> _World:
        """Return the run, from its start."""
        assert scene == self.run.scene
        assert settings["dt_s"] == DT
        return _World(self.run)


def score_run(run: Run, *, horizon_s: float | None = None) -> Score:
    """Return the score of a run, shown by an adapter, with PIT at the same step."""
    trace = observe_run(Playback(run), run.scene, "default", DT)
    sampling = solve_pit(run.scene, frame_rate_hz=1 / DT)
    return compare(solve_pic(run.scene), trace, sampling=sampling, horizon=horizon_s)
