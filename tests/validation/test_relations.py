"""Relations that need no truth, for PIC and PIT: what changes a scene in a known way changes its answer in that way.

Boost, rotation, mirror, relabelling, powers of two and reversal are tried on the whole catalogue in
``test_invariance.py``; here are the rest, and the very relations that `carom stress` measures of the engines.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from tests.rebuilt import in_units
from tests.stage import from_end

from carom import Disc, Scene, solve_pic, solve_pit
from carom.scenes import CatalogueScene, Tag, catalogue
from carom.studies.stress.relations import HOLDS, Relation, relations, rough_scene, superballs
from carom.trace import Trace, rim_speeds, velocities

STABLE = [entry for entry in catalogue().values() if not entry.tags & {Tag.CONVENTION, Tag.UNSTABLE, Tag.GRAVITY}]
each_stable = pytest.mark.parametrize("entry", STABLE, ids=lambda entry: entry.name)
FEWER = settings(max_examples=settings().max_examples // 5)
ROUNDING = 1e-12

each_relation = pytest.mark.parametrize("relation", relations(), ids=lambda relation: relation.name)


def growth(entry: CatalogueScene) -> float:
    """Return by how much a scene makes an error grow: the gas by some thousands in its forty impacts, others hardly."""
    return 1e4 if Tag.CONSERVED in entry.tags else 10.0


def with_discs(scene: Scene, discs: list[Disc], **fields: object) -> Scene:
    return Scene(**{**dict(scene), "discs": discs, **fields})


@each_relation
def test_pic_holds_every_relation(relation: Relation) -> None:
    """PIC holds each relation to a few hundred roundings, and those that change no digit to the bit."""
    deviation = relation.deviation(relation.base(), solve_pic)
    assert deviation <= 1e-13
    if relation.name.removeprefix("rough-") in {"mirror", "relabelling", "units-of-two", "far-disc"}:
        assert deviation == 0.0


@each_relation
def test_pit_holds_every_relation(relation: Relation) -> None:
    """Sampling changes what is found, but not by the unit, the frame of reference or the numbering."""
    assert relation.deviation(relation.base(), solve_pit) <= HOLDS


@pytest.mark.parametrize("change", [abs, lambda spins: 0.999 * spins])
def test_relations_see_wrong_spins(change: Callable[[NDArray[np.float64]], NDArray[np.float64]]) -> None:
    """A method that has all spins turn one way, or brakes them at the end, fails just the relations that say so."""

    def run(scene: Scene) -> Trace:
        trace = solve_pic(scene)
        if trace.final_spin_rad_s is None:
            return trace
        return dataclasses.replace(trace, final_spin_rad_s=change(trace.final_spin_rad_s))

    failed = {relation.name for relation in relations() if relation.deviation(relation.base(), run) > HOLDS}
    assert failed == {"rough-split", "superball-reversal"} | ({"rough-mirror"} if change is abs else set())


def test_the_rough_scenes_slide_and_grip() -> None:
    """Of the scene with friction two impacts slide and one grips; the superballs' all turn their slip round."""
    assert slips(solve_pic(rough_scene())) == pytest.approx([0.4, 0.0, 0.06], abs=0.01)
    assert slips(solve_pic(superballs())) == pytest.approx([-1.0, -1.0], abs=1e-12)


def slips(trace: Trace) -> list[float]:
    """Return the slip after each impact over the one before."""
    tangent = trace.impacts["normal"][:, ::-1] * [-1.0, 1.0]
    before, after = (
        np.sum((moving[0] - moving[1]) * tangent, axis=1) + rims[0] + rims[1]
        for moving, rims in ((velocities(trace.impacts, when), rim_speeds(trace, when)) for when in ("before", "after"))
    )
    return list(after / before)


@each_stable
@FEWER
@given(length=st.floats(1e-6, 1e6), time=st.floats(1e-6, 1e6), mass=st.floats(1e-6, 1e6))
def test_any_unit_will_do(entry: CatalogueScene, length: float, time: float, mass: float) -> None:
    """In units that are no powers of two every number is rounded anew, and nothing else changes."""
    scene = entry.scene
    speed = length / time
    plain, other = solve_pic(scene), solve_pic(in_units(scene, length=length, time=time, mass=mass))
    assert other.impacts[["first", "second"]].tolist() == plain.impacts[["first", "second"]].tolist()
    greatest = max(math.hypot(*disc.velocity_m_s) for disc in scene.discs)
    extent = max(abs(c) + disc.radius_m for disc in scene.discs for c in disc.position_m) + greatest * scene.duration_s
    bound = growth(entry) * ROUNDING
    assert np.max(np.abs(other.final_velocity_m_s / speed - plain.final_velocity_m_s)) <= bound * greatest
    assert np.max(np.abs(other.final_position_m / length - plain.final_position_m)) <= bound * extent


@each_stable
@FEWER
@given(part=st.floats(0.01, 0.99))
def test_a_run_may_be_split_anywhere(entry: CatalogueScene, part: float) -> None:
    """Stopped at any instant and begun again from the state there, a run ends where the whole run ends."""
    scene = entry.scene
    whole, half = solve_pic(scene), solve_pic(scene, until_s=part * scene.duration_s)
    rest = solve_pic(from_end(scene, half).model_copy(update={"duration_s": scene.duration_s * (1 - part)}))
    assert len(half.impacts) + len(rest.impacts) == len(whole.impacts)
    greatest = max(math.hypot(*disc.velocity_m_s) for disc in scene.discs) or 1.0
    extent = max(abs(c) + disc.radius_m for disc in scene.discs for c in disc.position_m) + greatest * scene.duration_s
    bound = growth(entry) * ROUNDING
    assert np.max(np.abs(rest.final_velocity_m_s - whole.final_velocity_m_s)) <= bound * greatest
    assert np.max(np.abs(rest.final_position_m - whole.final_position_m)) <= bound * extent


@each_stable
@FEWER
@given(far=st.floats(1e3, 1e9), radius=st.floats(0.01, 10), turn=st.floats(0, math.tau))
def test_a_disc_far_away_changes_no_bit(entry: CatalogueScene, far: float, radius: float, turn: float) -> None:
    """A disc that nothing reaches takes no part: impacts and final state of the others stay the same to the bit.

    Where there are walls it would have to lie behind them, so those scenes have nowhere for it.
    """
    scene = entry.scene
    if scene.walls:
        return
    stranger = Disc(position_m=(far * math.cos(turn), far * math.sin(turn)), radius_m=radius)
    plain, other = solve_pic(scene), solve_pic(with_discs(scene, [*scene.discs, stranger]))
    assert other.impacts.tobytes() == plain.impacts.tobytes()
    n = len(scene.discs)
    assert np.array_equal(other.final_position_m[:n], plain.final_position_m)
    assert np.array_equal(other.final_velocity_m_s[:n], plain.final_velocity_m_s)
