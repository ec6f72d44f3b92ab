"""Every scene that has a name against its known answer, as PIC finds it whole and frame by frame."""

from __future__ import annotations

import numpy as np
import pytest
from tests.lengths import by_group, long_after

from carom import Outcome, solve_pic, solve_pic_framewise
from carom.scenes import CatalogueScene, Tag, catalogue, deviation, find_scenes
from carom.trace import kinetic_energy

#: Some ten thousand roundings: a chain of tens of impacts, each of tens of operations, on well-conditioned scenes.
ROUNDING = 1e-12
#: Where a scene goes through few.
BOUNDS = {"contact": 1e-14, "driven": 1e-14}
#: Where no answer goes on.
ENDS = {"driven/crush": Outcome.CRUSHED, "contact/pressed": Outcome.PRESSED, "contact/corner": Outcome.CORNER}
#: What changes the kinetic energy, and what has nothing to change it; a fall turns height into speed, see test_gravity.
NOT_KEPT = {Tag.INELASTIC, Tag.GRAVITY, Tag.NO_IMPACT}


@pytest.mark.parametrize("entries", by_group())
def test_pic_reproduces_the_known_answers(entries: list[CatalogueScene]) -> None:
    """PIC agrees with mathematics to rounding in every scene; each answer names its own source.

    Of a disc that is about to be crushed the place is known to what it flies in the last digit of the time. An impact
    is reported as ambiguous in the scenes of shared simultaneous contact, and in no other. Where every restitution is
    1, PIC ends after its impacts with the kinetic energy that the scene began with.
    """
    for entry in entries:
        trace, scene = solve_pic(entry.scene), entry.scene
        assert trace.outcome is ENDS.get(entry.name, Outcome.COMPLETED), entry.name
        assert bool(trace.ambiguous) == bool(entry.known.convention), entry.name
        crushed = trace.outcome is Outcome.CRUSHED
        flown = np.spacing(trace.end_time_s) * float(np.hypot(*trace.final_velocity_m_s.T).max()) if crushed else 0.0
        assert deviation(trace, entry.known, scene) <= BOUNDS.get(entry.group, ROUNDING) + flown, entry.name
        if entry.name in catalogue() and not entry.tags & NOT_KEPT:
            begun = kinetic_energy(scene, scene.arrays.velocity_m_s)
            assert len(trace.impacts), entry.name  # or nothing could change it
            assert kinetic_energy(scene, trace.final_velocity_m_s) == pytest.approx(begun, rel=ROUNDING), entry.name


@pytest.mark.parametrize("frame_rate_hz", long_after(1, [None, 24.0, 7.0, 333.0]))
@pytest.mark.parametrize("entries", by_group("issues", "contact", "engines", "spin", "tables", "driven"))
def test_algorithm_2_has_the_bits_of_pic_at_any_frame_rate(
    entries: list[CatalogueScene], frame_rate_hz: float | None
) -> None:
    """PIC frame by frame (the paper's Algorithm 2) gives the same impacts and the same end."""
    for entry in entries:
        whole, framewise = solve_pic(entry.scene), solve_pic_framewise(entry.scene, frame_rate_hz=frame_rate_hz)
        assert framewise.impacts.tobytes() == whole.impacts.tobytes(), entry.name
        assert framewise.final_position_m.tobytes() == whole.final_position_m.tobytes(), entry.name
        assert (framewise.outcome, framewise.ambiguous) == (whole.outcome, whole.ambiguous), entry.name


def test_the_known_answers_see_a_wrong_law() -> None:
    """Without friction, or with the other admissible order of the corner's walls, no scene of spin has its answer."""
    for entry in find_scenes(["spin"]):
        bare = entry.scene.model_copy(update={"friction": 0.0, "wall_friction": 0.0})
        if entry.name != "spin/gearing":  # in which friction does nothing
            assert deviation(solve_pic(bare), entry.known, entry.scene) > 1e-3, entry.name


def test_the_gas_is_a_test_at_all() -> None:
    """The gas has many impacts of both kinds, so that its conserved energy says something."""
    impacts = solve_pic(catalogue()["classics/gas"].scene).impacts
    assert (impacts["second"] >= 0).sum() >= 16
    assert (impacts["second"] < 0).sum() >= 16
