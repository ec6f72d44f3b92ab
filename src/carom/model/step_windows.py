"""Data types of the stepwise comparison: each step of a run is compared with PIC from the same state.

A window is a series of successive steps in which a few bodies meet. `carom.comparator.stepwise` finds the windows, and
a trace stores the results.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from carom.support.structured_arrays import build_dtype

Array = NDArray[np.float64]


@dataclass(eq=False)
class WindowRow:
    """Comparison of one window with PIC, which starts from the engine's state at the beginning of the window.

    Velocities and rim speeds (spin times radius) are in m/s. A number that was not requested is NaN.

    Attributes:
        begin_s: Time of the first state in the window.
        end_s: Time of the last state in the window.
        due: Number of impacts that PIC finds in the window.
        missed: Number of pairs of bodies that passed through each other.
        pit_missed: Number of the missed pairs that PIT also misses from the same state at the same phase.
        entangled: Whether the window has no unique answer, because of several pairs or impacts, or an initial overlap.
        turned: Whether bodies changed direction although PIC finds no impact.
        open: Whether the run ended before the end of the window.
        late_steps: Delay of the engine's change of direction, compared with PIC's, in steps.
        late_known: Uncertainty of `late_steps`.
        late_allowed: Greatest delay that checking once per step can cause, in steps.
        velocity: Largest difference of a velocity from PIC's velocity when the window ends.
        speed: Greatest speed of the window's bodies. Rounding errors of velocities are proportional to this speed.
        spin: Largest difference of a rim speed from PIC's rim speed when the window ends.
        rim: Greatest speed or rim speed of the window's bodies. Rounding errors of rim speeds are proportional to this
            value.
        place_m: Largest difference of a position from PIC's position when the window ends.
        place_known_m: Uncertainty of `place_m` because positions are rounded.
        price_velocity: Largest velocity error of PIT, which starts from the same state.
        price_spin: Largest rim speed error of PIT, which starts from the same state.
        restitution: Restitution computed from the engine's velocities, minus the scene's restitution.
        energy_j: Energy of the engine's discs minus the energy of PIC's discs when the window ends, in joules.
        energy_price_j: Largest energy that PIT's discs gain from the same state, in joules.
    """

    begin_s: float
    end_s: float
    due: int = 0
    missed: int = 0
    pit_missed: int = 0
    entangled: bool = False
    turned: bool = False
    open: bool = False
    late_steps: float = math.nan
    late_known: float = 0.0
    late_allowed: float = 1.0
    velocity: float = 0.0
    speed: float = 0.0
    spin: float = 0.0
    rim: float = 0.0
    place_m: float = 0.0
    place_known_m: float = 0.0
    price_velocity: float = math.nan
    price_spin: float = math.nan
    restitution: float = math.nan
    energy_j: float = 0.0
    energy_price_j: float = 0.0


#: One window, see `WindowRow`.
WINDOW_DTYPE = build_dtype(WindowRow)

#: One pair of bodies that meet in a window: the window's index, the numbers of the bodies, and the times of the first
#: and last state of the steps in which they meet. The last fields are the time of PIC's impact (NaN if PIC finds none),
#: whether the run missed the impact, and whether PIT missed the impact from the same state.
MEETING_DTYPE = np.dtype(
    [
        ("window", "i8"),
        ("first", "i8"),
        ("second", "i8"),
        ("begin_s", "f8"),
        ("end_s", "f8"),
        ("due_s", "f8"),
        ("missed", "?"),
        ("pit_missed", "?"),
    ]
)

#: An unexplained change of a disc's motion in a step in which the disc meets no other body. The fields are the start of
#: the step, the changes of velocity and rim speed (m/s), the displacement that the velocity does not explain (metres),
#: the disc's speed, and the rounding error of its position.
SLIP_DTYPE = np.dtype(
    [
        ("time_s", "f8"),
        ("disc", "i8"),
        ("velocity", "f8"),
        ("rim", "f8"),
        ("moved_m", "f8"),
        ("speed", "f8"),
        ("place_known_m", "f8"),
    ]
)

#: Successive steps in which two bodies rest on each other, and the contact changes their velocities. The fields are the
#: numbers of the bodies, and the times of the first and the last state.
REST_DTYPE = np.dtype([("first", "i8"), ("second", "i8"), ("begin_s", "f8"), ("end_s", "f8")])


@dataclass(frozen=True, eq=False)
class States:
    """States of a run at the ends of steps. With the profile `located`, the states are at the ends of parts of steps.

    Attributes:
        time_s: Shape ``(k,)``, in seconds, increasing.
        position_m: Shape ``(k, n, 2)``, in metres.
        velocity_m_s: Shape ``(k, n, 2)``, in m/s.
        spin_rad_s: Shape ``(k, n)``, in rad/s; None if no disc of the scene spins.
    """

    time_s: Array
    position_m: Array
    velocity_m_s: Array
    spin_rad_s: Array | None = None

    def __len__(self) -> int:
        return len(self.time_s)

    @property
    def spins(self) -> Array:
        """Spins of all discs, shape ``(k, n)``, in rad/s; 0 if no disc of the scene spins."""
        return np.zeros(self.position_m.shape[:2]) if self.spin_rad_s is None else self.spin_rad_s

    def select_rows(self, rows: slice | NDArray[Any]) -> States:
        """Return the states with the given row numbers."""
        spins = None if self.spin_rad_s is None else self.spin_rad_s[rows]
        return States(self.time_s[rows], self.position_m[rows], self.velocity_m_s[rows], spins)

    @classmethod
    def joined(cls, parts: Sequence[States]) -> States:
        """Join the states of several parts of a run. Either all parts must have spins, or none."""
        names = [field.name for field in fields(cls) if getattr(parts[0], field.name) is not None]
        return cls(**{name: np.concatenate([getattr(part, name) for part in parts]) for name in names})


@dataclass(frozen=True, eq=False)
class LocalTruth:
    """Comparison of all steps of a run with PIC. PIC starts from the run's own state before each step.

    Attributes:
        until_s: Time of the last state that was compared.
        steps: Number of compared steps. With the profile `located`, parts of steps are counted.
        windows: Structured array of `WINDOW_DTYPE`, in order of start times.
        meetings: Structured array of `MEETING_DTYPE`, the pairs that meet in the windows.
        slips: Structured array of `SLIP_DTYPE`: for each disc, the largest unexplained changes of velocity, spin and
            position while the disc neither met another body nor rested. A disc that moved freely has no row.
        ahead: Number of velocity changes, outside of windows, that are due to a contact margin: the engine reacted just
            before the pair met.
        slip_counts: Two numbers of steps, each summed over all discs: steps with an unexplained change of velocity or
            spin, and steps with an unexplained change of position.
        resting_steps: Number of steps in which a disc belonged to a resting pair, summed over all discs.
        sunk_radii: Largest depth to which a resting body sank into another body, divided by the contact distance: from
            centre to centre, or from centre to wall; 0 if no body sank.
        sinks_s: First time at which a step increased the overlap of a pair by more than free fall does. NaN if free
            fall explains all overlaps.
        polygon: Whether the method moves discs straight in each step, so that curved paths become polygons. The error
            of a position is then up to half of the acceleration or deceleration times the squared step size.
        rests: Structured array of `REST_DTYPE`: steps outside of windows. In each of these steps, a pair rests and its
            contact changes velocities.
        invented: Number of steps, summed over all discs, in which a velocity or rim speed changed without a cause, by
            more than 1 % of the disc's speed. Steps in which the disc meets a body are not counted.
        first_invented_s: Time of the first step that `invented` counts; NaN if there is none.
        first_inventor: Disc that changed in this first step; -1 if there is none.
    """

    until_s: float
    steps: int
    windows: NDArray[np.void]
    meetings: NDArray[np.void]
    slips: NDArray[np.void]
    ahead: int
    slip_counts: tuple[int, int]
    resting_steps: int
    sunk_radii: float
    sinks_s: float
    polygon: bool
    rests: NDArray[np.void]
    invented: int
    first_invented_s: float
    first_inventor: int

    def clip_to(self, time_s: float) -> LocalTruth:
        """Return the part of the comparison that concerns the run up to a time.

        Numbers of steps remain those of the whole run, except that `invented` is 0 if `first_invented_s` is after this
        time.
        """
        has_invented = self.first_invented_s <= time_s
        return replace(
            self,
            until_s=min(self.until_s, time_s),
            windows=self.windows[self.windows["end_s"] <= time_s],
            meetings=self.meetings[self.meetings["end_s"] <= time_s],
            slips=self.slips[self.slips["time_s"] <= time_s],
            rests=self.rests[self.rests["begin_s"] <= time_s],
            invented=self.invented if has_invented else 0,
            first_invented_s=self.first_invented_s if has_invented else math.nan,
            first_inventor=self.first_inventor if has_invented else -1,
        )
