from __future__ import annotations

from collections.abc import Callable

import pytest
from tests.lengths import long_after

from carom import Outcome, Scene, Trace, solve_pic, solve_pic_framewise
from carom.scenes import CatalogueScene, Tag, catalogue, deviation
from carom.trace import kinetic_energy

ENTRIES = list(catalogue().values())
each_entry = pytest.mark.parametrize("entry", ENTRIES, ids=lambda entry: entry.name)
each_pic = pytest.mark.parametrize("solve", [solve_pic, solve_pic_framewise])

#: Some ten thousand roundings: a chain of tens of impacts, each of tens of operations, on well-conditioned scenes.
ROUNDING = 1e-12


@each_pic
@each_entry
def test_pic_reproduces_the_known_answer(entry: CatalogueScene, solve: Callable[[Scene], Trace]) -> None:
    """Both forms of PIC agree with mathematics to rounding in every scene; each answer names its own source."""
    trace = solve(entry.scene)
    assert trace.outcome is Outcome.COMPLETED
    assert deviation(trace, entry.known, entry.scene) <= ROUNDING


@each_pic
@pytest.mark.parametrize("entry", [pytest.param(entry, id=entry.name) for entry in ENTRIES])
def test_pic_says_where_there_is_no_unique_answer(entry: CatalogueScene, solve: Callable[[Scene], Trace]) -> None:
    """An impact is reported as ambiguous in the scenes of shared simultaneous contact, and in no other."""
    assert bool(solve(entry.scene).ambiguous) == (Tag.CONVENTION in entry.tags)


@pytest.mark.parametrize("frame_rate_hz", long_after(1, [24.0, 7.0, 333.0]))
@each_entry
def test_the_frame_rate_is_nothing_to_algorithm_2(entry: CatalogueScene, frame_rate_hz: float) -> None:
    """PIC frame by frame (the paper's Algorithm 2) gives the known answer at any frame rate."""
    trace = solve_pic_framewise(entry.scene, frame_rate_hz=frame_rate_hz)
    assert deviation(trace, entry.known, entry.scene) <= ROUNDING


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
