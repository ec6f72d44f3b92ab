"""Doctored runs: what a method shows of a scene, state by state, with a fault that begins at some time.

A run is recorded from PIC, without the code that scores a run. `Playback` is the adapter that shows it, so that a run
goes the same way as any engine's.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from tests.scene_builders import require_value

from carom import Scene, compare, load_scene, solve_pic, solve_pit
from carom.comparator import Score
from carom.engines.api import Capabilities, Contact, ContactTimes, Engine, Observation, Profile, Setting
from carom.execution.observation.engine_run import observe_run
from carom.model.step_windows import States
from carom.model.trace import SPIN_DTYPE
from carom.solvers.pic import start_pic_run

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
        states: At time 0 and after each step, with spins.
        impacts: What it reports, `carom.model.trace.IMPACT_DTYPE`.
        spins: The spins of these, `carom.model.trace.SPIN_DTYPE`.
        told: Whether it returns the velocities around an impact; else they are read from the states.
        lasts: In how many steps it reports each impact, if it does not tell velocities.
    """

    scene: Scene
    states: States
    impacts: Rows
    spins: Rows
    told: bool = False
    lasts: int = 1

    @property
    def spin_rad_s(self) -> Array:
        """The spins of the states."""
        return require_value(self.states.spin_rad_s)

    def change_states_from(self, step: int, position: Array, velocity: Array, spin: Array) -> Run:
        """Return the run with these states from a step on."""
        old = self.states
        states = States(
            old.time_s,
            np.concatenate([old.position_m[:step], position]),
            np.concatenate([old.velocity_m_s[:step], velocity]),
            np.concatenate([self.spin_rad_s[:step], spin]),
        )
        return dataclasses.replace(self, states=states)

    def keep_impacts_until(self, time_s: float) -> Run:
        """Return the run without the later impacts."""
        kept = self.impacts["time_s"] <= time_s
        return dataclasses.replace(self, impacts=self.impacts[kept], spins=self.spins[kept])


def record_pic(scene: Scene) -> Run:
    """Return PIC's run."""
    trace, solver = solve_pic(scene), start_pic_run(scene)
    times = np.arange(scene.step_count(DT) + 1, dtype=np.float64) * DT
    rows = list[tuple[Array, Array, Array]]()
    for time_s in times.tolist():
        solver.advance_to(time_s)
        spins = solver.spins()
        rows.append((solver.positions(), solver.velocities(), np.zeros(len(scene.discs)) if spins is None else spins))
    reported = np.zeros(len(trace.impacts), SPIN_DTYPE) if trace.spins is None else trace.spins
    return Run(scene, States(times, *map(np.array, zip(*rows, strict=True))), trace.impacts, reported)


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
    place, velocity, spin = run.states.position_m[k].tolist(), run.states.velocity_m_s[k].tolist(), run.spin_rad_s[k]
    discs = [
        disc.model_copy(
            update={"position_m": tuple(place[i]), "velocity_m_s": tuple(velocity[i]), "spin_rad_s": float(spin[i])}
        )
        for i, disc in enumerate(run.scene.discs)
    ]
    left = len(run.states) - k
    later = record_pic(Scene(**{**dict(run.scene), "discs": discs, "duration_s": (left - 1) * DT, **law}))
    then = later.states  # as many steps as are left, or one more by rounding
    changed = run.change_states_from(k, then.position_m[:left], then.velocity_m_s[:left], later.spin_rad_s[:left])
    impacts = later.impacts.copy()
    impacts["time_s"] += k * DT
    kept = changed.keep_impacts_until(k * DT)
    return dataclasses.replace(
        kept, impacts=np.concatenate([kept.impacts, impacts]), spins=np.concatenate([kept.spins, later.spins])
    )


def remove_impacts(run: Run, time_s: float) -> Run:
    """Return the run with no impact at all from a time on: bodies pass through one another."""
    k, states = find_free_step(run, time_s), run.states
    pull = np.array([(0.0, 0.0) if disc.immovable else run.scene.gravity_m_s2 for disc in run.scene.discs])
    flown = (states.time_s[k:] - states.time_s[k])[:, None, None]
    position = states.position_m[k] + states.velocity_m_s[k] * flown + 0.5 * pull * flown**2
    velocity = states.velocity_m_s[k] + pull * flown
    spin = np.tile(run.spin_rad_s[k], (len(position), 1))
    return run.change_states_from(k, position, velocity, spin).keep_impacts_until(k * DT)


Change = Callable[[Array, Array], Array]


def keep_rows(rows: Array, _: Array) -> Array:
    return rows


def change_states(
    run: Run, time_s: float, *, place: Change = keep_rows, speed: Change = keep_rows, spin: Change = keep_rows
) -> Run:
    """Return the run with its states changed from a step after a time on; what it reports stays as it is.

    Each of `place`, `speed` and `spin` takes the states' rows and the seconds since, shapes ``(k, n, ...)`` and
    ``(k, 1, 1)`` or ``(k, 1)``, and gives the rows shown.
    """
    k, states = find_free_step(run, time_s), run.states
    since = states.time_s[k:] - states.time_s[k]
    position = place(states.position_m[k:], since[:, None, None])
    velocity = speed(states.velocity_m_s[k:], since[:, None, None])
    return run.change_states_from(k, position, velocity, spin(run.spin_rad_s[k:], since[:, None]))


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
        return Observation(
            run.states.position_m[k].copy(),
            run.states.velocity_m_s[k].copy(),
            tuple(_contact(run, int(row), k) for row in mine),
            spin_rad_s=run.spin_rad_s[k].copy() if run.scene.arrays.turns else None,
        )

    def close(self) -> None:
        pass


def _contact(run: Run, row: int, k: int) -> Contact:
    impact = run.impacts[row]
    time_s = float(impact["time_s"])
    told = tuple(_pair(impact[f"velocity_{b}_{w}"]) for w in ("before", "after") for b in ("first", "second"))
    spins = tuple(map(float, run.spins[row])) if run.told and run.scene.arrays.turns else None
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
