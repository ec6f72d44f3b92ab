"""The four cases of the source paper, "Collision Detection Between two Circular Rigid Bodies", figures 2 to 9.

The catalogue has the known answers of PIC. These tests compare PIT with what the figures show.
"""

import math

import numpy as np
import pytest
from tests.cases import each

from carom import Scene, Trace, solve_pic, solve_pit
from carom.catalogue import catalogue


def solve_both(name: str) -> tuple[Scene, Trace, Trace]:
    scene = catalogue()[f"paper/{name}"].scene
    return scene, solve_pic(scene), solve_pit(scene)


def compute_sampled_impact(scene: Scene) -> tuple[float, complex, complex]:
    """Return time and velocities of the first impact of equal discs 0 and 1 under PIT: at the first frame in contact.

    Contact begins at the first root of |d + t u| = R, by the textbook formula. Equal masses exchange the parts of their
    velocities along the line of centres at that frame.
    """
    a, b = (complex(*disc.position_m) for disc in scene.discs[:2])
    va, vb = (complex(*disc.velocity_m_s) for disc in scene.discs[:2])
    d, u, contact = b - a, vb - va, scene.discs[0].radius_m + scene.discs[1].radius_m
    du, uu = (d * u.conjugate()).real, abs(u) ** 2
    begins_s = (-du - math.sqrt(du**2 - uu * (abs(d) ** 2 - contact**2))) / uu
    time = math.ceil(begins_s * scene.frame_rate_hz) / scene.frame_rate_hz
    assert time < -du / uu  # when the centres are nearest
    normal = (d + u * time) / abs(d + u * time)
    exchanged = -(u * normal.conjugate()).real * normal
    return time, va - exchanged, vb + exchanged


def as_complex(vector: object) -> complex:
    x, y = np.asarray(vector, dtype=float)
    return complex(x, y)


def angle_degrees(one: object, other: object) -> float:
    turn = as_complex(one).conjugate() * as_complex(other)
    return abs(math.degrees(math.atan2(turn.imag, turn.real)))


def test_case_1_pit_misses_the_collision() -> None:
    """Figures 2 and 3: PIT has no impact."""
    assert len(solve_pit(catalogue()["paper/missed"].scene).impacts) == 0


@each("name", ["late", "wrong-direction"])
def test_first_impact_of_pit_follows_from_the_normal_at_its_frame(name: str) -> None:
    """Figures 4 and 6: time and velocities of PIT's first impact are those of the first frame in contact."""
    scene, _, pit = solve_both(name)
    time, first, second = compute_sampled_impact(scene)
    assert pit.impacts["time_s"][0] == time
    assert as_complex(pit.impacts["velocity_first_after"][0]) == pytest.approx(first, abs=1e-12)
    assert as_complex(pit.impacts["velocity_second_after"][0]) == pytest.approx(second, abs=1e-12)


def test_case_2_pit_is_late_and_follows_the_wrong_path() -> None:
    """Figures 4 and 5: PIT is over half a frame late and ends over half a radius off, in directions within 10°."""
    scene, pic, pit = solve_both("late")
    assert pit.impacts["time_s"][0] - pic.impacts["time_s"][0] > 0.5 / scene.frame_rate_hz
    off_m = np.hypot(*(pit.final_position_m - pic.final_position_m).T)
    assert np.all(off_m > [disc.radius_m / 2 for disc in scene.discs])
    for right, wrong in zip(pic.final_velocity_m_s, pit.final_velocity_m_s, strict=True):
        assert angle_degrees(right, wrong) < 10


def test_case_3_blue_bounces_off_in_a_wrong_direction() -> None:
    """Figures 6 and 7: in PIT blue leaves red over 10 degrees off, with the kinetic energy of PIC."""
    scene, pic, pit = solve_both("wrong-direction")
    assert angle_degrees(*(trace.impacts["velocity_first_after"][1] for trace in (pic, pit))) > 10
    energy = [scene.arrays.mass_kg @ np.sum(trace.final_velocity_m_s**2, axis=1) for trace in (pic, pit)]
    assert energy[1] == pytest.approx(energy[0], rel=1e-12)


def test_case_4_pit_misses_some_collisions_of_one_frame() -> None:
    """Figures 8 and 9: all four collisions are between two frames, and PIT has one to three of them."""
    scene, pic, pit = solve_both("multiple")
    assert len(set(np.floor(pic.impacts["time_s"] * scene.frame_rate_hz).tolist())) == 1
    exact, sampled = (set(trace.impacts[["first", "second"]].tolist()) for trace in (pic, pit))
    assert set() < sampled < exact
    for _, missed in exact - sampled:
        assert pit.final_velocity_m_s[missed].tolist() == [0, 0]


@each("name", ["missed", "late", "wrong-direction", "multiple"])
def test_high_frame_rate_makes_pit_acceptable(name: str) -> None:
    """At 256 times the frame rate PIT has PIC's impacts, the first at most one frame late."""
    # The paper concludes that PIT may be acceptable at a high frame rate.
    scene = catalogue()[f"paper/{name}"].scene
    rate = 256 * scene.frame_rate_hz
    exact, sampled = solve_pic(scene).impacts, solve_pit(scene, frame_rate_hz=rate).impacts
    assert sampled[["first", "second"]].tolist() == exact[["first", "second"]].tolist()
    assert 0 <= sampled["time_s"][0] - exact["time_s"][0] <= 1 / rate
