"""A trace that can't be of its scene is refused in a sentence, before anything is measured."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from tests.cases import each
from tests.scene_builders import altered, sure

from carom.catalogue import find_scenes
from carom.comparator import compare
from carom.errors import InputError
from carom.model.trace import Trace
from carom.solvers.pic import solve_pic
from carom.solvers.pit.solve import solve_pit

#: One disc that slides along a wall, and turns.
REFERENCE = solve_pic(find_scenes(["spin/slide"])[0].scene)


def with_other(**fields: Any) -> Callable[[Trace], Trace]:
    """Return what gives the first impact of a trace other bodies or velocities."""
    return lambda trace: altered(trace, 0, **fields)


def with_spin_of_the_wall(trace: Trace) -> Trace:
    spins = sure(trace.spins).copy()
    spins["second_after"][0] = 2.5
    return replace(trace, spins=spins)


@each(
    "change, words",
    [
        (with_other(second=-8), r"second of impact 0 .* is wall 7 \(-8\)"),
        (with_other(second=9), r"second of impact 0 .* is disc 9 \(9\)"),
        (with_other(first=-1), r"first of impact 0 .* is wall 0 \(-1\)"),
        (with_spin_of_the_wall, "spin second_after of impact 0 .* is 2.5, but its second body is wall 0"),
        (
            with_other(velocity_second_before=(0.0, -0.1)),
            "velocity_second_before of impact 0 .* is 0, -0.1, but its second body is wall 0",
        ),
        (lambda trace: replace(trace, end_time_s=2 * trace.end_time_s), "ends at .* a trace must end"),
        (lambda trace: replace(trace, spins=None), "has no spins"),
        (lambda trace: replace(trace, float_bits=16), r"float_bits of .* is 16, but must be one of \[32, 64\]"),
    ],
)
def test_what_cannot_be_of_the_scene_is_refused_by_name(change: Callable[[Trace], Trace], words: str) -> None:
    """Bodies that there are not, a wall that moves or turns, an end after the scene's, and floats of 16 bits."""
    for pair in ((REFERENCE, change(REFERENCE)), (change(REFERENCE), REFERENCE)):
        with pytest.raises(InputError, match=words):
            compare(*pair)


def test_pit_must_be_of_the_same_scene_and_step() -> None:
    """A run at 1/60 s is "no worse than PIT at the same step" against no coarser PIT, nor against one of elsewhere."""
    scene = find_scenes(["paper/late"])[0].scene
    reference, observed = solve_pic(scene), solve_pit(scene, frame_rate_hz=60)
    with pytest.raises(InputError, match=r"a step of 0.0166667 s, but sampling has one of 0.333333 s"):
        compare(reference, observed, sampling=solve_pit(scene, frame_rate_hz=3))
    with pytest.raises(InputError, match="sampling of 'spin/slide'"):
        compare(reference, observed, sampling=solve_pit(REFERENCE.scene, frame_rate_hz=60))
    # A run without steps is compared with PIT at any step.
    assert np.isfinite(compare(reference, reference, sampling=solve_pit(scene, frame_rate_hz=3)).price_paid)
