"""Lower bounds: proven against exact times, and the same in all their forms."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest
from flint import arb, ctx
from hypothesis import given, settings
from hypothesis import strategies as st

from carom import Disc, Scene, Wall, certify
from carom.bench.gas import gas_scene
from carom.errors import SceneError
from carom.solvers.certified import lower_bounds
from carom.solvers.certified.bodies import BallBodies
from carom.solvers.certified.exact import pair_terms
from carom.solvers.certified.lower_bounds import LowerBounds
from carom.solvers.certified.prediction import float_above, float_below, meet_pair, meet_wall

FORMS = ("plain", "numpy", "compiled")


@st.composite
def scenes(draw: st.DrawFn) -> Scene | None:
    """Few discs of all sizes, far and near, slow and fast, one of them immovable now and then, in a corner."""
    scale = st.sampled_from([2.0**-300, 1e-3, 1.0, 1e6, 2.0**300])
    length, speed = draw(scale), draw(scale)
    unit = st.floats(-8, 8)
    discs = [
        Disc(
            position_m=(draw(unit) * length, draw(unit) * length),
            velocity_m_s=(0.0, 0.0) if fixed else (draw(unit) * speed, draw(unit) * speed),
            radius_m=draw(st.floats(1e-3, 1.0)) * length,
            mass_kg=math.inf if fixed else 1.0,
        )
        for fixed in (False, False, draw(st.booleans()), False)
    ]
    walls = [Wall(point_m=(-10 * length, 0.0), normal=(1.0, 0.0)), Wall(point_m=(0.0, 15 * length), normal=(0.6, -0.8))]
    try:
        return Scene(name="drawn", discs=discs, walls=walls, duration_s=1.0)
    except SceneError:
        return None  # an overlapping start


def bounds_of(scene: Scene, form: str) -> LowerBounds:
    with np.errstate(all="ignore"):
        return LowerBounds(BallBodies(scene), form)


def entries(bounds: LowerBounds) -> list[float]:
    return [bounds.at(i, column) for i in range(bounds.n) for column in range(bounds.width)]


@given(scenes())
@settings(max_examples=60, deadline=None)
def test_a_bound_is_never_after_the_impact(scene: Scene | None) -> None:
    """Two discs are still apart at their bound by rational arithmetic, walls by balls; without one, they never meet."""
    if scene is None:
        return
    bounds = bounds_of(scene, "plain")
    bodies = bounds.bodies
    with ctx.workprec(2000):
        for i in range(bounds.n):
            for column in range(bounds.width):
                if bounds.at(i, column) == math.inf and column <= i:
                    continue  # it stands in the other's row
                second = bounds.second(column)
                meeting = meet_wall(bodies, i, -1 - second, 0.0) if second < 0 else meet_pair(bodies, i, second, 0.0)
                if scene.discs[i].immovable and (second < 0 or scene.discs[second].immovable):
                    assert bounds.at(i, column) == math.inf
                elif meeting is not None:
                    assert not meeting.time < bounds.at(i, column)
                    if second >= 0:
                        a, b, c, _ = pair_terms(scene, i, second)
                        at = Fraction(bounds.at(i, column))
                        assert a * at * at + 2 * b * at + c >= 0


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("scale", [2.0**-500, 2.0**-300, 2.0**-260, 1.0, 2.0**300, 2.0**500])
def test_products_beyond_float64_make_no_bound_too_late(form: str, scale: float) -> None:
    """Lengths and speeds of any size: the discs meet after 2 s, at 3 m/s over 6 m, and no bound is later."""
    discs = [
        Disc(position_m=(0.0, 0.0), velocity_m_s=(3 * scale, 0.0), radius_m=scale),
        Disc(position_m=(8 * scale, 0.0), radius_m=scale),
    ]
    bound, row, column = bounds_of(Scene(name="far from 1", discs=discs, duration_s=9.0), form).earliest()
    assert (row, column) == (0, 1)
    assert 0.0 <= bound <= 2.0


@given(scenes())
@settings(max_examples=40, deadline=None)
def test_all_forms_give_the_same_bits(scene: Scene | None) -> None:
    """Plain, NumPy and compiled bounds are the same numbers, also where float64 overflows."""
    if scene is None:
        return
    plain, others = bounds_of(scene, "plain"), [bounds_of(scene, form) for form in FORMS[1:]]
    for other in others:
        assert entries(other) == entries(plain)
        assert other.earliest() == plain.earliest()


def test_all_forms_give_the_same_bits_after_impacts_on_balls_that_grow() -> None:
    """Through a hundred impacts the tables agree, from sharp balls to ones wider than float64's roundings."""
    scene = gas_scene(9, 0.4)
    with ctx.workprec(110), np.errstate(all="ignore"):
        bodies = BallBodies(scene)
        tables = [LowerBounds(bodies, form) for form in FORMS]
        wide = False
        for _ in range(100):
            found = {(*table.earliest(), *entries(table)) for table in tables}
            assert len(found) == 1
            at, row, column = tables[0].earliest()
            second = tables[0].second(column)
            if second < 0:
                meeting = meet_wall(bodies, row, -1 - second, at)
            else:
                meeting = meet_pair(bodies, min(row, second), max(row, second), at)
            if meeting is None or not meeting.decided or meeting.latest > tables[0].earliest()[0] + 1e-9:
                for table in tables:
                    table.raise_to(row, column, math.inf, math.inf)
                assert len({table.rivals for table in tables}) == 1
                continue
            meeting.carry_out(bodies)
            moved = [body for body in (meeting.first, meeting.second) if body >= 0]
            for table in tables:
                table.changed(*moved)
            wide = wide or bodies.worst_accuracy_bits() < lower_bounds.SHARP_BITS
        assert wide


@pytest.mark.parametrize("form", ["plain", "numpy", "compiled"])
def test_under_gravity_a_wall_has_no_bound_but_the_start_of_the_path(form: str) -> None:
    """Pairs keep the bounds of the falling frame, in which they move straight; walls are for the balls, all of them."""
    straight = gas_scene(9, 0.3, duration_s=10.0)
    falling = straight.model_copy(update={"gravity_m_s2": (0.5, -9.81)})
    one, other = bounds_of(straight, form), bounds_of(falling, form)
    n = other.n
    for i in range(n):
        assert [other.at(i, column) for column in range(n)] == [one.at(i, column) for column in range(n)]
        assert [other.at(i, column) for column in range(n, other.width)] == [0.0] * len(falling.walls)


@pytest.mark.parametrize("until", [-math.inf, 0.5, 1.0, math.inf])
def test_rivals_are_counted_alike(until: float) -> None:
    """The bounds up to a time are the same in all forms: none, one, or two for more."""
    counts = set()
    for form in FORMS:
        bounds = bounds_of(gas_scene(9, 0.4), form)
        at, row, column = bounds.earliest()
        bounds.raise_to(row, column, at, until)
        counts.add((bounds.rivals, min(2, len(bounds.no_later_than(until)))))
    assert len(counts) == 1
    counted, listed = counts.pop()
    assert counted == listed


def test_a_run_is_the_same_where_the_compiled_form_takes_over_amidst(monkeypatch: pytest.MonkeyPatch) -> None:
    """Going over from NumPy to the compiled form changes no bit of the result."""
    scene = gas_scene(36, 0.4)
    monkeypatch.setattr(lower_bounds, "CACHED_FROM", math.inf)
    whole = certify(scene, max_impacts=60)
    monkeypatch.setattr(lower_bounds, "COMPILED_FROM", lower_bounds.impacts_so_far() + 30)
    monkeypatch.setattr(lower_bounds, "CACHED_FROM", lower_bounds.COMPILED_FROM)
    changed_over = certify(scene, max_impacts=60)
    assert lower_bounds.impacts_so_far() < 60 + lower_bounds.COMPILED_FROM
    assert changed_over.trace.impacts.tobytes() == whole.trace.impacts.tobytes()
    assert changed_over.radii.tobytes() == whole.radii.tobytes()


@given(st.integers(2**80, 2**90), st.integers(-100, -20))
def test_a_float64_below_or_above_a_ball_is_so(mantissa: int, exponent: int) -> None:
    """However python-flint rounds, the float64 is on its side of the number, and next to it."""
    with ctx.workprec(200):
        number = arb(mantissa) * arb(2.0**exponent)
        truth = Fraction(mantissa) * Fraction(2) ** exponent
        below, above = float_below(number), float_above(number)
        assert Fraction(below) <= truth <= Fraction(above)
        assert above <= math.nextafter(below, math.inf)
