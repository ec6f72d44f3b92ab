"""PIC's results for every catalogue scene agree with the known answer, in one run and frame by frame.

Two theorems are also tested.
"""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.cases import by_group, each, release_after
from tests.scene_builders import disc_at, staged

from carom import Outcome, solve_pic, solve_pic_framewise
from carom.catalogue import CatalogueScene, catalogue, deviation
from carom.model.energy import kinetic_energy
from carom.model.scene import Need

#: Some ten thousand roundings: a chain of tens of impacts, each of tens of operations, on well-conditioned scenes.
ROUNDING = 1e-12
#: Where a scene goes through few.
BOUNDS = {"contact": 1e-14, "driven": 1e-14}
#: Where no answer goes on.
ENDS = {"driven/crush": Outcome.CRUSHED, "contact/pressed": Outcome.PRESSED, "contact/corner": Outcome.CORNER}
#: What changes the kinetic energy; a fall turns height into speed, see test_gravity.
NOT_KEPT = {Need.RESTITUTION, Need.GRAVITY}


@each("entries", by_group())
def test_pic_reproduces_known_answers_of_the_catalogue(entries: list[CatalogueScene]) -> None:
    """PIC agrees with the known answer of every catalogue scene to rounding; each answer names its source."""
    # Shortly before a crush the position is known to the distance covered in the last digit of the time. An impact is
    # ambiguous only in scenes whose answer is a convention. Where every restitution is 1, PIC conserves kinetic energy.
    for entry in entries:
        trace, scene = solve_pic(entry.scene), entry.scene
        assert trace.outcome is ENDS.get(entry.name, Outcome.COMPLETED), entry.name
        assert bool(trace.ambiguous) == bool(entry.known.convention), entry.name
        crushed = trace.outcome is Outcome.CRUSHED
        flown = np.spacing(trace.end_time_s) * float(np.hypot(*trace.final_velocity_m_s.T).max()) if crushed else 0.0
        assert deviation(trace, entry.known, scene) <= BOUNDS.get(entry.group, ROUNDING) + flown, entry.name
        if entry.name in catalogue() and entry.known.count != 0 and not scene.needs & NOT_KEPT:
            begun = kinetic_energy(scene, scene.arrays.velocity_m_s)
            assert len(trace.impacts), entry.name  # or nothing could change it
            assert kinetic_energy(scene, trace.final_velocity_m_s) == pytest.approx(begun, rel=ROUNDING), entry.name


@each("frame_rate_hz", release_after(1, [None, 24.0, 7.0, 333.0]))
@each("entries", by_group("issues", "contact", "engines", "spin", "tables", "driven"))
def test_framewise_pic_is_bit_identical_on_catalogue_scenes(
    entries: list[CatalogueScene], frame_rate_hz: float | None
) -> None:
    """Frame-by-frame PIC (the paper's Algorithm 2) has the bits of PIC at any frame rate."""
    for entry in entries:
        whole, framewise = solve_pic(entry.scene), solve_pic_framewise(entry.scene, frame_rate_hz=frame_rate_hz)
        assert framewise.impacts.tobytes() == whole.impacts.tobytes(), entry.name
        assert framewise.final_position_m.tobytes() == whole.final_position_m.tobytes(), entry.name
        assert (framewise.outcome, framewise.ambiguous) == (whole.outcome, whole.ambiguous), entry.name


# Theorems on collisions, tried on many scenes each; the sources are in the docstrings -------------------------------


@given(
    st.tuples(*[st.floats(0.05, 20)] * 3),
    st.tuples(*[st.floats(-3, 3)] * 3),
    st.tuples(st.floats(0.01, 2), st.floats(0.01, 2)),
)
def test_three_masses_on_a_line_collide_a_bounded_number_of_times(
    masses: tuple[float, ...], speeds: tuple[float, ...], gaps: tuple[float, ...]
) -> None:
    """Three masses on a line collide at most ceil(pi / acos sqrt(m1 m3 / ((m1 + m2)(m2 + m3)))) times."""
    # Unfolding of the wedge of that angle; S. Tabachnikov, Geometry and Billiards (2005).
    m1, m2, m3 = masses
    angle = math.acos(math.sqrt(m1 * m3 / ((m1 + m2) * (m2 + m3))))
    x = np.cumsum([0.0, gaps[0] + 0.2, gaps[1] + 0.2])
    discs = [disc_at(p, 0.0, v, r=0.1, m=m) for p, v, m in zip(x, speeds, masses, strict=True)]
    trace = solve_pic(staged("three", *discs, duration_s=1e6))
    assert len(trace.impacts) <= math.ceil(math.pi / angle)


@each("e", [0.02, 0.05, 0.07, 0.08, 0.1, 0.2, 0.5, 0.9, 1.0])
def test_three_equal_discs_collapse_below_the_critical_restitution(e: float) -> None:
    """Below e = 7 - 4 sqrt(3) three equal discs in line collide without end; above it they separate."""
    # S. McNamara and W. R. Young, Phys. Fluids A 4, 496 (1992). In float64 the collapse ends when the gaps are used up:
    # after more than 30 impacts, with the discs at one velocity. Above it they separate with speeds in order.
    discs = [disc_at(x, 0.0, v, r=0.25) for x, v in ((-1.5, 1.0), (0.0, 0.0), (1.75, -1.0))]
    trace = solve_pic(staged("collapse", *discs, restitution=e, duration_s=1000.0))
    speeds = trace.final_velocity_m_s[:, 0]
    if e < 7 - 4 * math.sqrt(3):
        assert len(trace.impacts) > 30
        assert np.max(speeds) - np.min(speeds) < 1e-9
    else:
        assert trace.outcome is Outcome.COMPLETED
        assert len(trace.impacts) < 30
        assert np.all(np.diff(speeds) > 0)
