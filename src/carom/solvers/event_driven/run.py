"""A PIC run that can be taken forward in pieces, watched, saved and taken up again."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from carom.disc_arrays import DiscArrays
from carom.errors import InputError
from carom.physics.compilation import compiler_installed, is_cached, is_translated
from carom.solvers.kept_impacts import KeptImpacts
from carom.solvers.kernel_state import KernelState, compiled_kernel, kernel_recipe
from carom.solvers.layout import (
    CROSSINGS,
    DONE,
    EPOCH,
    EPOCH_REST,
    EPOCHS,
    LIMIT,
    OWN_TIME,
    PREDICTIONS,
    READY,
    RECORD,
    RECORDED,
    REPORTED,
    ROW,
    STALE,
    STANDSTILL,
    TOTAL,
    VERSION,
    VX,
    VY,
    WALL_IMPACTS,
    X,
    Y,
)
from carom.trace import Outcome

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from carom.scene import Scene

    Progress = Callable[[int, float], None]

__all__ = ["EventDrivenRun", "RunState"]

#: Discs from which a run starts compiled: to predict each once takes plain Python 55 us (7.6 ms at 100 discs, 46 ms at
#: 800), so a thousand of them as long as loading the kernel does, .06 s (``python -m carom.bench.switch``).
COMPILED_FROM_DISCS = 1000
#: Impacts after which a run that began as plain Python goes over to the compiled kernel: where that need only be
#: loaded; where LLVM must make it of a translation that came with the package; and where numba must translate it first.
#: So many take plain Python as long (``python -m carom.bench.switch``), so going over costs at most about twice the
#: better choice.
PLAIN_IMPACTS = 300
TRANSLATED_IMPACTS = 5_000
UNCACHED_IMPACTS = 70_000

#: Impacts a call of the compiled kernel, after which progress is reported: a tenth of a second or so.
_CHUNK = 50_000
#: Room for impacts, in rows; the plain kernel's buffer is a list, which costs time to make.
_ROOM, _PLAIN_ROOM = 4096, 256
_NEVER = 2**62


@dataclass(frozen=True)
class RunState:
    """All that a run needs to go on: hand it to `EventDrivenRun` again. Predictions are made anew.

    Attributes:
        body: Paths, shape ``(n, 8)``, in the columns of `carom.solvers.layout`.
        link: Impact counts and last partners, shape ``(n, 8)``.
        clock: Times.
        tally: Counts.
        last_impact: Time of each disc's last impact, where a contact takes time, else empty.
        time_s: How far the run has been taken.
    """

    body: NDArray[np.float64]
    link: NDArray[np.int32]
    clock: NDArray[np.float64]
    tally: NDArray[np.int64]
    last_impact: NDArray[np.float64]
    time_s: float


class EventDrivenRun:
    """A PIC run that can be taken forward in as many pieces as one likes; the pieces do not change the result.

    Args:
        start: A scene, or discs and walls as arrays.
        record: Which impacts to keep: "all" or "none". Counts a disc are always kept, see `impacts_per_disc`.
        window_s: Keep only impacts reported within these times.
        contact_duration_s: Contact time of the TC model (Luding & McNamara, Granular Matter 1 (1998) 113): an impact of
            a disc whose last one is more recent than this is elastic, which ends inelastic collapse. 0 for none.
        resume: The state of an earlier run of the same start to go on from.
        compiled: Force the compiled or the plain form of the kernel; None chooses. They give the same bits.
        cell_factor: Factor on the width of the cells, at least 1; infinity for a single one. It changes no result.

    Raises:
        InputError: The scene has gravity, discs given as arrays overlap, an option is outside its range, or `compiled`
            without numba.
    """

    def __init__(
        self,
        start: Scene | DiscArrays,
        *,
        record: str = "all",
        window_s: tuple[float, float] = (-math.inf, math.inf),
        contact_duration_s: float = 0.0,
        resume: RunState | None = None,
        compiled: bool | None = None,
        cell_factor: float = 1.0,
    ) -> None:
        if not isinstance(start, DiscArrays):
            from carom.solvers.plain.bodies import require_supported  # with it pydantic, which arrays do without

            require_supported(start, "the compiled event-driven kernel")
            start = start.arrays
        elif resume is None:
            start.require_apart()
        if record not in {"all", "none"}:
            raise InputError(f"record must be 'all' or 'none', got {record!r}")
        if not contact_duration_s >= 0:
            raise InputError(f"contact_duration_s must be 0 or more, got {contact_duration_s}")
        if not cell_factor >= 1:
            raise InputError(f"cell_factor must be at least 1, got {cell_factor}")
        if compiled and not compiler_installed():
            raise InputError("compiled needs numba, which is not installed: pip install 'carom[fast]'")
        self.log = KeptImpacts()
        self.time_s = 0.0
        self.notes: tuple[str, ...] = ()
        self._record = record == "all"
        self._forced = compiled
        self._patience = PLAIN_IMPACTS
        state = KernelState.of(start, contact_duration_s, cell_factor, window_s)
        if resume is not None:
            state.columns.body[:], state.columns.link[:] = resume.body.ravel(), resume.link.ravel()
            state.columns.clock[:], state.columns.tally[:] = resume.clock, resume.tally
            state.columns.last_impact[:] = resume.last_impact
            self.time_s = resume.time_s
        self._plain = not (
            compiled or (compiled is None and len(start) >= COMPILED_FROM_DISCS and compiler_installed())
        )
        self._state = state.as_lists() if self._plain else state
        self._compiled = None if self._plain else compiled_kernel()
        room = (_PLAIN_ROOM if self._plain else _ROOM) * RECORD if self._record else 0
        self._records = [0.0] * room if self._plain else np.zeros(room)
        if self._plain and compiled is None and len(start) >= COMPILED_FROM_DISCS:
            self.notes = ("numba is not installed: ran as plain Python; pip install 'carom[fast]'",)

    def advance_to(self, time_s: float, max_impacts: int | None = None, progress: Progress | None = None) -> Outcome:
        """Carry out every impact up to and including `time_s`, or until `max_impacts` in all have been carried out.

        Args:
            time_s: Seconds from the start.
            max_impacts: Number of impacts, counted from the start of the run; None for no limit.
            progress: Called now and then with the number of impacts so far and the time reached.
        """
        last = _NEVER if max_impacts is None else max_impacts
        while True:
            tally = self._state.columns.tally
            if self._plain and self._forced is None and tally[TOTAL] >= self._patience and compiler_installed():
                self._go_over()
                tally = self._state.columns.tally
            step = min(last, int(tally[TOTAL]) + (PLAIN_IMPACTS if self._plain else _CHUNK))
            ended = self._state.run(self._compiled, self._records, time_s, step)
            tally = self._state.columns.tally
            self.log.add(self._records, int(tally[RECORDED]))
            tally[RECORDED] = 0
            if progress is not None:
                progress(int(tally[TOTAL]), float(self._state.columns.clock[REPORTED]))
            if ended == STANDSTILL:
                self.time_s = float(self._state.columns.clock[REPORTED])
                return Outcome.STANDSTILL
            if ended == DONE:
                self.time_s = max(self.time_s, time_s)
                return Outcome.COMPLETED
            if ended == LIMIT and tally[TOTAL] >= last:
                self.time_s = max(self.time_s, float(self._state.columns.clock[REPORTED]))
                return Outcome.MAX_IMPACTS

    def _go_over(self) -> None:
        """Go over from plain Python to the compiled kernel, in the middle of the run, if that pays already."""
        recipe = kernel_recipe()
        pays = TRANSLATED_IMPACTS if is_translated(recipe) else UNCACHED_IMPACTS
        if self._patience < pays and not is_cached(recipe):
            self._patience = pays
            return
        self._state = self._state.as_arrays()
        self._compiled = compiled_kernel()
        self._plain = False
        self._records = np.zeros(_ROOM * RECORD if self._record else 0)

    def positions(self) -> NDArray[np.float64]:
        """Centres now, metres, shape ``(n, 2)``."""
        paths, clock = self._state.paths(), self._state.columns.clock
        wait = ((self.time_s - clock[EPOCH]) - clock[EPOCH_REST]) - paths[:, OWN_TIME]
        position: NDArray[np.float64] = paths[:, X : Y + 1] + paths[:, VX : VY + 1] * wait[:, None]
        return position

    def velocities(self) -> NDArray[np.float64]:
        """Velocities now, metres a second, shape ``(n, 2)``."""
        return self._state.paths()[:, VX : VY + 1].copy()

    def impacts_per_disc(self) -> NDArray[np.int64]:
        """Number of impacts of each disc so far, with discs and walls, shape ``(n,)``."""
        return np.asarray(self._state.columns.link, np.int64).reshape(-1, ROW)[:, VERSION]

    def state(self) -> RunState:
        """Return a copy of the run's state, to go on from later."""
        tally = np.array(self._state.columns.tally, np.int64)
        tally[READY] = 0
        return RunState(
            np.array(self._state.paths()),
            np.array(self._state.columns.link, np.int32).reshape(-1, ROW),
            np.array(self._state.columns.clock, np.float64),
            tally,
            np.array(self._state.columns.last_impact, np.float64),
            self.time_s,
        )

    @property
    def impacts(self) -> int:
        """Number of impacts so far, kept or not."""
        return int(self._state.columns.tally[TOTAL])

    @property
    def predictions(self) -> int:
        """Number of times a disc's future was predicted anew after an impact."""
        return int(self._state.columns.tally[PREDICTIONS])

    @property
    def counts(self) -> dict[str, int]:
        """Work counts."""
        names = {
            "impacts": TOTAL,
            "wall_impacts": WALL_IMPACTS,
            "predictions": PREDICTIONS,
            "stale": STALE,
            "crossings": CROSSINGS,
            "epochs": EPOCHS,
        }
        return {name: int(self._state.columns.tally[k]) for name, k in names.items()} | {
            "compiled": int(not self._plain)
        }

    @property
    def bytes_per_disc(self) -> float:
        """Memory of the kernel's arrays a disc, recorded impacts left out; 0 for the plain form."""
        return self._state.nbytes / (len(self._state.columns.body) // ROW)
