"""What became of every step of a run: its windows, in which bodies meet, and what happened outside of them.

`carom.comparator.stepwise` says what a window is, and finds them; a trace carries what was found.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: One window: some steps of some bodies, compared with PIC from their own state at its start. Velocities are in metres
#: a second, those of rims (spin times radius) too; NaN where a number was not asked for.
#:
#: - begin_s, end_s: the first and the last of its states.
#: - due: impacts of PIC that the run has come to. missed: pairs that passed through each other. pit_missed: how many of
#:   these PIT misses, too, from the same state at the same phase.
#: - entangled: several pairs or impacts, or begun in overlap, so that nobody owes one answer. turned: bodies turned
#:   though nothing was due. open: the run ended in it.
#: - late_steps: how much later than PIC the paths turned. late_known: to what part of a step that is known.
#:   late_allowed: how late checking once per step is at worst.
#: - velocity, spin, place_m: the largest difference from PIC at its end. speed, rim: the greatest of its own bodies, to
#:   which these round. place_known_m: what rounding makes of its places.
#: - price_velocity, price_spin: what PIT pays at worst from the same state.
#: - restitution: effective less the scene's.
#: - energy_j: gained against PIC. energy_price_j: by PIT at worst.
WINDOW_DTYPE = np.dtype(
    [
        ("begin_s", "f8"),
        ("end_s", "f8"),
        ("due", "i8"),
        ("missed", "i8"),
        ("pit_missed", "i8"),
        ("entangled", "?"),
        ("turned", "?"),
        ("open", "?"),
        ("late_steps", "f8"),
        ("late_known", "f8"),
        ("late_allowed", "f8"),
        ("velocity", "f8"),
        ("speed", "f8"),
        ("spin", "f8"),
        ("rim", "f8"),
        ("place_m", "f8"),
        ("place_known_m", "f8"),
        ("price_velocity", "f8"),
        ("price_spin", "f8"),
        ("restitution", "f8"),
        ("energy_j", "f8"),
        ("energy_price_j", "f8"),
    ]
)

#: One pair of a window: which window, its bodies (a wall is `carom.model.trace.wall_body`), its steps' first and last
#: state, when it was due (NaN where it only pushed), and whether it was missed, by the run and by PIT from the same
#: state.
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

#: What happened to a disc in a step outside of any window: when that began, by how much its velocity and its rim
#: changed (metres a second), by how much it moved other than by its velocity (metres), its own speed, and what rounding
#: makes of its place.
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

#: Steps in a row in which two bodies rest on each other, and a push shows: their first and last state.
REST_DTYPE = np.dtype([("first", "i8"), ("second", "i8"), ("begin_s", "f8"), ("end_s", "f8")])


@dataclass(frozen=True)
class States:
    """The states of a run at boundaries: an engine's steps, or the pieces of a located one.

    Attributes:
        time_s: Shape ``(k,)``, seconds, increasing.
        position_m: Shape ``(k, n, 2)``, metres.
        velocity_m_s: Shape ``(k, n, 2)``, metres a second.
        spin_rad_s: Shape ``(k, n)``, radians a second; None in a scene in which no disc spins.
    """

    time_s: Array
    position_m: Array
    velocity_m_s: Array
    spin_rad_s: Array | None = None

    def __len__(self) -> int:
        return len(self.time_s)

    def part(self, rows: slice | NDArray[Any]) -> States:
        """Return some of the states, by their numbers."""
        spins = None if self.spin_rad_s is None else self.spin_rad_s[rows]
        return States(self.time_s[rows], self.position_m[rows], self.velocity_m_s[rows], spins)

    @classmethod
    def joined(cls, parts: Sequence[States]) -> States:
        """Return the states of several parts, all with spins or all without."""
        if len(parts) == 1:
            return parts[0]
        names = [field.name for field in fields(cls) if getattr(parts[0], field.name) is not None]
        return cls(**{name: np.concatenate([getattr(part, name) for part in parts]) for name in names})


@dataclass(frozen=True)
class LocalTruth:
    """All steps of a run, each compared with PIC from the run's own state at its start.

    Attributes:
        until_s: Time of the last state that was looked at.
        steps: Steps, or pieces of steps, that were looked at.
        windows: Structured array of `WINDOW_DTYPE`, in order of their beginnings.
        meetings: Structured array of `MEETING_DTYPE`, the pairs of the windows.
        slips: Structured array of `SLIP_DTYPE`: the largest change of velocity, of spin and of place of each disc
            outside of windows and of rest; a disc has one row a kind at most, and none where it flew free.
        ahead: How many turns outside of windows answer a meeting that lies ahead, by a margin of length.
        slip_counts: In how many steps of discs velocity or spin changed, and in how many the place did.
        resting_steps: In how many steps of discs a pair rested.
        sunk_radii: The deepest that a resting pair sank, over its contact distance; 0 where none did.
        sinks_s: When a pair first sank by more in a step than falling for that step explains; NaN where none did.
        polygon: Whether paths under gravity are polygons, each step off by up to half of what a step's fall is; or
            those of damped discs, by up to half of what a step's damping takes of the speed, times the step.
        rests: Structured array of `REST_DTYPE`: when states show which pairs held up at rest, by pushes that are in no
            window; None in a journal that was written before this was kept.
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
    rests: NDArray[np.void] | None = None

    def before(self, time_s: float) -> LocalTruth:
        """Return what is known of windows that end, and of turns that come, and of rest that begins, by a time."""
        return replace(
            self,
            until_s=min(self.until_s, time_s),
            windows=self.windows[self.windows["end_s"] <= time_s],
            meetings=self.meetings[self.meetings["end_s"] <= time_s],
            slips=self.slips[self.slips["time_s"] <= time_s],
            rests=None if self.rests is None else self.rests[self.rests["begin_s"] <= time_s],
        )
