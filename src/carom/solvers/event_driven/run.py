"""A PIC run that can be advanced step by step, observed, saved and resumed."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from carom.errors import InputError
from carom.model.disc_arrays import DiscArrays
from carom.model.overlap import require_apart
from carom.model.trace import Outcome, body_name
from carom.solvers.event_driven.obstacles import MOST_OBSTACLES, NO_OBSTACLE, Obstacles
from carom.solvers.options import ALWAYS, NO_LIMIT, RunOptions, require_goal
from carom.solvers.rows import RecordedImpacts
from carom.solvers.run import Progress, Start
from carom.support.escaping import format_value

#: Number of events that one call of the compiled code processes, in about a tenth of a second. Between calls, the run
#: reports progress and reacts to Ctrl-C.
_EVENTS = 100_000
#: How a call of the compiled code ended: the values of `Ending` of pic/state.h.
_DONE, _LIMIT, _STANDSTILL, _PAUSE, _, _GLIDES, _CRUSHED, _, _AT_REST, _PRESSED, _CORNER, _EDGE = range(12)
_OUTCOMES = {
    _DONE: Outcome.COMPLETED,
    _LIMIT: Outcome.MAX_IMPACTS,
    _STANDSTILL: Outcome.STANDSTILL,
    _GLIDES: Outcome.GLIDES,
    _CRUSHED: Outcome.CRUSHED,
    _AT_REST: Outcome.AT_REST,
    _PRESSED: Outcome.PRESSED,
    _CORNER: Outcome.CORNER,
    _EDGE: Outcome.EDGE,
}
_SHOWN = ("impacts", "wall_impacts", "predictions", "stale", "crossings", "beyond", "choices", "epochs")


class RunState(NamedTuple):
    """State of a run without the recorded impacts. A run of the same discs and walls can be resumed from this state."""

    kernel: Mapping[str, Any]  # see `Kernel.state` in pic.pyx
    time_s: float
    reached: tuple[float, float]
    fixed: Mapping[str, Any]  # constants of the run by name, without radii and masses, which are in `kernel`
    ended: Outcome | None  # outcome of a run that an impact has ended, else None
    notes: tuple[str, ...]


class EventDrivenRun:
    """A PIC run that can be advanced in any number of pieces, without an effect on the result.

    The class implements `carom.solvers.run.Run`. With gravity, discs can slide, roll and rest on straight walls. Any
    other lasting contact ends the run: see `carom.model.trace.Outcome` and `notes`.

    Args:
        start: A scene, or discs and walls as arrays.
        record: "all" or "none": which impacts to record. `impacts_per_disc` counts impacts in both cases.
        window_s: Start and end, in seconds, of the time in which impacts are recorded.
        contact_duration_s: Contact time of the TC model (Luding & McNamara, Granular Matter 1 (1998) 113). If a disc
            has two impacts within this time, the second impact loses no energy and has no friction. The model prevents
            inelastic collapse, an endless series of impacts in a finite time. 0 turns the model off.
        resume: State of an earlier run from which to continue. Positions, velocities and spins are taken from the
            state. All other data of discs and walls, and the contact time, must be the same.
        cell_factor: Factor that multiplies the width of the cells in which near discs are searched, at least 1;
            infinity for a single cell. With the factor 1, a run with few discs uses no cells. The factor does not
            change results.
        all_pairs: Whether to predict the impacts of all pairs again at each event, without cells or queue. This choice
            does not change results.

    Raises:
        InputError: The scene has damping. A contact time is given for a scene with gravity or with a table that slows
            discs. The walls have too many sides and vertices. Discs given as arrays overlap. An option is outside its
            range. `resume` belongs to a run with other discs, walls or coefficients; the message names the difference.

    Examples:
        >>> run = carom.EventDrivenRun(carom.scene("classics/gas"))
        >>> run.advance_to(0.5).name, run.time_s, run.counts["impacts"]
        ('COMPLETED', 0.5, 26)
    """

    def __init__(
        self,
        start: Start | DiscArrays,
        *,
        record: str = "all",
        window_s: tuple[float, float] = ALWAYS,
        contact_duration_s: float = 0.0,
        resume: RunState | None = None,
        cell_factor: float = 1.0,
        all_pairs: bool = False,
    ) -> None:
        self.options = RunOptions.of(record, window_s, contact_duration_s)
        duration_s, accelerated_scene, accelerations = 0.0, None, None
        if not isinstance(start, DiscArrays):
            if not hasattr(start, "arrays"):
                raise InputError(
                    f"start must be a Scene or DiscArrays, got {format_value(start)}",
                    hints=["carom.scene returns a scene of the catalogue by its name"],
                )
            if damping_per_s := getattr(start, "damping_per_s", 0.0):
                raise InputError(
                    f"damping_per_s is {damping_per_s}: EventDrivenRun does not support damping; solve_pic does"
                )
            duration_s = start.duration_s
            if start.table_deceleration_m_s2 or start.gravity_m_s2 != (0.0, 0.0):
                accelerated_scene = start
                accelerations = start.gravity_m_s2, start.table_deceleration_m_s2, start.wall_rolling_resistance
            start = start.arrays
            if not start.is_ordinary:
                start.require_ordinary()
        elif resume is None:
            require_apart(start)
        if accelerations is not None and self.options.contact_duration_s:
            raise InputError(
                "contact_duration_s must be 0 with gravity or a table that slows discs down, "
                f"got {self.options.contact_duration_s}"
            )
        if not cell_factor >= 1:
            raise InputError(f"cell_factor must be at least 1, got {cell_factor}")
        self.time_s = 0.0
        self.notes: tuple[str, ...] = ()
        from carom.core import pic

        obstacles = _build_obstacles(start, accelerated=accelerated_scene is not None)
        contact_s, standstill = self.options.contact_duration_s, compute_standstill_limit(len(start) + len(start.walls))
        self._kernel = pic.Kernel(
            start, obstacles, duration_s, accelerated_scene, contact_s, standstill, cell_factor, all_pairs
        )
        self._ended: Outcome | None = None
        self._reached: tuple[float, float] = (0.0, 0.0)  # the reached time as two floats, see double_double.h
        self._obstacles = obstacles
        self._fixed = _build_constants(start, contact_s) | {"acceleration": accelerations}
        if self.options.record == "all":
            self._kernel.record(*self.options.window_s)
        edges_of = None if obstacles is None or start.has_half_planes else obstacles.to_edges
        self.log = RecordedImpacts(self._kernel, start.turns, edges_of)
        if resume is not None:
            _require_same(resume, self._fixed, self._kernel.discs)
            self._kernel.resume(resume.kernel)
            self.time_s, self._reached = resume.time_s, resume.reached
            self._ended, self.notes = resume.ended, resume.notes

    def advance_to(self, time_s: float, max_impacts: int | None = None, progress: Progress | None = None) -> Outcome:
        """Apply every impact up to and including `time_s`, or stop after `max_impacts` impacts in all.

        Raises:
            InputError: `time_s` is NaN, or `max_impacts` is not a whole number of 0 or more. Two discs meet so far from
                the origin that floats can't distinguish their centres.
        """
        require_goal(time_s, max_impacts)
        if self._ended is not None:
            return self._ended
        ended = _PAUSE
        while ended == _PAUSE:  # between calls, Python reacts to Ctrl-C
            ended = self._kernel.run(time_s, NO_LIMIT if max_impacts is None else max_impacts, _EVENTS)
            if progress is not None:
                progress(self.impacts, self._kernel.clock["reported"])
        return self._settle(ended, time_s)

    def observe_steps(
        self,
        first: int,
        step_s: float,
        position_m: NDArray[np.float64],
        velocity_m_s: NDArray[np.float64],
        spin_rad_s: NDArray[np.float64],
    ) -> tuple[int, bool]:
        """Advance step by step, and write the state after each step, until a step has a recorded impact.

        Step k ends at ``k * step_s``. The number of the first step is `first`.

        Returns:
            The number of states written, and whether the last step had an impact or filled the arrays. Otherwise the
            next step was not finished, because the run ends in that step or the step has too many events. In this case,
            call `advance_to` for the unfinished step.
        """
        if self._ended is not None:
            return 0, False
        steps, ended = self._kernel.run_steps(first, step_s, NO_LIMIT, _EVENTS, position_m, velocity_m_s, spin_rad_s)
        is_complete = ended == _DONE
        if ended != _PAUSE:
            self._settle(ended, (first + steps - is_complete) * step_s)
        return steps, is_complete

    def _settle(self, ended: int, time_s: float) -> Outcome:
        """Set the reached time and the notes after the core has stopped, and return the outcome."""
        clock = self._kernel.clock
        has_completed = ended == _DONE and time_s < math.inf
        reached_s = time_s if has_completed else clock["reported"]
        self.time_s = max(self.time_s, reached_s)
        if self._fixed["acceleration"] is None:
            self._reached = (float((self.time_s - clock["epoch"]) - clock["epoch_rest"]), 0.0)
        else:
            clock_time = (clock["now"], clock["now_low"])
            self._reached = max(self._reached, clock_time, (time_s, 0.0) if has_completed else clock_time)
        if ended not in (_DONE, _LIMIT, _STANDSTILL) or (ended == _STANDSTILL and self._fixed["acceleration"]):
            self._ended = _OUTCOMES[ended]
            self.notes = (self._format_note(ended, reached_s),)
        return _OUTCOMES[ended]

    def _format_note(self, ended: int, reached_s: float) -> str:
        """Return a text that says why an impact or contact ended the run."""
        if ended == _CRUSHED:
            crush = self._kernel.crush
            one, other = map(body_name, crush["between"])
            return f"disc {crush['disc']} is crushed between {one} and {other} at {crush['time']:.17g} s"
        if ended == _GLIDES:
            disc, wall = self._kernel.gliding
            return f"disc {disc} glides along wall {wall} from {reached_s:.17g} s on"
        if ended == _STANDSTILL:
            return "impacts follow each other faster than floats can resolve"
        return self._format_contact_note(ended, **self._kernel.contact_end)

    def _format_contact_note(
        self, ended: int, disc: int, other: int, obstacle: int, held_by: int, after_bounces: bool
    ) -> str:
        """Return a text that says why a contact ended the run; see `ContactEnd` in accelerated_state.h."""
        why = ", after infinitely many impacts" if after_bounces else ""
        if ended == _EDGE:
            wall = body_name(other)
            return f"disc {disc} reaches the end of a straight edge of {wall} and does not fly off"
        if ended == _PRESSED:
            return f"disc {disc} stays in touch with {body_name(other)}{why}"
        if ended == _CORNER and self._obstacles is not None:
            if obstacle == NO_OBSTACLE:
                names = f"{self._obstacles.format_name(held_by)} and {body_name(other)}"
            else:
                names = self._obstacles.format_names(held_by, obstacle)
            return f"disc {disc} is wedged between {names}{why}"
        return f"disc {disc} {'comes to rest' if after_bounces else 'rests'} on {body_name(other)}{why}"

    def positions(self) -> NDArray[np.float64]:
        """Return the current centres, in metres, shape ``(n, 2)``."""
        return self._kernel.states(*self._reached)[:, :2].copy()

    def velocities(self) -> NDArray[np.float64]:
        """Return the current velocities, in m/s, shape ``(n, 2)``."""
        return self._kernel.states(*self._reached)[:, 2:].copy()

    def spins(self) -> NDArray[np.float64] | None:
        """Return the current spins, in rad/s; None if no disc turns."""
        return self._kernel.spins_at(*self._reached)

    def impacts_per_disc(self) -> NDArray[np.int64]:
        """Return the number of impacts of each disc, shape ``(n,)``."""
        return self._kernel.impact_counts

    def state(self) -> RunState:
        """Return a copy of the run's state, from which a run can be resumed later."""
        return RunState(self._kernel.state(), self.time_s, self._reached, self._fixed, self._ended, self.notes)

    @property
    def impacts(self) -> int:
        """Number of impacts so far, whether recorded or not."""
        return self._kernel.counts["impacts"]

    @property
    def counts(self) -> dict[str, int]:
        """Numbers of operations so far, by name, such as impacts, predictions and changes of the cell grid."""
        counts = self._kernel.counts
        return {name: counts[name] for name in _SHOWN}

    @property
    def bytes_per_disc(self) -> float:
        """Memory of the run in bytes, divided by the number of discs. Recorded impacts are not included."""
        return self._kernel.nbytes / len(self._kernel.discs)


def compute_standstill_limit(bodies: int) -> int:
    """Return the largest allowed number of impacts at one instant. After more impacts, time is assumed to stand still.

    The limit must be larger than any finite number of impacts at one instant. For n equal discs that touch in a line,
    the number of impacts is at most ``n (n - 1) / 2``. Two discs in front of a wall have 31 impacts if the ratio of
    their masses is 100, and 314 impacts if it is 10,000. For few bodies, the limit is a hundred times the square of
    their number, so that a run ends within milliseconds. For many bodies, the limit is ten million more than half the
    square of their number, so that a run ends within seconds.
    """
    return min(100 * bodies**2, 10_000_000 + bodies**2 // 2)


def _build_obstacles(start: DiscArrays, *, accelerated: bool) -> Obstacles | None:
    """Return the sides and vertices of walls; None if all are half-planes that need no further data."""
    obstacles = None if start.has_plain_walls and not (start.driven or accelerated) else Obstacles(start)
    if (count := len(start.walls if obstacles is None else obstacles.rows)) > MOST_OBSTACLES:
        raise InputError(f"walls must have at most {MOST_OBSTACLES} sides and vertices in all, got {count}")
    return obstacles


#: Names of coefficients that must be equal when a run is resumed.
_LAW = (
    *("restitution", "wall_restitution", "wall_materials"),
    *("friction", "wall_friction", "tangential_restitution", "wall_tangential_restitution"),
    *("wall_drives", "belts_m_s", "driven_discs", "disc_drives"),
)


def _build_constants(start: DiscArrays, contact_duration_s: float) -> dict[str, Any]:
    """Return the constants of a run by name, except for radii and masses, which the compiled code stores."""
    law = {name: getattr(start, name) for name in _LAW}
    inertia = start.inertia.copy() if start.turns else None
    return {"inertia_factor": inertia, "walls": start.walls, **law, "contact_duration_s": contact_duration_s}


def _require_same(state: RunState, fixed: Mapping[str, Any], discs: NDArray[np.void]) -> None:
    """Raise InputError if a state belongs to a run with other discs, walls or coefficients."""
    if not isinstance(state, RunState):
        raise InputError(f"resume must be what EventDrivenRun.state() returns, got {format_value(state)}")
    theirs = state.kernel["discs"].view(discs.dtype)
    if len(theirs) != len(discs):
        raise InputError(f"resume must be the state of a run of {len(discs)} discs, got a state of {len(theirs)}")
    for name, field in (("radius_m", "radius"), ("mass_kg", "inverse_mass")):
        _require_equal(name, discs[field], theirs[field])
    for name, value in fixed.items():
        other = state.fixed[name]
        if (value is None) != (other is None):  # only moments of inertia may be None, in a run without spins
            has, got = ("with", "without") if other is None else ("without", "with")
            raise InputError(
                f"resume must be the state of a run {has} friction or spin, like this run, got a state {got}"
            )
        if isinstance(value, np.ndarray):
            _require_equal(name, value, other)
        elif value != other:
            difference = f"{format_value(value)}, got {format_value(other)}"
            raise InputError(f"resume must be the state of a run of the same {name}: {difference}")


def _require_equal(name: str, values: NDArray[np.float64], other_values: NDArray[np.float64]) -> None:
    differ = np.flatnonzero(values != other_values)
    if len(differ):
        raise InputError(
            f"resume must be the state of a run of the same {name}: disc {differ[0]} differs, "
            f"and {len(differ) - 1} other discs"
        )
