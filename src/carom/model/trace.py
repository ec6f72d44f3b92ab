"""Trace: the result of one run of a method on a scene, with impacts, final state, outcome and settings."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import Enum, IntEnum
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from carom.support.display import Tabular
from carom.support.equality import ByValue
from carom.support.structured_arrays import build_dtype

if TYPE_CHECKING:
    from carom.model.scene import Scene
    from carom.model.step_windows import LocalTruth, States

#: Type of the value of a setting.
Setting = float | int | bool | str


def format_setting(value: Setting) -> str:
    """Return the text of a setting. The option ``--set`` reads the text back as the same value."""
    return str(value).lower() if isinstance(value, bool) else str(value)


#: Other names for the profiles of PIC and PIT. With these names, users can request one profile name for all methods.
PROFILE_ALIASES: Mapping[str, Mapping[str, str]] = {
    "pic": {"default": "frame-by-frame", "tuned": "event-driven"},
    "pit": {"default": "tuned"},
}


def resolve_profile(method: str, profile: str) -> str:
    """Return the name of a method's profile, given this name or one of its aliases."""
    return PROFILE_ALIASES.get(method, {}).get(profile, profile)


def format_profile(method: str, profile: str, overrides: Mapping[str, Setting]) -> str:
    """Return the text for a profile: its name and the changed settings. PIT's only profile is not named."""
    profile_name = "" if method == "pit" else resolve_profile(method, profile)
    values = ", ".join(f"{name}={format_setting(value)}" for name, value in overrides.items())
    return f"{profile_name} with {values}".lstrip() if values else profile_name


#: Spins of an impact's two bodies just before and just after the impact, in rad/s, counterclockwise.
#: Walls have spin 0.
SPIN_DTYPE = np.dtype([("first_before", "f8"), ("second_before", "f8"), ("first_after", "f8"), ("second_after", "f8")])

#: Edge of a finite wall that a disc hit: the edge's number in the wall (-1 if no edge was hit), and the `EdgeKind`.
EDGE_DTYPE = np.dtype([("edge", "i8"), ("kind", "i8")])

#: A time before an impact, and the positions of the impact's two bodies at that time. Unknown positions and positions
#: of walls are NaN.
STATE_DTYPE = np.dtype([("time_s", "f8"), ("position_first", "f8", 2), ("position_second", "f8", 2)])

Vector = tuple[float, float]


class EdgeKind(IntEnum):
    """Part of a finite wall's edge that a disc hit."""

    FACE = 0
    VERTEX = 1
    ARC = 2


class Mode(IntEnum):
    """How a disc moves under gravity: in flight, or in lasting contact with a wall.

    In the mode `BLOCK`, a disc slides, and rolling resistance keeps it from turning.

    Examples:
        >>> [mode.name for mode in carom.Mode]
        ['FLIGHT', 'SLIDE', 'ROLL', 'REST', 'BLOCK']
    """

    FLIGHT = 0
    SLIDE = 1
    ROLL = 2
    REST = 3
    BLOCK = 4


#: Value for an impact that is not on an edge: an impact between two discs, or with a half-plane.
NO_EDGE = (-1, -1)


class ImpactRecord(NamedTuple):
    """One impact of `Trace.impacts`, `Trace.spins` and `Trace.edges`. Times are in s, speeds in m/s, spins in rad/s."""

    time_s: float
    first: int
    second: int
    normal: Vector
    velocity_first_before: Vector
    velocity_second_before: Vector
    velocity_first_after: Vector
    velocity_second_after: Vector
    spins: tuple[float, float, float, float] | None = None  # in the order of `SPIN_DTYPE`; None if no disc turns
    edge: tuple[int, int] = NO_EDGE  # in the order of `EDGE_DTYPE`


class ModeRecord(NamedTuple):
    """One row of `Trace.modes`, in the order of `MODE_DTYPE`. Times are in s, lengths in m, angles in rad."""

    time_s: float
    impacts: int
    disc: int
    wall: int
    before: Mode
    after: Mode
    position: Vector
    velocity: Vector
    acceleration: Vector
    spin: float
    spin_rate: float


#: One impact. The second body may be a wall, with a negative number as in `wall_body`. The unit vector `normal` points
#: from the first body to the second.
IMPACT_DTYPE = build_dtype(ImpactRecord, omitted=("spins", "edge"))

#: A change of a disc's `Mode`, and the disc's state at this instant. `wall` is the body number of the wall, and
#: `impacts` is the number of earlier impacts in the trace. The acceleration is constant until the next change of mode.
MODE_DTYPE = build_dtype(ModeRecord)

_COLUMNS = len(IMPACT_DTYPE.names or ())


def build_impact_array(records: Iterable[ImpactRecord]) -> NDArray[np.void]:
    """Return impact records as a read-only structured array of `IMPACT_DTYPE`."""
    return _build_read_only([record[:_COLUMNS] for record in records], IMPACT_DTYPE)


def build_spin_array(records: Iterable[ImpactRecord]) -> NDArray[np.void]:
    """Return the spins of impact records as a read-only structured array of `SPIN_DTYPE`. No record may lack spins."""
    return _build_read_only([record.spins for record in records], SPIN_DTYPE)


def build_edge_array(records: Iterable[ImpactRecord]) -> NDArray[np.void]:
    """Return the edges of impact records as a read-only structured array of `EDGE_DTYPE`."""
    return _build_read_only([record.edge for record in records], EDGE_DTYPE)


def build_mode_array(records: Iterable[ModeRecord]) -> NDArray[np.void]:
    """Return mode records as a read-only structured array of `MODE_DTYPE`."""
    return _build_read_only(list(records), MODE_DTYPE)


def _build_read_only(rows: list[Any], dtype: np.dtype[np.void]) -> NDArray[np.void]:
    array = np.array(rows, dtype=dtype)
    array.flags.writeable = False
    return array


def wall_body(wall: int) -> int:
    """Return the body number ``-1 - k`` of wall k. Discs have the body numbers 0, 1, 2, ..."""
    return -1 - wall


def wall_index(body: int) -> int:
    """Return the index of a wall from its body number: the inverse of `wall_body`."""
    return -1 - body


def body_name(body: int) -> str:
    """Return the name of a body, such as "disc 0" or "wall 2"."""
    return f"disc {body}" if body >= 0 else f"wall {wall_index(body)}"


def pair_name(impact: np.void) -> str:
    """Return the names of an impact's two bodies."""
    return f"{body_name(int(impact['first']))} and {body_name(int(impact['second']))}"


def velocities(impacts: NDArray[np.void], moment: Literal["before", "after"]) -> NDArray[np.float64]:
    """Return the velocities of both bodies of each impact, shape ``(2, m, 2)``: first bodies, then second bodies."""
    return np.array([impacts[f"velocity_first_{moment}"], impacts[f"velocity_second_{moment}"]])


def rim_speeds(trace: Trace, moment: Literal["before", "after"]) -> NDArray[np.float64]:
    """Return the rim speeds ``R w`` of both bodies of each impact, shape ``(2, m)``: first bodies, then second bodies.

    Rim speeds are in m/s, positive if counterclockwise. Walls have rim speed 0. All rim speeds are 0 if
    the trace has no spins.
    """
    speeds = np.zeros((2, len(trace.impacts)))
    if trace.spins is not None:
        radius = np.append(trace.scene.arrays.radius_m, 0.0)  # the last radius, 0, is used for walls
        for row, side in zip(speeds, ("first", "second"), strict=True):
            row[:] = radius[np.maximum(trace.impacts[side], -1)] * trace.spins[f"{side}_{moment}"]
    return speeds


def turn_times(trace: Trace) -> NDArray[np.float64]:
    """Return for each impact the time at which the free paths before and after it meet.

    If they don't meet, or if the method has no steps, return the reported time.
    """
    reported: NDArray[np.float64] = trace.impacts["time_s"]
    effective = reported if trace.effective_time_s is None else trace.effective_time_s
    return np.where(np.isfinite(effective), effective, reported)


class Outcome(Enum):
    """How a run ended. The value of a member is a phrase for reports.

    Examples:
        >>> carom.solve_pic("classics/gas", max_impacts=3).outcome.name
        'MAX_IMPACTS'
    """

    COMPLETED = "ran to the end of the scene"
    MAX_IMPACTS = "stopped after the requested number of impacts"
    STANDSTILL = "time no longer advances: infinitely many impacts at one instant (inelastic collapse)"
    GLIDES = "a disc slides along the inside of a curved wall: contact lasts, and there are no more impacts"
    AT_REST = "a disc rests on a wall or an immovable disc, after infinitely many impacts or from the start"
    CRUSHED = "a disc is crushed between two walls that approach each other, after infinitely many impacts"
    PRESSED = "two discs stay in touch, pressed together: contact of discs is not solved"
    CORNER = "a disc touches two walls at once and stays there: contact in a corner is not solved"
    EDGE = "a disc reaches the end of a straight edge too slowly to fly off: its rotation about the end is not solved"
    WARNED = "the method warned that its state is not reliable"
    NON_FINITE = "a position or velocity is infinite or NaN"
    STOPPED = "stopped before the end of the scene: a limit was reached, or the next event could not be proven"

    @property
    def in_contact(self) -> bool:
        """Whether the run ended with a crushed disc, or with a lasting contact that Carom does not solve."""
        return self in _OF_DISC

    @property
    def of_disc(self) -> str:
        """What happens to the disc in a run that ended in lasting contact, as a phrase such as "comes to rest"."""
        return _OF_DISC[self]


_OF_DISC = {
    Outcome.AT_REST: "comes to rest",
    Outcome.CRUSHED: "is crushed between two walls",
    Outcome.GLIDES: "glides along a wall",
    Outcome.PRESSED: "stays in touch with another",
    Outcome.CORNER: "is held by two walls",
    Outcome.EDGE: "reaches the end of an edge",
}

_OF_MODE = {
    Mode.SLIDE: "slides along a wall",
    Mode.BLOCK: "slides along a wall",
    Mode.ROLL: "rolls along a wall",
    Mode.REST: "comes to rest",
    Mode.FLIGHT: "leaves a wall",
}


@dataclass(frozen=True, eq=False)
class Samples(ByValue):
    """Positions at some instants of a run, for drawing.

    Attributes:
        time_s: Shape ``(k,)``, in seconds.
        position_m: Shape ``(k, n, 2)``, in metres.
    """

    time_s: NDArray[np.float64]
    position_m: NDArray[np.float64]


@dataclass(frozen=True, repr=False, eq=False)
class Trace(ByValue, Tabular):
    """Result of one run of a method on a scene. Two traces are equal if all fields are equal, arrays bit by bit.

    Attributes:
        method: Name of the method or engine.
        scene: The scene that was run.
        impacts: Structured array of `IMPACT_DTYPE`, in order of reported time.
        final_position_m: Shape ``(n, 2)``, at `end_time_s`.
        final_velocity_m_s: Shape ``(n, 2)``, at `end_time_s`.
        end_time_s: Time at which the run ended: the scene's duration, or an earlier impact.
        outcome: How the run ended.
        dt_s: Step size (or time between frames), in seconds; 0 if the method takes no steps.
        effective_time_s: Shape ``(len(impacts),)``: the time at which the free paths before and after each impact meet;
            NaN if they don't meet. None if the method has no steps, because its reported times are then exact.
        state_before: Structured array of `STATE_DTYPE`, one entry per impact: the method's last state before the
            impact. None for a solver, because the impacts alone determine its paths.
        ambiguous: Indices of impacts that share a movable disc with an earlier impact at the same instant. The result
            depends on the order of such simultaneous impacts, which physics does not determine.
        samples: Positions for drawing, if requested.
        profile: Name of the profile; empty if a solver was called directly.
        overrides: Settings that the user requested instead of those of the profile.
        settings: The settings that were used, read back from the engine if possible.
        float_bits: Size of the floats with which the method computes, as declared by it: 32 or 64 bits.
        counts: Numbers of operations of the method, such as steps, tests of pairs and predictions.
        impacts_per_disc: Number of impacts of each disc, shape ``(n,)``. Impacts are counted even if `impacts` is not
            stored. None if the method does not count impacts.
        notes: Warnings of the method.
        spins: Structured array of `SPIN_DTYPE`, one entry per impact. None if no disc turns in the scene (see
            `carom.DiscArrays.turns`), or if the method does not report spins.
        edges: Structured array of `EDGE_DTYPE`, one entry per impact: the edge of a finite wall that was hit. None in a
            scene without finite walls, or if the method does not report edges.
        modes: Structured array of `MODE_DTYPE`, in order of time: the instants at which discs begin to slide, roll or
            rest on a wall, or leave the wall. None if there is no lasting contact, or if the method does not report it.
        final_spin_rad_s: Spins at `end_time_s`, shape ``(n,)``; None if `spins` is None.
        local_truth: Comparison of every step with PIC, which starts from the method's own state before the step. None
            if no comparison was requested.
        observed_states: States of all discs after some steps, which show whether discs are at rest. None if the scene
            has many discs, or if none of its discs can come to rest.

    Examples:
        >>> trace = carom.solve_pic("paper/missed")
        >>> trace.impacts["velocity_first_after"].round(2).tolist()
        [[2.16, -5.37]]
    """

    method: str
    scene: Scene
    impacts: NDArray[np.void]
    final_position_m: NDArray[np.float64]
    final_velocity_m_s: NDArray[np.float64]
    end_time_s: float
    outcome: Outcome = Outcome.COMPLETED
    dt_s: float = 0.0
    effective_time_s: NDArray[np.float64] | None = None
    state_before: NDArray[np.void] | None = None
    ambiguous: tuple[int, ...] = ()
    samples: Samples | None = None
    profile: str = ""
    overrides: Mapping[str, Setting] = field(default_factory=dict)
    settings: Mapping[str, Setting] = field(default_factory=dict)
    float_bits: int = 64
    counts: Mapping[str, int] = field(default_factory=dict)
    impacts_per_disc: NDArray[np.int64] | None = None
    notes: tuple[str, ...] = ()
    spins: NDArray[np.void] | None = None
    edges: NDArray[np.void] | None = None
    modes: NDArray[np.void] | None = None
    final_spin_rad_s: NDArray[np.float64] | None = None
    local_truth: LocalTruth | None = None
    observed_states: States | None = None

    @property
    def profile_shown(self) -> str:
        """The name of the profile, with the settings that were changed."""
        return format_profile(self.method, self.profile, self.overrides)

    @property
    def contact_s(self) -> float:
        """Time at which the first lasting contact begins; infinity if there is none."""
        if self.modes is not None and len(self.modes):
            return float(self.modes["time_s"][0])
        return self.end_time_s if self.outcome.in_contact else math.inf

    @property
    def contact_of_disc(self) -> str:
        """What a disc does when the first lasting contact begins, as a phrase such as "rolls along a wall"."""
        if self.modes is not None and len(self.modes):
            return _OF_MODE[Mode(int(self.modes["after"][0]))]
        return self.outcome.of_disc
