"""Takes a run forward and keeps what can be seen of it: its impacts, and its state every few of them."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from carom import DiscArrays
from carom.model.trace import Outcome
from carom.solvers.run import Run

Floats = NDArray[np.float64]
RunT = TypeVar("RunT", bound=Run)

#: Impacts a disc between two looks at the state. Few, since rounding adds up in the books from look to look; but a look
#: costs as much as some impacts.
IMPACTS_PER_LOOK = 4
#: Impacts of a stretch, or one look's where that is more: arrays of this length still fit into a cache.
STRETCH_IMPACTS = 20_000
#: Impacts after which a new log begins, because reading a log takes a time in proportion to its length.
RENEWED_AFTER = 200_000


@dataclass(frozen=True)
class Stretch:
    """Some impacts of a run, and its state before, after, and every few of them.

    Attributes:
        first_row: Number of impacts that the run had before.
        impacts: Array of `carom.model.trace.IMPACT_DTYPE`.
        looks: How many of these impacts had been carried out at each look, shape ``(p + 1,)``, from 0 on.
        time_s: Instant of each look, shape ``(p + 1,)``.
        position_m: Centres then, shape ``(p + 1, n, 2)``.
        velocity_m_s: Velocities then, shape ``(p + 1, n, 2)``.
        last_impact_s: When each disc had its last impact before the stretch, shape ``(n,)``; -inf for none.
        spins: Array of `carom.model.trace.SPIN_DTYPE`, an entry an impact; None where nothing turns.
        spin_rad_s: Spins at the looks, shape ``(p + 1, n)``; None as well.
        outcome: Why the run stopped at the last look.
    """

    first_row: int
    impacts: NDArray[np.void]
    looks: NDArray[np.intp]
    time_s: Floats
    position_m: Floats
    velocity_m_s: Floats
    last_impact_s: Floats
    spins: NDArray[np.void] | None = None
    spin_rad_s: Floats | None = None
    outcome: Outcome = Outcome.MAX_IMPACTS


def watch(
    run: RunT,
    start: DiscArrays,
    until_s: float,
    max_impacts: int | None = None,
    renew: Callable[[RunT], RunT] | None = None,
) -> Iterator[Stretch]:
    """Take a run forward from its start and yield it stretch by stretch.

    Args:
        run: A run that records all its impacts and has had none yet.
        start: What it started from.
        until_s: Seconds from the start; finite.
        max_impacts: Impacts after which to stop.
        renew: Return a run that takes up a given one, its log empty: called when that has become long.

    Raises:
        Exception: What the run raised, after the stretch up to the last look before has been yielded.
    """
    movable = int(np.sum(np.isfinite(start.mass_kg)))
    step = max(1, IMPACTS_PER_LOOK * movable // 2)
    done, logged, at_end = 0, 0, False
    outcome = Outcome.MAX_IMPACTS
    raised: Exception | None = None
    look = (0.0, start.position_m, start.velocity_m_s, start.spins)
    last_impact_s = np.full(len(start), -np.inf)
    while not at_end:
        if renew is not None and done - logged >= RENEWED_AFTER:
            run, logged = renew(run), done
        looks, counts = [look], [done]
        while not at_end and counts[-1] - done < STRETCH_IMPACTS:
            most = counts[-1] + step
            if max_impacts is not None:
                most = min(most, max_impacts)
            try:
                outcome = run.advance_to(until_s, most)
            except Exception as error:  # noqa: BLE001 - whatever a broken kernel raises, what it did before is seen first
                raised, at_end = error, True
                break
            turning = run.spins()
            looks.append((run.time_s, run.positions(), run.velocities(), start.spins if turning is None else turning))
            counts.append(int(run.counts["impacts"]))
            at_end = outcome is not Outcome.MAX_IMPACTS or most == max_impacts
        if len(looks) == 1:
            break  # it raised before there was anything to see
        seen = slice(done - logged, None if raised is None else counts[-1] - logged)
        impacts, spins = run.log.array()[seen], run.log.spins()
        yield Stretch(
            done,
            impacts,
            np.array(counts) - done,
            np.array([time for time, *_ in looks]),
            np.array([position for _, position, *_ in looks]),
            np.array([velocity for _, _, velocity, _ in looks]),
            last_impact_s,
            None if spins is None else spins[seen],
            None if spins is None else np.array([spin for *_, spin in looks]),
            outcome,
        )
        last_impact_s = _last_impacts(impacts, last_impact_s)
        done, look = counts[-1], looks[-1]
    if raised is not None:
        raise raised


def _last_impacts(impacts: NDArray[np.void], before_s: Floats) -> Floats:
    """Return when each disc had its last impact so far, shape ``(n,)``; what names no disc is left out."""
    last_s = before_s.copy()
    for name in ("first", "second"):
        disc = impacts[name]
        there = (disc >= 0) & (disc < len(last_s))
        np.maximum.at(last_s, disc[there], impacts["time_s"][there])
    return last_s
