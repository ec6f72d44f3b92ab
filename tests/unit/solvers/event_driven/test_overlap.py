"""A start in which bodies overlap is refused, and the two are named."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.unit.solvers.scenes import random_start

from carom.errors import InputError
from carom.solvers.event_driven.disc_arrays import DiscArrays
from carom.solvers.event_driven.overlap import require_apart
from carom.solvers.event_driven.run import EventDrivenRun


def discs(position: np.ndarray, radius: np.ndarray, mass: np.ndarray | None = None) -> DiscArrays:
    n = len(position)
    return DiscArrays(position, np.zeros((n, 2)), radius, np.ones(n) if mass is None else mass)


@given(st.integers(0, 2**32 - 1), st.sampled_from([1.0, 30.0]))
def test_overlaps_are_found_among_all_pairs(seed: int, spread: float) -> None:
    """A start is refused exactly where some pair of all overlaps, whatever the radii."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 30))
    start = discs(rng.uniform(-10, 10, (n, 2)), rng.uniform(0.1, 1.0, n) * rng.uniform(1.0 / spread, 1.0, n))
    overlapping = {
        (i, j)
        for i, j in itertools.combinations(range(n), 2)
        if math.dist(start.position_m[i], start.position_m[j]) < start.radius_m[i] + start.radius_m[j] - 1e-12
    }
    if not overlapping:
        require_apart(start)
        return
    with pytest.raises(InputError) as refusal:
        require_apart(start)
    words = str(refusal.value).split()
    second, first = int(words[0][len("position_m[") : -1]), int(words[words.index("disc") + 1])
    assert (first, second) in overlapping


def test_touching_discs_and_overlapping_immovable_ones_are_let_through() -> None:
    """Discs that touch are apart; two that never move may overlap, since nothing can come of it."""
    require_apart(discs(np.array([[0.1, 0.0], [1.1, 0.0]]), np.array([0.5, 0.5])))
    require_apart(discs(np.array([[0.0, 0.0], [0.5, 0.0]]), np.array([0.5, 0.5]), np.full(2, math.inf)))


def test_a_run_refuses_overlapping_arrays_and_discs_within_walls() -> None:
    """A run from arrays says which disc overlaps which other, or which wall, by how much, and what to do."""
    start = discs(np.array([[0.0, 0.0], [5.0, 0.0], [0.75, 0.0]]), np.full(3, 0.5))
    with pytest.raises(InputError, match=r"position_m\[2\] must not overlap disc 0 .* by 0.25 m; move them apart"):
        EventDrivenRun(start)
    walled = DiscArrays(np.array([[0.25, 1.0]]), np.zeros((1, 2)), np.array([0.5]), np.ones(1), ((0.0, 0.0, 1.0, 0.0),))
    with pytest.raises(InputError, match=r"position_m\[0\] must not overlap wall 0 .* reaches 0.25 m into it"):
        EventDrivenRun(walled)


def test_random_starts_without_overlap_pass() -> None:
    """What the tests' own packing of discs keeps apart is let through, with radii from 1 to 100."""
    require_apart(random_start(np.random.default_rng(5), 60, spread=100.0))
