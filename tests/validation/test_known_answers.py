"""Every scene that has a name against its known answer, as PIC finds it whole and frame by frame."""

from __future__ import annotations

import numpy as np
import pytest
from tests.lengths import long_after, sampled

from carom import Outcome, solve_pic, solve_pic_framewise
from carom.scenes import CatalogueScene, Tag, all_scenes, catalogue, deviation
from carom.trace import kinetic_energy

ENTRIES = list(catalogue().values())
each_scene = pytest.mark.parametrize("entry", all_scenes().values(), ids=lambda entry: entry.name)

#: Some ten thousand roundings: a chain of tens of impacts, each of tens of operations, on well-conditioned scenes.
ROUNDING = 1e-12
#: Where a scene goes through few.
BOUNDS = {"contact": 1e-14, "driven": 1e-14}
#: Where no answer goes on.
ENDS = {"driven/crush": Outcome.CRUSHED, "contact/pressed": Outcome.PRESSED, "contact/corner": Outcome.CORNER}


@each_scene
def test_pic_reproduces_the_known_answer(entry: CatalogueScene) -> None:
    """PIC agrees with mathematics to rounding in every scene; each answer names its own source.

    Of a disc that is about to be crushed the place is known to what it flies in the last digit of the time. An impact
    is reported as ambiguous in the scenes of shared simultaneous contact, and in no other.
    """
    trace = solve_pic(entry.scene)
    assert trace.outcome is ENDS.get(entry.name, Outcome.COMPLETED)
    assert bool(trace.ambiguous) == bool(entry.known.convention)
    crushed = trace.outcome is Outcome.CRUSHED
    flown = np.spacing(trace.end_time_s) * float(np.hypot(*trace.final_velocity_m_s.T).max()) if crushed else 0.0
    assert deviation(trace, entry.known, entry.scene) <= BOUNDS.get(entry.group, ROUNDING) + flown


@pytest.mark.parametrize("frame_rate_hz", long_after(1, [None, 24.0, 7.0, 333.0]))
@pytest.mark.parametrize("entry", sampled("issues", "contact", "engines", "spin", "tables", "driven"))
def test_algorithm_2_has_the_bits_of_pic_at_any_frame_rate(entry: CatalogueScene, frame_rate_hz: float | None) -> None:
    """PIC frame by frame (the paper's Algorithm 2) gives the same impacts and the same end."""
    whole, framewise = solve_pic(entry.scene), solve_pic_framewise(entry.scene, frame_rate_hz=frame_rate_hz)
    assert framewise.impacts.tobytes() == whole.impacts.tobytes()
    assert framewise.final_position_m.tobytes() == whole.final_position_m.tobytes()
    assert (framewise.outcome, framewise.ambiguous) == (whole.outcome, whole.ambiguous)


#: Where every restitution is 1 and something collides; a fall turns height into speed: see test_gravity.
ELASTIC = [entry for entry in ENTRIES if not entry.tags & {Tag.INELASTIC, Tag.GRAVITY, Tag.NO_IMPACT}]


@pytest.mark.parametrize("entry", ELASTIC, ids=lambda entry: entry.name)
def test_elastic_scenes_keep_their_energy(entry: CatalogueScene) -> None:
    """Where every restitution is 1, PIC ends after its impacts with the kinetic energy that the scene began with."""
    scene = entry.scene
    start = 0.5 * sum(
        disc.mass_kg * (disc.velocity_m_s[0] ** 2 + disc.velocity_m_s[1] ** 2)
        for disc in scene.discs
        if not disc.immovable
    )
    trace = solve_pic(scene)
    assert len(trace.impacts)  # or nothing could change it
    assert kinetic_energy(scene, trace.final_velocity_m_s) == pytest.approx(start, rel=ROUNDING)


def test_the_gas_is_a_test_at_all() -> None:
    """The gas has many impacts of both kinds, so that its conserved energy says something."""
    impacts = solve_pic(catalogue()["classics/gas"].scene).impacts
    assert (impacts["second"] >= 0).sum() >= 16
    assert (impacts["second"] < 0).sum() >= 16
