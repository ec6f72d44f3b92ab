"""The four cases of the source paper, "Collision Detection Between two Circular Rigid Bodies", figures 2 to 9."""

import math

import numpy as np
import pytest
from tests.cases import each

from carom import Scene, Trace, solve_pic, solve_pit
from carom.catalogue import catalogue

CASES = ["paper/missed", "paper/late", "paper/wrong-direction", "paper/multiple"]


def solve_both(name: str) -> tuple[Scene, Trace, Trace]:
    scene = catalogue()[name].scene
    return scene, solve_pic(scene), solve_pit(scene)


def compute_overlap_interval(scene: Scene) -> tuple[float, float]:
    """Solve for the interval in which PIT can see discs 0 and 1: from contact to the least distance of the centres.

    Both are roots of the distance as a function of time, by the textbook formula: |d + t u| = R, and d.u + t u.u = 0.
    """
    a, b = scene.discs[:2]
    d = complex(*b.position_m) - complex(*a.position_m)
    u = complex(*b.velocity_m_s) - complex(*a.velocity_m_s)
    du, uu = (d * u.conjugate()).real, abs(u) ** 2
    contact = a.radius_m + b.radius_m
    return (-du - math.sqrt(du**2 - uu * (abs(d) ** 2 - contact**2))) / uu, -du / uu


def compute_sampled_impact(scene: Scene) -> tuple[float, complex, complex]:
    """Time and velocities of the first impact of equal discs 0 and 1 under PIT: at the first frame that sees them.

    Equal masses exchange the parts of their velocities along the line of centres at that frame.
    """
    enter, closest = compute_overlap_interval(scene)
    frame = math.ceil(enter * scene.frame_rate_hz)
    time = frame / scene.frame_rate_hz
    assert time < closest
    a, b = (complex(*disc.position_m) + complex(*disc.velocity_m_s) * time for disc in scene.discs[:2])
    va, vb = (complex(*disc.velocity_m_s) for disc in scene.discs[:2])
    normal = (b - a) / abs(b - a)
    exchanged = ((va - vb) * normal.conjugate()).real * normal
    return time, va - exchanged, vb + exchanged


def angle_degrees(a: complex, b: complex) -> float:
    return abs(math.degrees(math.atan2((a.conjugate() * b).imag, (a.conjugate() * b).real)))


def as_complex(vector: object) -> complex:
    x, y = np.asarray(vector, dtype=float)
    return complex(x, y)


def test_case_1_pit_misses_the_collision_and_pic_finds_it() -> None:
    """Figures 2 and 3: PIT has no impact; PIC has one, at the instant that the quadratic gives."""
    scene, pic, pit = solve_both("paper/missed")
    assert len(pit.impacts) == 0
    assert pic.impacts["time_s"].tolist() == pytest.approx([compute_overlap_interval(scene)[0]], rel=1e-12)


def test_case_2_pit_is_late_by_most_of_a_frame() -> None:
    """Figure 4: PIT reports the first frame after contact, more than half a frame late; PIC reports the contact."""
    scene, pic, pit = solve_both("paper/late")
    enter, _ = compute_overlap_interval(scene)
    time, _, _ = compute_sampled_impact(scene)
    assert pit.impacts["time_s"].tolist() == [time]
    assert pic.impacts["time_s"].tolist() == pytest.approx([enter], rel=1e-12)
    assert time - enter > 0.5 / scene.frame_rate_hz


def test_case_2_pit_follows_the_wrong_path() -> None:
    """Figures 4 and 5: PIT follows the closed form for its late frame, and ends over half a radius from PIC."""
    scene, pic, pit = solve_both("paper/late")
    time, *after = compute_sampled_impact(scene)
    for i, (disc, velocity) in enumerate(zip(scene.discs, after, strict=True)):
        turn = complex(*disc.position_m) + complex(*disc.velocity_m_s) * time
        sampled_end = turn + velocity * (scene.duration_s - time)
        assert as_complex(pit.final_position_m[i]) == pytest.approx(sampled_end, abs=1e-12)
        assert abs(as_complex(pic.final_position_m[i]) - sampled_end) > disc.radius_m / 2


def test_case_2_direction_error_is_below_ten_degrees() -> None:
    """Figure 4: directions after the late impact are off by less than 10 degrees; the visible error is the delay."""
    _, pic, pit = solve_both("paper/late")
    for right, wrong in zip(pic.final_velocity_m_s, pit.final_velocity_m_s, strict=True):
        assert angle_degrees(as_complex(right), as_complex(wrong)) < 10


def test_case_3_blue_bounces_off_in_a_wrong_direction() -> None:
    """Figures 6 and 7: in PIT blue leaves red more than 10 degrees off the exact direction, which PIC has."""
    entry = catalogue()["paper/wrong-direction"]
    _, pic, pit = solve_both("paper/wrong-direction")
    known = as_complex(entry.known.impacts[1].velocity_first_after)
    assert angle_degrees(known, as_complex(pic.impacts["velocity_first_after"][1])) < 1e-10
    assert angle_degrees(known, as_complex(pit.impacts["velocity_first_after"][1])) > 10


def test_case_3_first_bounce_follows_from_the_late_normal() -> None:
    """Figure 6: PIT's first impact follows in closed form from the line of centres at its frame."""
    scene, _, pit = solve_both("paper/wrong-direction")
    time, green, blue = compute_sampled_impact(scene)
    assert pit.impacts["time_s"][0] == time
    assert as_complex(pit.impacts["velocity_first_after"][0]) == pytest.approx(green, abs=1e-12)
    assert as_complex(pit.impacts["velocity_second_after"][0]) == pytest.approx(blue, abs=1e-12)


def test_case_3_pit_conserves_energy() -> None:
    """Figure 6: PIT ends with the kinetic energy of PIC; only the normal is wrong."""
    scene, pic, pit = solve_both("paper/wrong-direction")
    mass = np.array([disc.mass_kg for disc in scene.discs])
    energy = [0.5 * np.sum(mass * np.sum(t.final_velocity_m_s**2, axis=1)) for t in (pic, pit)]
    assert energy[1] == pytest.approx(energy[0], rel=1e-12)


def test_case_4_all_collisions_fall_into_one_frame() -> None:
    """Figure 9: PIC finds all four collisions, and they are between the same two frames."""
    scene, pic, _ = solve_both("paper/multiple")
    assert pic.impacts["second"].tolist() == [1, 2, 3, 4]
    frames = np.floor(pic.impacts["time_s"] * scene.frame_rate_hz)
    assert len(set(frames.tolist())) == 1


def test_case_4_pit_misses_some_collisions() -> None:
    """Figure 8: PIT finds one to three of the four collisions and no other; the missed discs stay at rest."""
    _, pic, pit = solve_both("paper/multiple")
    exact, sampled = (set(t.impacts[["first", "second"]].tolist()) for t in (pic, pit))
    assert set() < sampled < exact
    for _, missed in exact - sampled:
        assert pit.final_velocity_m_s[missed].tolist() == [0, 0]


@each("name", CASES)
def test_high_frame_rate_makes_pit_acceptable(name: str) -> None:
    """At 256 times the frame rate PIT has PIC's impacts, the first at most one frame late."""
    # The paper concludes that PIT may be acceptable at a high frame rate.
    scene = catalogue()[name].scene
    rate = 256 * scene.frame_rate_hz
    exact, sampled = solve_pic(scene).impacts, solve_pit(scene, frame_rate_hz=rate).impacts
    assert sampled[["first", "second"]].tolist() == exact[["first", "second"]].tolist()
    assert 0 <= sampled["time_s"][0] - exact["time_s"][0] <= 1 / rate
