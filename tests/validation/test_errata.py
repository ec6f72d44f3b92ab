"""The source paper's errata: each printed formula, as printed, compared with a known answer and with Carom.

``docs/theory/errata.md`` lists all errata and names these tests. The printed formulas live here and nowhere else.
"""

import math
import re
from pathlib import Path

import numpy as np
import pytest
from tests.cases import each
from tests.scene_builders import disc_at, staged

import carom
from carom import Scene

U = 2.0**-53
Vector = tuple[float, float]
#: Position, velocity and radius of one disc, then of the other.
Pair = tuple[Vector, Vector, float, Vector, Vector, float]

#: An oblique head-on hit: the gap of 9 m along a 3-4-5 line closes at 5 m/s, which takes 1.8 s.
OBLIQUE: Pair = ((0.0, 0.0), (3.0, 4.0), 0.5, (6.0, 8.0), (0.0, 0.0), 0.5)


def printed_coefficients(c1: Vector, v1: Vector, r1: float, c2: Vector, v2: Vector, r2: float) -> tuple[float, ...]:
    """Return a, b and c as printed below "where,": the components are summed before they are squared."""
    a = ((v2[0] + v2[1]) - (v1[0] + v1[1])) ** 2
    b = 2 * (c2[0] + c2[1] - c1[0] - c1[1]) * (v2[0] + v2[1] - v1[0] - v1[1])
    c = ((c2[0] + c2[1]) - (c1[0] + c1[1])) ** 2 - (r1 + r2) ** 2
    return a, b, c


def correct_coefficients(c1: Vector, v1: Vector, r1: float, c2: Vector, v2: Vector, r2: float) -> tuple[float, ...]:
    """Return a, b and c of the paper's quadratic with the dot products that its own derivation asks for."""
    dx, dy, ux, uy = c2[0] - c1[0], c2[1] - c1[1], v2[0] - v1[0], v2[1] - v1[1]
    return ux * ux + uy * uy, 2 * (dx * ux + dy * uy), dx * dx + dy * dy - (r1 + r2) ** 2


def printed_choice(a: float, b: float, c: float) -> float:
    """Return the least root that is not negative, by the printed formulas; infinity for none."""
    discriminant = b * b - 4 * a * c
    if discriminant < 0:
        return math.inf
    roots = [(-b + math.sqrt(discriminant)) / (2 * a), (-b - math.sqrt(discriminant)) / (2 * a)]
    return min((root for root in roots if root >= 0), default=math.inf)


def carom_time(*pair: Vector | float) -> float:
    return float(carom.time_of_impact(*pair))


# The quadratic --------------------------------------------------------------------------------------------------------


def test_printed_quadratic_sums_components_and_gives_a_wrong_time() -> None:
    """The printed a, b, c are 49, -196 and 195, which gives 13/7 s; dot products, and Carom, give 9/5 s."""
    assert printed_coefficients(*OBLIQUE) == (49.0, -196.0, 195.0)
    assert correct_coefficients(*OBLIQUE) == (25.0, -100.0, 99.0)
    assert abs(printed_choice(*printed_coefficients(*OBLIQUE)) - 13 / 7) <= 16 * U
    for time in (printed_choice(*correct_coefficients(*OBLIQUE)), carom_time(*OBLIQUE)):
        assert abs(time - 1.8) <= 16 * U * 1.8  # 2 h/(h - R) = 2.3 and a dozen roundings more


def test_printed_c_reports_distant_discs_as_overlapping() -> None:
    """Discs more than 50 m apart along x + y = const have printed c = -1 < 0, which means overlap."""
    pair: Pair = ((0.0, 10.0), (0.0, 0.0), 0.5, (40.0, -30.0), (-3.0, 3.0), 0.5)
    assert printed_coefficients(*pair)[2] == -1.0
    # The gap is 40 sqrt(2) - 1 along the diagonal, closed at 3 sqrt(2) m/s.
    truth = (40 * math.sqrt(2) - 1) / (3 * math.sqrt(2))
    assert abs(carom_time(*pair) - truth) <= 16 * U * truth


def test_printed_a_is_zero_for_a_moving_disc() -> None:
    """A disc that moves along (1, -1) has printed a = 0, so the printed roots divide by zero; the hit is at 3 s."""
    pair: Pair = ((0.0, 0.0), (1.0, -1.0), 0.5, (4.0, -3.0), (0.0, 0.0), 0.5)
    with pytest.raises(ZeroDivisionError):
        printed_choice(*printed_coefficients(*pair))
    assert abs(carom_time(*pair) - 3.0) <= 16 * U * 3.0  # |(4 - t, -3 + t)| = 1 at t = 3 and t = 4


# Which root -----------------------------------------------------------------------------------------------------------


@each(
    "pair, printed, correct",
    [
        pytest.param(((0, 0), (1, 0), 0.5, (0.5, 0), (0, 0), 0.5), 1.5, 0.0, id="overlapping discs that approach"),
        pytest.param(((0, 0), (-1, 0), 0.5, (1, 0), (0, 0), 0.5), 0.0, math.inf, id="touching discs that separate"),
        pytest.param(((0, 0), (1, 0), 0.5, (3, 1), (0, 0), 0.5), 3.0, math.inf, id="a graze changes no velocity"),
    ],
)
def test_least_root_is_not_the_time_of_impact(pair: Pair, printed: float, correct: float) -> None:
    """The least root >= 0 is the exit of overlapping discs, and an impact of separating or grazing discs."""
    assert printed_choice(*correct_coefficients(*pair)) == printed
    assert carom_time(*pair) == correct


def test_roots_divide_by_zero_without_relative_motion() -> None:
    """Two discs of equal velocity have a = 0, for which the printed roots divide by zero; they never collide."""
    pair: Pair = ((0.0, 0.0), (3.0, 4.0), 0.5, (6.0, 8.0), (3.0, 4.0), 0.5)
    with pytest.raises(ZeroDivisionError):
        printed_choice(*correct_coefficients(*pair))
    assert carom_time(*pair) == math.inf


def test_textbook_formulas_lose_digits() -> None:
    """From 10^8 m away the printed root is 0.87 s late, at a gap of 10^-12 m it is off by 10^-5 of the time."""
    # b^2 - 4 a c rounds to 0 in the first case; the truth of the second is the gap of the floats over the speed.
    far: Pair = ((0.0, 0.0), (1.0, 0.0), 0.5, (1e8, 0.5), (0.0, 0.0), 0.5)
    near: Pair = ((0.0, 0.0), (0.3, 0.0), 0.5, (1.0 + 1e-12, 0.0), (0.0, 0.0), 0.5)
    late_s, early_s = 1e8 - math.sqrt(0.75), ((1.0 + 1e-12) - 1.0) / 0.3
    assert printed_choice(*correct_coefficients(*far)) - late_s > 0.8
    assert abs(printed_choice(*correct_coefficients(*near)) - early_s) > 1e-5 * early_s
    assert abs(carom_time(*far) - late_s) <= 6 * U * 1e8
    assert abs(carom_time(*near) - early_s) <= 16 * U * early_s


# Velocities after the impact ------------------------------------------------------------------------------------------


def test_squared_momentum_and_energy_do_not_determine_the_velocities() -> None:
    """Equations (5) and (6) hold for velocities that no frictionless impact gives, and for the opposite momentum."""
    after = carom.resolve_impact((5, 0), 1, (0, 0), 1, (1, 0))
    np.testing.assert_array_equal(after, [(0, 0), (5, 0)])
    for v1, v2 in (((1.0, 2.0), (4.0, -2.0)), ((0.0, 0.0), (-5.0, 0.0))):
        assert (v1[0] + v2[0]) ** 2 + (v1[1] + v2[1]) ** 2 == 25.0
        assert v1[0] ** 2 + v1[1] ** 2 + v2[0] ** 2 + v2[1] ** 2 == 25.0
        assert not np.array_equal(after, (v1, v2))


def test_momentum_is_conserved_without_elasticity() -> None:
    """The paper derives momentum from perfect elasticity; at e = 1/2 momentum is conserved and energy is not."""
    after1, after2 = carom.resolve_impact((3, 0), 2, (0, 0), 1, (1, 0), 0.5)
    assert 2 * after1[0] + after2[0] == 2 * 3.0
    assert 2 * after1[0] ** 2 + after2[0] ** 2 < 2 * 3.0**2


def test_missing_velocity_formulas_follow_from_v_rel() -> None:
    """V1' = V1 + 2 m2/(m1 + m2) V_rel and V2' = V2 - 2 m1/(m1 + m2) V_rel are missing after "Thus,"."""
    v1, v2, m1, m2 = np.array([2.0, 0.0]), np.array([0.0, -1.0]), 1.0, 3.0
    n = np.array([0.6, 0.8])
    v_rel = ((v2 - v1) @ n) * n  # as printed; against n while the discs approach
    completed = v1 + 2 * m2 / (m1 + m2) * v_rel, v2 - 2 * m1 / (m1 + m2) * v_rel
    # No number above 4, and fewer than 20 roundings on either side.
    np.testing.assert_allclose(carom.resolve_impact(v1, m1, v2, m2, n), completed, rtol=0, atol=40 * 4 * U)


# The algorithms -------------------------------------------------------------------------------------------------------


def build_row_scene(*positions: float, first_speed: float, duration_s: float) -> Scene:
    """Return discs of radius .5 on the x axis, of which the first moves."""
    first, *others = positions
    return staged("row", disc_at(first, 0, first_speed), *(disc_at(x, 0) for x in others), duration_s=duration_s)


def printed_algorithm_2(scene: Scene, frame_s: float) -> list[tuple[float, int, int]]:
    """Run Algorithm 2 as printed, for equal elastic discs on the x axis: one impact a frame, then the next frame."""
    x = [disc.position_m[0] for disc in scene.discs]
    v = [disc.velocity_m_s[0] for disc in scene.discs]
    found = []
    for frame in range(round(scene.duration_s / frame_s)):
        upcoming = []
        for i in range(len(x)):
            for j in range(i + 1, len(x)):
                time = carom_time((x[i], 0), (v[i], 0), 0.5, (x[j], 0), (v[j], 0), 0.5)
                if time < frame_s:
                    upcoming.append((time, i, j))
        rest = frame_s
        if upcoming:
            time, i, j = min(upcoming)
            found.append((frame * frame_s + time, i, j))
            x = [a + b * time for a, b in zip(x, v, strict=True)]
            v[i], v[j] = v[j], v[i]
            rest = frame_s - time
        x = [a + b * rest for a, b in zip(x, v, strict=True)]
    return found


def test_printed_algorithm_2_handles_one_impact_per_frame() -> None:
    """With impacts at 0.5 s and 0.75 s in one frame, the printed Algorithm 2 moves the second one to 1 s."""
    # By then disc 1, which leaves x = 2 m at 0.5 s with 2 m/s, overlaps disc 2 at 3.5 m by half a metre.
    scene = build_row_scene(0.0, 2.0, 3.5, first_speed=2.0, duration_s=2.0)
    assert printed_algorithm_2(scene, 1.0) == [(0.5, 0, 1), (1.0, 1, 2)]
    assert carom.solve_pic(scene).impacts["time_s"].tolist() == [0.5, 0.75]
    assert carom.solve_pic_framewise(scene, frame_rate_hz=1.0).impacts["time_s"].tolist() == [0.5, 0.75]


def test_printed_algorithm_2_compares_a_duration_with_an_instant() -> None:
    """T counts from now, as in equations (1) and (2); compared with an instant it is handled frames too early."""
    # A disc reaches another at 8 s, with a frame each second. At the frame of 4 s the impact is T = 4 s ahead, and 4 <
    # 5, "next frame instant", although it belongs to the frame that begins at 8 s.
    spans = [carom_time((float(now), 0), (1, 0), 0.5, (9, 0), (0, 0), 0.5) for now in range(9)]
    as_printed = next(now for now in range(9) if spans[now] < now + 1)
    as_meant = next(now for now in range(9) if now + spans[now] < now + 1)
    assert (as_printed, as_meant) == (4, 8)
    scene = build_row_scene(0.0, 9.0, first_speed=1.0, duration_s=10.0)
    assert carom.solve_pic_framewise(scene, frame_rate_hz=1.0).impacts["time_s"].tolist() == [8.0]


@each("rate", [10.0, 100.0, 1000.0])
def test_no_frame_rate_is_high_enough_for_pit(rate: float) -> None:
    """At any frame rate PIT misses an impact so oblique that entry and closest approach are within one frame."""
    half_chord = 0.25 / rate  # at 1 m/s the discs approach in contact for a quarter of a frame
    depth = math.sqrt(1 - half_chord**2)
    closest = 2.0 + 0.5 / rate  # and that quarter is in the middle of a frame
    scene = staged("oblique", disc_at(-closest, depth, 1, 0), disc_at(0, 0), duration_s=4)
    assert len(carom.solve_pic(scene).impacts) == 1
    assert len(carom.solve_pit(scene, frame_rate_hz=rate).impacts) == 0


def test_pic_needs_fewer_operations_than_pit() -> None:
    """PIC solves fewer than 10 equations for a scene in which PIT tests a pair at each of 6000 frames."""
    scene = build_row_scene(0.0, 9.0, first_speed=1.0, duration_s=100.0)
    pic, pit = carom.solve_pic(scene), carom.solve_pit(scene, frame_rate_hz=60.0, skipping=False)
    assert len(pic.impacts) == len(pit.impacts) == 1
    assert pit.counts["pair_tests"] == 6000
    assert pic.counts["predictions"] < 10


def test_pit_uses_the_normal_of_the_frame() -> None:
    """Figure 6: PIT's normal is (0.6, 0.8) at its frame; at contact it is (0.8, 0.6), so directions are wrong."""
    scene = staged("direction", disc_at(0, 0, 2, 0), disc_at(1.45, 0.6), duration_s=1)
    # Rounding as in the tests of PIC and PIT: 128 units of relative rounding for the normal of PIC, 20 for that of PIT.
    np.testing.assert_allclose(carom.solve_pic(scene).impacts["normal"], [(0.8, 0.6)], rtol=0, atol=128 * U)
    pit = carom.solve_pit(scene, frame_rate_hz=2.0)
    np.testing.assert_allclose(pit.impacts["normal"], [(0.6, 0.8)], rtol=0, atol=40 * U)


# The page -------------------------------------------------------------------------------------------------------------


def test_errata_page_names_exactly_the_tests_of_this_file() -> None:
    """The errata page names each test of this file except this one, and no test that is missing here."""
    page = (Path(__file__).parents[2] / "docs" / "theory" / "errata.md").read_text(encoding="utf-8")
    named = set(re.findall(r"`(test_\w+)`", page))
    here = {name for name in globals() if name.startswith("test_")}
    assert named == here - {"test_errata_page_names_exactly_the_tests_of_this_file"}
