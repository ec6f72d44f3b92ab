"""The source paper's errata, shown by computing: each printed formula, as printed, against an answer that is known.

``docs/theory/errata.md`` lists all errata and names these tests. The printed formulas live here and nowhere else.
"""

import math
import re
from pathlib import Path

import numpy as np
import pytest
from tests.cases import each
from tests.scene_builders import disc_at, staged, wall_at

import carom
from carom import Scene

U = 2.0**-53
Vector = tuple[float, float]
Vector3 = tuple[float, float, float]

# The oblique head-on hit that most of these tests use. Disc 1 starts at the origin at (3, 4) m/s, a speed of 5; disc 2
# rests at (6, 8), 10 m away along the same 3-4-5 line; both radii are .5. The gap of 9 m closes at 5 m/s: 1.8 s.
C1, V1, R1 = (0.0, 0.0), (3.0, 4.0), 0.5
C2, V2, R2 = (6.0, 8.0), (0.0, 0.0), 0.5
TRUE_A, TRUE_HALF_B, TRUE_C, TRUE_TIME = 25.0, -50.0, 99.0, 1.8
#: Rounding of the time of impact here: 2 h/(h - R) = 2.3 and a dozen roundings more; 16 units hold it.
TOLERANCE = 16 * U * TRUE_TIME


def printed_coefficients(c1: Vector, v1: Vector, r1: float, c2: Vector, v2: Vector, r2: float) -> Vector3:
    """Return a, b and c as printed below "where,": the components are summed before they are squared."""
    a = ((v2[0] + v2[1]) - (v1[0] + v1[1])) ** 2
    b = 2 * (c2[0] + c2[1] - c1[0] - c1[1]) * (v2[0] + v2[1] - v1[0] - v1[1])
    c = ((c2[0] + c2[1]) - (c1[0] + c1[1])) ** 2 - (r1 + r2) ** 2
    return a, b, c


def correct_coefficients(c1: Vector, v1: Vector, r1: float, c2: Vector, v2: Vector, r2: float) -> Vector3:
    """Return a, b and c of the paper's quadratic with the dot products that its own derivation asks for."""
    dx, dy, ux, uy = c2[0] - c1[0], c2[1] - c1[1], v2[0] - v1[0], v2[1] - v1[1]
    return ux * ux + uy * uy, 2 * (dx * ux + dy * uy), dx * dx + dy * dy - (r1 + r2) ** 2


def printed_roots(a: float, b: float, c: float) -> list[float]:
    """Return root 1 and root 2 as printed, none where the discriminant is negative."""
    discriminant = b * b - 4 * a * c
    if discriminant < 0:
        return []
    return [(-b + math.sqrt(discriminant)) / (2 * a), (-b - math.sqrt(discriminant)) / (2 * a)]


def printed_choice(roots: list[float]) -> float:
    """Return the least root that is not negative, as printed in the analysis of the roots; infinity for none."""
    return min((root for root in roots if root >= 0), default=math.inf)


def carom_time(c1: Vector, v1: Vector, r1: float, c2: Vector, v2: Vector, r2: float) -> float:
    """Return Carom's time of impact as a float."""
    return float(carom.time_of_impact(c1, v1, r1, c2, v2, r2))


# The quadratic --------------------------------------------------------------------------------------------------------


def test_printed_a_sums_components_before_squaring() -> None:
    """The printed a is (3 + 4)^2 = 49; the square of the speed 5 is 25."""
    a, _, _ = printed_coefficients(C1, V1, R1, C2, V2, R2)
    assert a == 49.0
    assert correct_coefficients(C1, V1, R1, C2, V2, R2)[0] == TRUE_A


def test_printed_b_sums_components_before_multiplying() -> None:
    """The printed b is 2 (6 + 8)(-7) = -196; twice the dot product is -100."""
    _, b, _ = printed_coefficients(C1, V1, R1, C2, V2, R2)
    assert b == -196.0
    assert correct_coefficients(C1, V1, R1, C2, V2, R2)[1] == 2 * TRUE_HALF_B


def test_printed_c_sums_components_before_squaring() -> None:
    """The printed c is (6 + 8)^2 - 1 = 195; the square of the distance 10, minus 1, is 99."""
    _, _, c = printed_coefficients(C1, V1, R1, C2, V2, R2)
    assert c == 195.0
    assert correct_coefficients(C1, V1, R1, C2, V2, R2)[2] == TRUE_C


def test_printed_quadratic_gives_a_wrong_time() -> None:
    """The printed a, b, c put the 3-4-5 impact at 13/7 s; with dot products, and in Carom, it is at 9/5 s."""
    printed = printed_choice(printed_roots(*printed_coefficients(C1, V1, R1, C2, V2, R2)))
    assert abs(printed - 13 / 7) <= 16 * U
    right = printed_choice(printed_roots(*correct_coefficients(C1, V1, R1, C2, V2, R2)))
    assert abs(right - TRUE_TIME) <= TOLERANCE
    assert abs(carom_time(C1, V1, R1, C2, V2, R2) - TRUE_TIME) <= TOLERANCE


def test_printed_c_reports_distant_discs_as_overlapping() -> None:
    """Discs more than 50 m apart along x + y = const have printed c = -1 < 0, which means overlap."""
    first, second = (0.0, 10.0), (40.0, -30.0)
    _, _, c = printed_coefficients(first, (0.0, 0.0), 0.5, second, (-3.0, 3.0), 0.5)
    assert c == -1.0
    assert math.dist(first, second) > 50.0
    # The gap is 40 sqrt(2) - 1 along the diagonal, closed at 3 sqrt(2) m/s.
    truth = (40 * math.sqrt(2) - 1) / (3 * math.sqrt(2))
    assert abs(carom_time(first, (0.0, 0.0), 0.5, second, (-3.0, 3.0), 0.5) - truth) <= 16 * U * truth


def test_printed_a_is_zero_for_a_moving_disc() -> None:
    """A disc that moves along (1, -1) has printed a = 0, so the printed roots divide by zero; the hit is at 3 s."""
    c1, v1, c2, v2 = (0.0, 0.0), (1.0, -1.0), (4.0, -3.0), (0.0, 0.0)
    coefficients = printed_coefficients(c1, v1, 0.5, c2, v2, 0.5)
    assert coefficients[0] == 0.0
    with pytest.raises(ZeroDivisionError):
        printed_roots(*coefficients)
    # |(4 - t, -3 + t)| = 1 at t = 3 and t = 4; the bound of the time is 2 h/(h - R) = 2.5 and a dozen roundings.
    assert abs(carom_time(c1, v1, 0.5, c2, v2, 0.5) - 3.0) <= 16 * U * 3.0


def test_product_of_speeds_is_not_the_relative_speed() -> None:
    """Read as a product, "V1V2" makes a = |V1|^2 |V2|^2 = 0 for a disc at rest; the velocity difference gives 25."""
    assert (math.hypot(*V1) * math.hypot(*V2)) ** 2 == 0.0
    assert math.dist(V1, V2) ** 2 == TRUE_A


def test_flipped_sign_reverses_time() -> None:
    """With (C2 - C1) - t (V2 - V1), as printed in one line, the impact at 1.8 s solves the equation at -1.8 s."""

    def printed(t: float) -> float:
        x = (C2[0] - C1[0]) - t * (V2[0] - V1[0])
        y = (C2[1] - C1[1]) - t * (V2[1] - V1[1])
        return math.hypot(x, y) - (R1 + R2)

    # Distances near 20 m, computed with a handful of roundings.
    assert abs(printed(-TRUE_TIME)) <= 8 * 20 * U
    assert printed(TRUE_TIME) > 10.0
    assert carom_time(C1, V1, R1, C2, V2, R2) > 0.0


def test_equations_1_and_2_without_primes_hold_for_no_moving_disc() -> None:
    """As printed, "C1 + tV1 = C1" means that t V1 = 0; at 1.8 s the disc has moved 9 m."""
    moved = (C1[0] + TRUE_TIME * V1[0], C1[1] + TRUE_TIME * V1[1])
    assert moved != C1
    assert abs(math.dist(moved, C1) - 9.0) <= 8 * 9 * U


# Which root -----------------------------------------------------------------------------------------------------------


def test_least_root_gives_the_exit_of_overlapping_discs() -> None:
    """For discs that overlap and approach, the least root >= 0 is the exit at 1.5 s; the impact is at 0 s."""
    state = ((0.0, 0.0), (1.0, 0.0), 0.5, (0.5, 0.0), (0.0, 0.0), 0.5)
    assert printed_choice(printed_roots(*correct_coefficients(*state))) == 1.5
    assert carom_time(*state) == 0.0


def test_least_root_reports_an_impact_of_separating_discs() -> None:
    """Discs that touch and separate have a root at 0, which the paper counts as an impact; Carom counts none."""
    state = ((0.0, 0.0), (-1.0, 0.0), 0.5, (1.0, 0.0), (0.0, 0.0), 0.5)
    assert printed_choice(printed_roots(*correct_coefficients(*state))) == 0.0
    assert carom_time(*state) == math.inf


def test_least_root_reports_an_impact_for_a_graze() -> None:
    """At discriminant 0 the paper counts an impact; it would change no velocity, so Carom counts none."""
    state = ((0.0, 0.0), (1.0, 0.0), 0.5, (3.0, 1.0), (0.0, 0.0), 0.5)
    assert printed_choice(printed_roots(*correct_coefficients(*state))) == 3.0
    after1, after2 = carom.resolve_impact((1, 0), 1, (0, 0), 1, (0, 1))
    np.testing.assert_array_equal([after1, after2], [(1, 0), (0, 0)])
    assert carom_time(*state) == math.inf


def test_roots_divide_by_zero_without_relative_motion() -> None:
    """Two discs of equal velocity have a = 0, for which the printed roots divide by zero; they never collide."""
    state = ((0.0, 0.0), (3.0, 4.0), 0.5, (6.0, 8.0), (3.0, 4.0), 0.5)
    with pytest.raises(ZeroDivisionError):
        printed_roots(*correct_coefficients(*state))
    assert carom_time(*state) == math.inf


def test_textbook_discriminant_rounds_to_zero_at_large_distance() -> None:
    """From 10^8 m away, 0.5 m off centre, b^2 - 4ac rounds to 0, a graze; the true impact is 0.87 s earlier."""
    state = ((0.0, 0.0), (1.0, 0.0), 0.5, (1e8, 0.5), (0.0, 0.0), 0.5)
    a, b, c = correct_coefficients(*state)
    assert b * b - 4 * a * c == 0.0
    truth = 1e8 - math.sqrt(0.75)
    assert printed_choice(printed_roots(a, b, c)) - truth > 0.8
    assert abs(carom_time(*state) - truth) <= 6 * U * 1e8


def test_textbook_root_cancels_near_contact() -> None:
    """At a gap of 10^-12 m the printed root loses digits by cancellation; Carom's time is right to rounding."""
    state = ((0.0, 0.0), (0.3, 0.0), 0.5, (1.0 + 1e-12, 0.0), (0.0, 0.0), 0.5)
    truth = ((1.0 + 1e-12) - 1.0) / 0.3  # the gap of the floats, exactly, over the speed
    printed = printed_choice(printed_roots(*correct_coefficients(*state)))
    assert abs(printed - truth) > 1e-5 * truth
    assert abs(carom_time(*state) - truth) <= 16 * U * truth


# Velocities after the impact ------------------------------------------------------------------------------------------


def test_momentum_is_conserved_without_elasticity() -> None:
    """The paper derives momentum from perfect elasticity; at e = 1/2 momentum is conserved and energy is not."""
    after1, after2 = carom.resolve_impact((3, 0), 2, (0, 0), 1, (1, 0), 0.5)
    assert 2 * after1[0] + after2[0] == 2 * 3.0
    assert 2 * after1[0] ** 2 + after2[0] ** 2 < 2 * 3.0**2


def test_squared_momentum_and_energy_do_not_determine_the_velocities() -> None:
    """Equations (5) and (6) hold for velocities that no frictionless impact along the line of centres gives."""
    before, normal = ((5.0, 0.0), (0.0, 0.0)), (1.0, 0.0)
    # (5, 0) + (0, 0) = (1, 2) + (4, -2), and 25 + 0 = 5 + 20: momentum itself, its square and energy all agree.
    wrong = ((1.0, 2.0), (4.0, -2.0))
    for v1, v2 in (before, wrong):
        assert (v1[0] + v2[0], v1[1] + v2[1]) == (5.0, 0.0)
        assert v1[0] ** 2 + v1[1] ** 2 + v2[0] ** 2 + v2[1] ** 2 == 25.0
    after = carom.resolve_impact(before[0], 1, before[1], 1, normal)
    np.testing.assert_array_equal(after, [(0, 0), (5, 0)])
    assert not np.array_equal(after, wrong)


def test_squared_momentum_loses_the_direction() -> None:
    """Reversing both final velocities also satisfies (5), and sends the discs through each other."""
    v1, v2 = carom.resolve_impact((5, 0), 1, (0, 0), 1, (1, 0))
    turned = -v1 - v2
    assert turned @ turned == 25.0  # (5): the square of the total momentum, which itself is (-5, 0)
    assert turned[0] == -5.0


def test_squaring_momentum_as_scalars_is_wrong() -> None:
    """The square of m1 V1 + m2 V2 contains 2 m1 m2 times the dot product, not the product of the speeds."""
    v1, v2 = np.array([3.0, 4.0]), np.array([-4.0, 3.0])  # at right angles, both of speed 5
    total = v1 + v2
    assert total @ total == 50.0
    as_scalars = 25.0 + 25.0 + 2 * 5.0 * 5.0
    assert as_scalars == 100.0
    assert 25.0 + 25.0 + 2 * (v1 @ v2) == total @ total


def test_energy_equation_without_primes_allows_any_outcome() -> None:
    """Printed with V1 and V2 on both sides, the energy equation allows any outcome, even doubled speeds."""
    before, doubled = (3.0, -1.0), (6.0, -2.0)

    def printed(v: Vector, _after: Vector) -> bool:
        left, right = v[0] ** 2 / 2 + v[1] ** 2 / 2, v[0] ** 2 / 2 + v[1] ** 2 / 2
        return left == right

    def meant(v: Vector, after: Vector) -> bool:
        return v[0] ** 2 / 2 + v[1] ** 2 / 2 == after[0] ** 2 / 2 + after[1] ** 2 / 2

    after1, after2 = carom.resolve_impact((before[0], 0), 1, (before[1], 0), 1, (1, 0))
    assert printed(before, doubled)
    assert not meant(before, doubled)
    assert meant(before, (float(after1[0]), float(after2[0])))


def test_missing_velocity_formulas_follow_from_v_rel() -> None:
    """V1' = V1 + 2 m2/(m1 + m2) V_rel and V2' = V2 - 2 m1/(m1 + m2) V_rel are missing after "Thus,"."""
    v1, v2, m1, m2 = np.array([2.0, 0.0]), np.array([0.0, -1.0]), 1.0, 3.0
    n = np.array([0.6, 0.8])
    v_rel = ((v2 - v1) @ n) * n  # as printed; against n while the discs approach
    assert (v2 - v1) @ n < 0
    completed = v1 + 2 * m2 / (m1 + m2) * v_rel, v2 - 2 * m1 / (m1 + m2) * v_rel
    # No number above 4, and fewer than 20 roundings on either side.
    np.testing.assert_allclose(carom.resolve_impact(v1, m1, v2, m2, n), completed, rtol=0, atol=40 * 4 * U)


def test_other_sign_of_v_rel_drives_the_discs_together() -> None:
    """With V_rel taken as (V1 - V2) the same formulas make the discs approach faster instead of separating."""
    v1, v2 = np.array([1.0, 0.0]), np.array([0.0, 0.0])
    n = np.array([1.0, 0.0])
    flipped = ((v1 - v2) @ n) * n
    wrong1, wrong2 = v1 + flipped, v2 - flipped
    assert (wrong1 - wrong2) @ n > (v1 - v2) @ n
    right1, right2 = carom.resolve_impact(v1, 1, v2, 1, n)
    assert (right1 - right2) @ n == -1.0


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
        now = frame * frame_s
        upcoming = []
        for i in range(len(x)):
            for j in range(i + 1, len(x)):
                time = carom_time((x[i], 0), (v[i], 0), 0.5, (x[j], 0), (v[j], 0), 0.5)
                if time < frame_s:
                    upcoming.append((time, i, j))
        rest = frame_s
        if upcoming:
            time, i, j = min(upcoming)
            found.append((now + time, i, j))
            x = [a + b * time for a, b in zip(x, v, strict=True)]
            v[i], v[j] = v[j], v[i]
            rest = frame_s - time
        x = [a + b * rest for a, b in zip(x, v, strict=True)]
    return found


def test_printed_algorithm_2_handles_one_impact_per_frame() -> None:
    """With impacts at 0.5 s and 0.75 s in one frame, the printed Algorithm 2 moves the second one to 1 s."""
    scene = build_row_scene(0.0, 2.0, 3.5, first_speed=2.0, duration_s=2.0)
    assert printed_algorithm_2(scene, 1.0) == [(0.5, 0, 1), (1.0, 1, 2)]
    assert carom.solve_pic(scene).impacts["time_s"].tolist() == [0.5, 0.75]
    framewise = carom.solve_pic_framewise(scene, frame_rate_hz=1.0)
    assert framewise.impacts["time_s"].tolist() == [0.5, 0.75]


def test_printed_algorithm_2_lets_discs_overlap() -> None:
    """PIC "does not allow the discs to interfere at all", yet as printed they overlap by 0.5 m at 1 s."""
    scene = build_row_scene(0.0, 2.0, 3.5, first_speed=2.0, duration_s=1.0)
    assert printed_algorithm_2(scene, 1.0) == [(0.5, 0, 1)]
    # Disc 1 leaves x = 2 at .5 s with 2 m/s: at 1 s it is at 3, half a metre from disc 2's centre, contact being 1 m.
    position_at_1_s = 2.0 + 0.5 * 2.0
    assert 3.5 - position_at_1_s == 0.5
    final = carom.solve_pic(scene).final_position_m[:, 0]
    assert np.all(np.diff(final) >= 1.0)


def test_printed_algorithm_2_compares_a_duration_with_an_instant() -> None:
    """T counts from now, as in equations (1) and (2); compared with an instant it is handled frames too early."""
    # A disc reaches another at 8 s, with a frame each second. At the frame of 4 s the impact is T = 4 s ahead, and 4 <
    # 5, "next frame instant", although it belongs to the frame that begins at 8 s.
    scene = build_row_scene(0.0, 9.0, first_speed=1.0, duration_s=10.0)
    spans = [carom_time((float(now), 0), (1, 0), 0.5, (9, 0), (0, 0), 0.5) for now in range(9)]
    assert spans == [8.0, 7.0, 6.0, 5.0, 4.0, 3.0, 2.0, 1.0, 0.0]
    as_printed = next(now for now in range(9) if spans[now] < now + 1)
    as_meant = next(now for now in range(9) if now + spans[now] < now + 1)
    assert (as_printed, as_meant) == (4, 8)
    assert carom.solve_pic(scene).impacts["time_s"].tolist() == [8.0]
    assert carom.solve_pic_framewise(scene, frame_rate_hz=1.0).impacts["time_s"].tolist() == [8.0]


def test_pit_does_not_always_detect_in_the_next_frame() -> None:
    """The paper says of PIT "it will be detected in the next frame", but its own case 1 is missed altogether."""
    scene = staged("pass", disc_at(0, 0, 11, 0), disc_at(5.5, 0), duration_s=2)
    assert len(carom.solve_pit(scene, frame_rate_hz=1.0).impacts) == 0
    # The gap of 4.5 m closes at 11 m/s: 2 h/(h - R) = 2.4 and a dozen roundings.
    assert abs(carom.solve_pic(scene).impacts["time_s"][0] - 4.5 / 11) <= 16 * U


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


def test_repeated_impacts_of_one_pair_need_a_wall() -> None:
    """Two discs alone collide once; with a wall that sends one back, a frame has three impacts, two of that pair."""
    discs, wall = (disc_at(1.5, 0, 2, 0), disc_at(3.5, 0)), wall_at(5, 0, -1, 0)
    free, walled = (
        carom.solve_pic_framewise(staged("discs", *bodies, duration_s=3), frame_rate_hz=1 / 3)
        for bodies in (discs, (*discs, wall))
    )
    assert free.impacts["time_s"].tolist() == [0.5]
    # Gap 1 at 2 m/s; disc 1 then has 1 m to the wall and 1 m back to disc 0, all at 2 m/s: exact numbers.
    assert walled.impacts["time_s"].tolist() == [0.5, 1.0, 1.5]
    assert walled.impacts["second"].tolist() == [1, -1, 1]


# The page -------------------------------------------------------------------------------------------------------------


def test_errata_page_names_exactly_the_tests_of_this_file() -> None:
    """The errata page names each test of this file except this one, and no test that is missing here."""
    page = (Path(__file__).parents[2] / "docs" / "theory" / "errata.md").read_text(encoding="utf-8")
    named = set(re.findall(r"`(test_\w+)`", page))
    here = {name for name in globals() if name.startswith("test_")}
    assert named == here - {"test_errata_page_names_exactly_the_tests_of_this_file"}
