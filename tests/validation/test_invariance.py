"""Symmetries of mechanics, and relations that need no truth: what changes a scene in a known way does so to its answer.

A scene is turned, boosted, renumbered, reversed, split, measured in other units, and given a disc far away, over the
catalogue; mirrors and powers of two, which change no bit, are in ``test_equivalences.py``. Last come the very relations
that `carom stress` measures of the engines.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from tests.rebuilt import Map, in_units, rebuilt, same, turned
from tests.stage import from_end

from carom import Disc, Scene, Trace, solve_pic, solve_pit
from carom.scenes import CatalogueScene, KnownAnswer, Tag, catalogue, deviation
from carom.studies.stress.relations import HOLDS, relations, rough_scene, superballs
from carom.trace import Vector, rim_speeds, velocities

ROUNDING = 1e-12

UNIQUE = [entry for entry in catalogue().values() if not entry.tags & {Tag.CONVENTION, Tag.GRAVITY}]
#: A scene at rest in its own frame only: walls and immovable discs single that frame out.
FREE = [entry for entry in UNIQUE if not entry.tags & {Tag.WALLS, Tag.IMMOVABLE}]
STABLE = [entry for entry in UNIQUE if Tag.UNSTABLE not in entry.tags]
#: Without an impact there is nothing to lead back through, and a start in contact would come back at the very end.
ELASTIC = [entry for entry in UNIQUE if not entry.tags & {Tag.INELASTIC, Tag.NO_IMPACT}]

#: Each property is tried on each of some twenty scenes, so a few examples make hundreds.
FEWER = settings(max_examples=settings().max_examples // 5)


def mapped(known: KnownAnswer, position: Map, velocity: Map) -> KnownAnswer:
    """Return the answer with every vector mapped. A wall stays at rest."""
    impacts = tuple(
        replace(
            impact,
            velocity_first_after=None if (v := impact.velocity_first_after) is None else velocity(v),
            velocity_second_after=None if (v := impact.velocity_second_after) is None else velocity(v),
        )
        for impact in known.impacts
    )
    velocities, positions = known.final_velocity_m_s, known.final_position_m
    return replace(
        known,
        impacts=impacts,
        final_velocity_m_s=None if velocities is None else tuple(map(velocity, velocities)),
        final_position_m=None if positions is None else tuple(map(position, positions)),
    )


@FEWER
@given(angle=st.floats(0, math.tau))
def test_a_turned_scene_has_the_turned_answer(angle: float) -> None:
    """Space has no direction: turning a scene by any angle turns its answer, and no impact comes or goes.

    Not so for motion along a line that is unstable across it: along an axis no error across the line arises at all, but
    in any other direction rounding makes one, and it grows.
    """
    turn = turned(angle)
    for entry in STABLE:
        scene = rebuilt(entry.scene, turn, turn, turn)
        assert deviation(solve_pic(scene), mapped(entry.known, turn, turn), scene) <= ROUNDING, entry.name


@FEWER
@given(boost=st.tuples(st.floats(-1, 1), st.floats(-1, 1)))
def test_a_moving_frame_sees_the_same_impacts(boost: tuple[float, float]) -> None:
    """Galilean relativity: a velocity added to every disc moves the answer along and changes nothing else.

    The boost is measured in the scene's own greatest speed, so that no digit is lost to a large common velocity.
    """
    for entry in FREE:
        speed, duration = fastest(entry.scene), entry.scene.duration_s
        bx, by = boost[0] * speed, boost[1] * speed

        def faster(v: Vector, bx: float = bx, by: float = by) -> Vector:
            return (v[0] + bx, v[1] + by)

        def carried(p: Vector, x: float = bx * duration, y: float = by * duration) -> Vector:
            return (p[0] + x, p[1] + y)

        scene = rebuilt(entry.scene, same, faster)
        assert deviation(solve_pic(scene), mapped(entry.known, carried, faster), scene) <= ROUNDING, entry.name


@FEWER
@given(seed=st.integers(0, 10**6))
def test_the_numbering_of_the_discs_is_nothing_to_the_physics(seed: int) -> None:
    """Discs listed in another order have the same impacts at the same instants, to the bit, under their new numbers."""
    for entry in UNIQUE:
        scene = entry.scene
        order = random.Random(seed).sample(range(len(scene.discs)), len(scene.discs))
        plain = solve_pic(scene)
        shuffled = solve_pic(scene.model_copy(update={"discs": tuple(scene.discs[old] for old in order)}))
        assert np.array_equal(shuffled.impacts["time_s"], plain.impacts["time_s"]), entry.name
        for new, old in zip(shuffled.impacts, plain.impacts, strict=True):
            bodies = [b if b < 0 else order[b] for b in (new["first"], new["second"])]
            assert sorted(bodies) == sorted([old["first"], old["second"]]), entry.name
        assert np.array_equal(shuffled.final_position_m, plain.final_position_m[order]), entry.name
        assert np.array_equal(shuffled.final_velocity_m_s, plain.final_velocity_m_s[order]), entry.name


def amplification(scene: Scene) -> float:
    """Return by how much a small displacement of one disc at the start has grown at most, anywhere, at the end."""
    nudge = 2.0**-30
    plain = solve_pic(scene).final_position_m
    greatest = 1.0
    for i, disc in enumerate(scene.discs):
        for dx, dy in ((nudge, 0.0), (0.0, nudge)):
            moved = disc.model_copy(update={"position_m": (disc.position_m[0] + dx, disc.position_m[1] + dy)})
            nudged = scene.model_copy(update={"discs": (*scene.discs[:i], moved, *scene.discs[i + 1 :])})
            apart = np.abs(solve_pic(nudged).final_position_m - plain)
            greatest = max(greatest, float(np.max(apart)) / nudge)
    return greatest


def test_a_reversed_elastic_run_leads_back_to_its_start() -> None:
    """Elastic impacts know no direction of time: with all velocities reversed at the end, the start comes back.

    Impacts return in reverse order at mirrored times. The bound is not guessed: each impact may be off by some tens of
    roundings, and the way back makes an error grow by as much as a displacement of a disc there really grows.
    """
    for entry in ELASTIC:
        scene = entry.scene
        there = solve_pic(scene)
        reverse = from_end(scene, there, backwards=True)
        back = solve_pic(reverse)
        roundings = 64 * len(there.impacts) * 2.0**-53
        extent = max(abs(c) + disc.radius_m for s in (scene, reverse) for disc in s.discs for c in disc.position_m)
        bound = roundings * amplification(reverse) * extent
        start = np.array([disc.position_m for disc in scene.discs])
        assert back.impacts[["first", "second"]].tolist() == there.impacts[["first", "second"]].tolist()[::-1]
        assert np.max(np.abs(back.final_position_m - start)) <= bound, entry.name


def fastest(scene: Scene) -> float:
    return max(math.hypot(*disc.velocity_m_s) for disc in scene.discs)


def assert_same_end(entry: CatalogueScene, position: NDArray[np.float64], velocity: NDArray[np.float64]) -> None:
    """Assert that a run of a scene ends where PIC ends, to what rounding grows to.

    The gas makes an error grow by some thousands in its forty impacts, other scenes hardly.
    """
    scene, whole = entry.scene, solve_pic(entry.scene)
    bound = (1e4 if Tag.CONSERVED in entry.tags else 10.0) * ROUNDING
    greatest = fastest(scene) or 1.0
    extent = max(abs(c) + disc.radius_m for disc in scene.discs for c in disc.position_m) + greatest * scene.duration_s
    assert np.max(np.abs(velocity - whole.final_velocity_m_s)) <= bound * greatest, entry.name
    assert np.max(np.abs(position - whole.final_position_m)) <= bound * extent, entry.name


@FEWER
@given(length=st.floats(1e-6, 1e6), time=st.floats(1e-6, 1e6), mass=st.floats(1e-6, 1e6))
def test_any_unit_will_do(length: float, time: float, mass: float) -> None:
    """In units that are no powers of two every number is rounded anew, and nothing else changes."""
    for entry in STABLE:
        other = solve_pic(in_units(entry.scene, length=length, time=time, mass=mass))
        plain = solve_pic(entry.scene)
        assert other.impacts[["first", "second"]].tolist() == plain.impacts[["first", "second"]].tolist(), entry.name
        assert_same_end(entry, other.final_position_m / length, other.final_velocity_m_s / (length / time))


@FEWER
@given(part=st.floats(0.01, 0.99))
def test_a_run_may_be_split_anywhere(part: float) -> None:
    """Stopped at any instant and begun again from the state there, a run ends where the whole run ends."""
    for entry in STABLE:
        scene = entry.scene
        whole, half = solve_pic(scene), solve_pic(scene, until_s=part * scene.duration_s)
        rest = solve_pic(from_end(scene, half).model_copy(update={"duration_s": scene.duration_s * (1 - part)}))
        assert len(half.impacts) + len(rest.impacts) == len(whole.impacts), entry.name
        assert_same_end(entry, rest.final_position_m, rest.final_velocity_m_s)


@FEWER
@given(far=st.floats(1e3, 1e9), radius=st.floats(0.01, 10), turn=st.floats(0, math.tau))
def test_a_disc_far_away_changes_no_bit(far: float, radius: float, turn: float) -> None:
    """A disc that nothing reaches takes no part: impacts and final state of the others stay the same to the bit.

    Where there are walls it would have to lie behind them, so those scenes have nowhere for it.
    """
    stranger = Disc(position_m=(far * math.cos(turn), far * math.sin(turn)), radius_m=radius)
    for entry in (entry for entry in STABLE if not entry.scene.walls):
        scene, n = entry.scene, len(entry.scene.discs)
        plain, other = solve_pic(scene), solve_pic(Scene(**{**dict(scene), "discs": [*scene.discs, stranger]}))
        assert other.impacts.tobytes() == plain.impacts.tobytes(), entry.name
        assert np.array_equal(other.final_position_m[:n], plain.final_position_m), entry.name
        assert np.array_equal(other.final_velocity_m_s[:n], plain.final_velocity_m_s), entry.name


# The relations of `carom stress` --------------------------------------------------------------------------------------


def test_pic_holds_every_relation() -> None:
    """PIC holds each relation to a few hundred roundings, and those that change no digit to the bit."""
    for relation in relations():
        off = relation.deviation(relation.base(), solve_pic)
        assert off <= 1e-13, relation.name
        if relation.name.removeprefix("rough-") in {"mirror", "relabelling", "units-of-two", "far-disc"}:
            assert off == 0.0, relation.name


def test_pit_holds_every_relation() -> None:
    """Sampling changes what is found, but not by the unit, the frame of reference or the numbering."""
    for relation in relations():
        assert relation.deviation(relation.base(), solve_pit) <= HOLDS, relation.name


@pytest.mark.parametrize("change", [abs, lambda spins: 0.999 * spins])
def test_relations_see_wrong_spins(change: Callable[[NDArray[np.float64]], NDArray[np.float64]]) -> None:
    """A method that has all spins turn one way, or brakes them at the end, fails just the relations that say so."""

    def run(scene: Scene) -> Trace:
        trace = solve_pic(scene)
        if trace.final_spin_rad_s is None:
            return trace
        return replace(trace, final_spin_rad_s=change(trace.final_spin_rad_s))

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
