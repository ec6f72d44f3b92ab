"""PIC against ball arithmetic, on scenes full of ties too: it has the impacts that are proven, however close."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from tests.cases import each, release_after
from tests.random_scenes import draw_small_scene, draw_table_friction_scene

from carom import CertifiedTrace, Outcome, Scene, certify, solve_pic
from carom.solvers.certified.result import Ending


class Law(NamedTuple):
    """How scenes are drawn, how many to begin with and in all, and how many impacts are followed.

    Few, so that float64 has not yet lost the trajectory: to `near` of its speeds and times.
    """

    draw: Callable[[int], Scene]
    begun: int
    drawn: int
    impacts: int | None
    near: float


def draw_scene_with(**fields: Any) -> Callable[[int], Scene]:
    return lambda number: Scene(**{**dict(draw_small_scene(number, repeated=False)), **fields})


def draw_falling_scene(number: int) -> Scene:
    return draw_small_scene(number, rough=True, repeated=False, immovable=False, gravity=(0.25, -1.0))


LAWS = {
    "floating": Law(lambda number: draw_small_scene(number, repeated=False), 25, 600, 12, 1e-8),
    "rough": Law(lambda number: draw_small_scene(number, rough=True, repeated=False), 6, 300, 10, 1e-8),
    "falling": Law(draw_falling_scene, 4, 100, 10, 1e-8),
    "damped": Law(draw_scene_with(damping_per_s=0.3), 5, 200, 10, 1e-11),
    "on a table": Law(draw_table_friction_scene, 8, 300, None, 1e-11),
}


def sort_commuting_impacts(impacts: list[tuple[int, int]], certified: CertifiedTrace) -> list[tuple[int, int]]:
    """Return impacts with those sorted by their bodies whose order makes no difference, as is proven."""
    ordered = list(impacts)
    for earlier, later in certified.commuted:
        ordered[earlier : later + 1] = sorted(ordered[earlier : later + 1])
    return ordered


@each("part", release_after(1, range(6)))
@each("name", LAWS)
def test_pic_matches_certified_runs_on_random_scenes(name: str, part: int) -> None:
    """PIC has the impacts of certified runs in the same order, as far as ball arithmetic decides."""
    # Times, velocities and spins agree to the tolerance of each law. Impacts of one instant whose order is proven not
    # to matter may be exchanged.
    law, proven = LAWS[name], 0
    step = (law.drawn - law.begun) // 5
    numbers = range(law.begun + (part - 1) * step, law.begun + part * step) if part else range(law.begun)
    for number in numbers:
        scene = law.draw(number)
        trace = solve_pic(scene, max_impacts=law.impacts)
        if trace.outcome is Outcome.GLIDES:  # it ends after infinitely many hops along a ring
            continue
        certified = certify(scene, max_impacts=law.impacts)
        found, times = trace.impacts[["first", "second"]].tolist(), certified.trace.impacts["time_s"]
        truth = certified.trace.impacts[["first", "second"]].tolist()
        if certified.ending is not Ending.COMPLETED:  # it may end between impacts of one instant, in either order
            ends_s = times[-1] if certified.degeneracy is None else certified.degeneracy.earliest_s
            before = int(np.sum(times < ends_s))
            found, truth = found[:before], truth[:before]
        assert sort_commuting_impacts(found, certified) == sort_commuting_impacts(truth, certified), number
        proven += len(truth)
        if found != truth:  # in another order, as it may
            continue
        rows = [(trace.impacts, certified.trace.impacts), (trace.spins, certified.trace.spins)]
        for one, two in ((a[: len(truth)], b[: len(truth)]) for a, b in rows if a is not None and b is not None):
            for field in (field for field in one.dtype.names or () if field not in {"first", "second", "normal"}):
                np.testing.assert_allclose(one[field], two[field], rtol=law.near, atol=law.near)
        if certified.ending is Ending.COMPLETED:
            np.testing.assert_allclose(trace.final_position_m, certified.trace.final_position_m, atol=law.near)
    assert proven > len(numbers)
