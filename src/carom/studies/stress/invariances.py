"""Invariances: changes of a scene that must change its result in a known way. The result itself may be unknown.

For example, if a scene is rotated, its result must be rotated. An engine that violates an invariance is wrong in at
least one of the two scenes. An engine whose slops, thresholds or margins are fixed lengths, speeds or times fails when
the units are changed.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from carom.catalogue.staging import to_vector
from carom.errors import InputError
from carom.execution.job import Method, Status
from carom.execution.pool import TaskRunner
from carom.model.scene import Disc, Scene
from carom.model.trace import Outcome, Trace
from carom.studies.stress.failure_search import NotCompletedError, observe, rename_scene
from carom.studies.stress.result import CellEnding, CellResult, UnsavedResult
from carom.support.formatting import format_number

#: Largest deviation that does not count as a violation. Three impacts multiply rounding errors by a few hundred, and a
#: few hundred steps multiply rounding errors again. The effect of an engine's absolute lengths and speeds is larger by
#: orders of magnitude.
DEVIATION_LIMIT = 1e-9

#: A coefficient of friction that every engine supports, and with which superballs never slide.
_GRIP = 10.0

_SUPERBALLS = "Four unequal spinning superballs with oblique impacts."

Run = Callable[[Scene], Trace]

#: Function that runs a base scene and a changed scene, and returns how much the second result deviates from the
#: expected result. Deviations of positions are divided by the largest radius, and deviations of velocities and rim
#: speeds by the greatest speed. The function raises SceneError if the changed scene can't start from the final state of
#: the first run.
Deviation = Callable[[Scene, Run], float]


class State(NamedTuple):
    """State of n discs at an instant.

    Attributes:
        position: Centres, in metres, shape ``(n, 2)``.
        velocity: Velocities, in metres per second, shape ``(n, 2)``.
        spin: Spins, in radians per second, shape ``(n,)``.
    """

    position: NDArray[np.float64]
    velocity: NDArray[np.float64]
    spin: NDArray[np.float64]


def build_base_scene() -> Scene:
    """Return the base scene: four unequal discs with three oblique impacts, with long times between the impacts.

    One invariance stops the run at 1 s and continues it. The second impact is at 0.59 s and the third at 1.39 s.
    Therefore even a contact of a tenth of a second is over at 1 s.
    """
    description = "Four unequal discs with three oblique impacts."
    discs = [
        Disc(position_m=(-1.5, 0.1), velocity_m_s=(3.0, 0.0), radius_m=0.25),
        Disc(position_m=(0.0, 0.0), radius_m=0.25, mass_kg=2.0),
        Disc(position_m=(1.3, -0.25), velocity_m_s=(-0.5, 0.0), radius_m=0.3),
        Disc(position_m=(2.6, 0.2), velocity_m_s=(-1.0, -0.1), radius_m=0.2, mass_kg=0.5),
    ]
    return Scene(name="stress/relations", description=description, discs=discs, duration_s=1.75, frame_rate_hz=240.0)


def build_rough_scene() -> Scene:
    """Return the base scene with spins and friction.

    The discs slide on each other in the first and the third impact, and stick in the second impact.
    """
    base = build_base_scene()
    turning = zip(base.discs, (12.0, -2.0, 0.0, 3.0), (0.5, 0.4, 1.0, 0.5), strict=True)
    discs = [disc.model_copy(update={"spin_rad_s": spin, "inertia_factor": factor}) for disc, spin, factor in turning]
    description = "Four unequal spinning discs with three oblique impacts and friction."
    return _build_variant(base, discs, name="stress/rough-relations", description=description, friction=0.1)


def build_superball_scene() -> Scene:
    """Return the scene of `build_rough_scene` with tangential restitution 1 and enough friction to prevent sliding."""
    rough = build_rough_scene()
    about = {"name": "stress/superball-relations", "description": _SUPERBALLS}
    return _build_variant(rough, rough.discs, **about, friction=_GRIP, tangential_restitution=1.0)


@dataclass(frozen=True)
class Invariance:
    """An invariance: a relation between the results of two runs of the same method.

    Attributes:
        name: Short name, as on the command line.
        statement: The invariance in one sentence.
        deviation: Function that measures the deviation from the invariance.
        base: Function that returns the base scene.
        starts_from_result: Whether the changed scene starts from the final state of the first run, so that each method
            has a different changed scene.
    """

    name: str
    statement: str
    deviation: Deviation
    base: Callable[[], Scene] = build_base_scene
    starts_from_result: bool = False


def _build_variant(scene: Scene, discs: Sequence[Disc], **fields: float | str) -> Scene:
    return Scene(**{**dict(scene), "discs": discs, **fields})


def _build_scene_at_state(base: Scene, state: State, **fields: float) -> Scene:
    discs = [
        Disc(**{**dict(disc), "position_m": tuple(p), "velocity_m_s": tuple(v), "spin_rad_s": w})
        for disc, p, v, w in zip(base.discs, *(part.tolist() for part in state), strict=True)
    ]
    return _build_variant(base, discs, **fields)


def _start_state_of(scene: Scene) -> State:
    return State(scene.arrays.position_m, scene.arrays.velocity_m_s, scene.arrays.spins)


def _compute_deviation(base: Scene, found: State, expected: State) -> float:
    start = base.arrays
    speed = max(*np.hypot(*start.velocity_m_s.T), *np.abs(start.surface_speed_m_s))
    place, velocity = (np.max(np.hypot(*(one - other).T)) for one, other in zip(found[:2], expected[:2], strict=True))
    rim = np.max(start.radius_m * np.abs(found.spin - expected.spin))
    deviation = float(np.maximum(place / start.radius_m.max(), np.maximum(velocity, rim) / speed))
    return math.inf if math.isnan(deviation) else deviation


def _final_state_of(trace: Trace) -> State:
    spin = trace.final_spin_rad_s  # if a disc spins, a trace without spins was already rejected
    resting = np.zeros(len(trace.scene.discs))
    return State(trace.final_position_m, trace.final_velocity_m_s, resting if spin is None else spin)


def _relate_scenes(change: Callable[[Scene], Scene], undo: Callable[[State], State]) -> Deviation:
    """Return a function that measures the deviation between a scene and the scene that `change` returns.

    `undo` converts a final state of the changed scene to the corresponding state of the unchanged scene.
    """

    def deviation(base: Scene, run: Run) -> float:
        first = _final_state_of(run(base))
        return _compute_deviation(base, undo(_final_state_of(run(change(base)))), first)

    return deviation


def _relate_motions(change: Callable[[State], State], undo: Callable[[State], State]) -> Deviation:
    """Return a function that measures the deviation if `change` is applied to the starting state of a scene.

    `undo` converts the final state of the changed scene to the corresponding state of the unchanged scene.
    """
    return _relate_scenes(lambda scene: _build_scene_at_state(scene, change(_start_state_of(scene))), undo)


def _measure_reversal_deviation(base: Scene, run: Run) -> float:
    def reverse(at: State) -> State:
        return State(at.position, -at.velocity, -at.spin)

    back = run(_build_scene_at_state(base, reverse(_final_state_of(run(base)))))
    return _compute_deviation(base, reverse(_final_state_of(back)), _start_state_of(base))


def _measure_split_deviation(base: Scene, run: Run) -> float:
    unsplit_state, at_s = _final_state_of(run(base)), 1.0
    half = _final_state_of(run(_build_variant(base, base.discs, duration_s=at_s)))
    rest = run(_build_scene_at_state(base, half, duration_s=base.duration_s - at_s))
    return _compute_deviation(base, _final_state_of(rest), unsplit_state)


def _relate_units(*, length: float = 1.0, time: float = 1.0, mass: float = 1.0) -> Deviation:
    speed = length / time

    def scale(disc: Disc) -> Disc:
        (x, y), (u, v) = disc.position_m, disc.velocity_m_s
        motion = {"position_m": (x * length, y * length), "velocity_m_s": (u * speed, v * speed)}
        size = {"radius_m": disc.radius_m * length, "mass_kg": disc.mass_kg * mass}
        return disc.model_copy(update=motion | size | {"spin_rad_s": disc.spin_rad_s / time})

    def change(scene: Scene) -> Scene:
        times = {"duration_s": scene.duration_s * time, "frame_rate_hz": scene.frame_rate_hz / time}
        return _build_variant(scene, list(map(scale, scene.discs)), **times)

    def undo(state: State) -> State:
        return State(state.position / length, state.velocity / speed, state.spin * time)

    return _relate_scenes(change, undo)


def _relate_boost() -> Deviation:
    velocity = (11.0, -7.0)
    path_m = np.array(velocity) * build_base_scene().duration_s
    return _relate_motions(
        lambda state: state._replace(velocity=state.velocity + velocity),
        lambda state: State(state.position - path_m, state.velocity - velocity, state.spin),
    )


def _relate_rotation() -> Deviation:
    turn = cmath.rect(1.0, 0.7)

    def rotate(state: State) -> State:
        place, velocity = ([to_vector(complex(*row) * turn) for row in rows.tolist()] for rows in state[:2])
        return State(np.array(place), np.array(velocity), state.spin)

    def rotate_back(state: State) -> State:
        z, w = ((rows[:, 0] + 1j * rows[:, 1]) * turn.conjugate() for rows in state[:2])
        return State(np.stack([z.real, z.imag], axis=1), np.stack([w.real, w.imag], axis=1), state.spin)

    return _relate_motions(rotate, rotate_back)


def _mirror(at: State) -> State:
    turned = np.array([1.0, -1.0])
    # Adding 0, or subtracting from 0, avoids the number -0.
    return State(at.position * turned + 0.0, at.velocity * turned + 0.0, 0.0 - at.spin)


def list_invariances() -> list[Invariance]:
    """Return all invariances, in the order of the table. Invariances with friction are last."""
    mirrored = "The mirror image of the scene has the mirror image of its result."
    reverse_order = _relate_scenes(
        lambda scene: _build_variant(scene, scene.discs[::-1]),
        lambda state: State(*(part[::-1] for part in state)),
    )
    exact = (
        "In units of 2^10 m, 2^6 s and 2^-10 kg, every number is multiplied by a power of two, and no digit changes."
    )
    general = [
        Invariance("boost", "Adding a velocity of (11, -7) m/s to all discs changes nothing else.", _relate_boost()),
        Invariance("rotation", "Turning the scene by 0.7 rad turns its result.", _relate_rotation()),
        Invariance("mirror", mirrored, _relate_motions(_mirror, _mirror)),
        Invariance("relabelling", "Listing the discs in reverse order changes nothing.", reverse_order),
        Invariance("units-of-two", exact, _relate_units(length=2.0**-10, time=2.0**-6, mass=2.0**10)),
    ]
    slow_motion = "Making the scene and its frames a thousand times slower changes only the unit of time."
    far = Disc(position_m=(1000.0, 1000.0), radius_m=0.25)
    add_far_disc = _relate_scenes(
        lambda scene: _build_variant(scene, [*scene.discs, far]),
        lambda state: State(*(part[:-1] for part in state)),
    )
    returns = "If all velocities are reversed at the end, the run returns to its start."
    reversal = Invariance("reversal", returns, _measure_reversal_deviation, starts_from_result=True)
    continued = "If a run is stopped at 1 s and continued from its state, it ends like an uninterrupted run."
    split = Invariance("split", continued, _measure_split_deviation, starts_from_result=True)
    with_friction = "With friction and spin: "
    rough = [
        replace(one, name=f"rough-{one.name}", statement=with_friction + one.statement, base=build_rough_scene)
        for one in (*general, split)
    ]
    superballs = "If velocities and spins of superballs are reversed at the end, the run returns to its start."
    return [
        *general,
        Invariance("kilometres", "Measuring in kilometres changes only the unit.", _relate_units(length=1e-3)),
        Invariance("millimetres", "Measuring in millimetres changes only the unit.", _relate_units(length=1e3)),
        Invariance("slow-motion", slow_motion, _relate_units(time=1e3)),
        Invariance("light", "Making all masses a million times smaller changes nothing.", _relate_units(mass=1e-6)),
        Invariance("far-disc", "Adding a disc at rest, a kilometre away, changes nothing.", add_far_disc),
        reversal,
        split,
        *rough,
        replace(reversal, name="superball-reversal", statement=superballs, base=build_superball_scene),
    ]


def check_invariance(invariance: Invariance, method: Method, runner: TaskRunner) -> UnsavedResult:
    """Check whether a method keeps an invariance. Return the result, and the scenes that were run."""
    used: list[Scene] = []

    def run(scene: Scene) -> Trace:
        used.append(scene)
        answer = observe(scene, method, runner)
        if answer.value is None:
            raise NotCompletedError(answer.problem, answer.status)
        if answer.value.outcome is not Outcome.COMPLETED:
            said = "; ".join((answer.value.outcome.value, *answer.value.notes))
            raise NotCompletedError(said.rstrip("; "), answer.status)
        return answer.value

    value, status = None, Status.RAN
    try:
        value = invariance.deviation(invariance.base(), run)
        deviates = f"the result deviates by {format_number(value)} times the largest radius or the greatest speed"
        reason = "" if value <= DEVIATION_LIMIT else deviates
    except NotCompletedError as error:
        reason, status = error.args
    except InputError as error:
        why = "the second run can't start from the final state of the first run"
        reason = f"no second scene: {why} ({str(error).splitlines()[0]})"
    if status in {Status.UNAVAILABLE, Status.UNSUPPORTED}:
        return UnsavedResult(CellResult(CellEnding.NOT_RUN, reason=reason, status=status))
    ending = CellEnding.VIOLATED if reason else CellEnding.HOLDS
    result = CellResult(ending, value, reason=reason, runs=len(used), status=status)
    return UnsavedResult(result, _build_named_scenes(invariance, method, used))


def _build_named_scenes(invariance: Invariance, method: Method, used: list[Scene]) -> tuple[Scene, ...]:
    """Return the scenes of an invariance under unique names.

    A scene that does not depend on the method has the same name for all methods.
    """
    base, *others = used
    renamed = [rename_scene(f"{base.name.partition('/')[2]}-base", base, base.description)]
    for k, scene in enumerate(others, start=1):
        own = f"/{method.engine}/{method.profile}/{k}" if invariance.starts_from_result else ""
        renamed.append(rename_scene(f"{invariance.name}{own}", scene, f"{scene.description} {invariance.statement}"))
    return tuple(renamed)
