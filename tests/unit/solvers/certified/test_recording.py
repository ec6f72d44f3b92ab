"""What is recorded of a certified run is known to the digits asked for, or is not recorded."""

from __future__ import annotations

from flint import arb
from tests.lengths import each
from tests.stage import line

from carom.solvers.certified.impacts import BallEvent, BallImpact
from carom.solvers.certified.recording import Recording

EXACT = tuple(map(arb, (0, 0, 1, 0)))


@each("radius, known", [(1e-5, False), (2e-6, False), (1e-6, True), (0.0, True)])
def test_an_instant_is_recorded_where_its_digits_are_known(radius: float, known: bool) -> None:
    """Six digits need an instant of 1.5 s to 1.5 us; exact velocities do not make up for it."""
    log = Recording(line(0.0, 4.0, velocities=(1.0, 0.0)), 6)
    log.add(BallEvent(BallImpact(0, 1, arb(1.5, radius), arb(1), arb(0), arb(1), EXACT)))  # type: ignore[arg-type] # four
    assert log.convert() is known
    assert len(log) == known
