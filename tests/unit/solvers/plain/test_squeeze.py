"""Which discs are called crushed, and which still have something to meet."""

from __future__ import annotations

import math

import pytest
from tests.stage import disc_at, staged, wall_at

from carom.solvers.plain import run as plain


def test_a_disc_is_not_called_crushed_that_comes_to_another_before(monkeypatch: pytest.MonkeyPatch) -> None:
    """No room is left at 2 s; a disc 2.4 m on, at 1 m/s along the walls, is met at some 1.9 s, after seven bounces."""
    walls = wall_at(0.0, 0.0, 1.0, 0.0), wall_at(2.5, 0.0, -1.0, 0.0, velocity_m_s=(-1.0, 0.0))
    discs = disc_at(1.0, -1.9, 0.0, 1.0, r=0.25), disc_at(0.25, 0.5, r=0.25, m=math.inf)
    monkeypatch.setattr(plain, "standstill_impacts", lambda _: 3)  # after so many it is asked
    run = plain.AllPairsRun(staged("crush", *discs, *walls, duration_s=3.0))
    run.advance_to(3.0, 8)
    assert run.log.array()["second"].tolist() == [-2, -1, -2, -1, -2, -1, -2, 1]
