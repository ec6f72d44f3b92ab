"""Symmetries of mechanics: what turns, mirrors, boosts, scales, relabels or reverses a scene does so to its answer."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.rebuilt import Map, rebuilt, same, turned
from tests.stage import from_end

from carom import Scene, Trace, solve_pic, solve_pic_framewise
from carom.scenes import CatalogueScene, KnownAnswer, Tag, catalogue, deviation
from carom.trace import Vector

ROUNDING = 1e-12

UNIQUE = [entry for entry in catalogue().values() if not entry.tags & {Tag.CONVENTION, Tag.GRAVITY}]
#: A scene at rest in its own frame only: walls and immovable discs single that frame out.
FREE = [entry for entry in UNIQUE if not entry.tags & {Tag.WALLS, Tag.IMMOVABLE}]
STABLE = [entry for entry in UNIQUE if Tag.UNSTABLE not in entry.tags]
#: Without an impact there is nothing to lead back through, and a start in contact would come back at the very end.
ELASTIC = [entry for entry in UNIQUE if not entry.tags & {Tag.INELASTIC, Tag.NO_IMPACT}]

#: Each property is tried on each of some twenty scenes, so a few examples of each make hundreds.
FEWER = settings(max_examples=settings().max_examples // 5)

each_unique = pytest.mark.parametrize("entry", UNIQUE, ids=lambda entry: entry.name)
each_pic = pytest.mark.parametrize("solve", [solve_pic, solve_pic_framewise])


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


@pytest.mark.parametrize("entry", STABLE, ids=lambda entry: entry.name)
@FEWER
@given(angle=st.floats(0, math.tau))
def test_a_turned_scene_has_the_turned_answer(entry: CatalogueScene, angle: float) -> None:
    """Space has no direction: turning a scene by any angle turns its answer, and no impact comes or goes.

    Not so for motion along a line that is unstable across it: along an axis no error across the line arises at all, but
    in any other direction rounding makes one, and it grows.
    """
    turn = turned(angle)
    scene = rebuilt(entry.scene, turn, turn, turn)
    assert deviation(solve_pic(scene), mapped(entry.known, turn, turn), scene) <= ROUNDING


@pytest.mark.parametrize("entry", FREE, ids=lambda entry: entry.name)
@FEWER
@given(boost=st.tuples(st.floats(-1, 1), st.floats(-1, 1)))
def test_a_moving_frame_sees_the_same_impacts(entry: CatalogueScene, boost: tuple[float, float]) -> None:
    """Galilean relativity: a velocity added to every disc moves the answer along and changes nothing else.

    The boost is measured in the scene's own greatest speed, so that no digit is lost to a large common velocity.
    """
    speed = max(math.hypot(*disc.velocity_m_s) for disc in entry.scene.discs)
    bx, by = boost[0] * speed, boost[1] * speed
    duration = entry.scene.duration_s

    def faster(v: Vector) -> Vector:
        return (v[0] + bx, v[1] + by)

    def carried(p: Vector) -> Vector:
        return (p[0] + bx * duration, p[1] + by * duration)

    scene = rebuilt(entry.scene, same, faster)
    assert deviation(solve_pic(scene), mapped(entry.known, carried, faster), scene) <= ROUNDING


@each_unique
@FEWER
@given(data=st.data())
def test_the_numbering_of_the_discs_is_nothing_to_the_physics(entry: CatalogueScene, data: st.DataObject) -> None:
    """Discs listed in another order have the same impacts at the same instants, to the bit, under their new numbers."""
    scene = entry.scene
    order = data.draw(st.permutations(range(len(scene.discs))))
    plain = solve_pic(scene)
    shuffled = solve_pic(scene.model_copy(update={"discs": tuple(scene.discs[old] for old in order)}))
    assert np.array_equal(shuffled.impacts["time_s"], plain.impacts["time_s"])
    for new, old in zip(shuffled.impacts, plain.impacts, strict=True):
        bodies = [b if b < 0 else order[b] for b in (new["first"], new["second"])]
        assert sorted(bodies) == sorted([old["first"], old["second"]])
    assert np.array_equal(shuffled.final_position_m, plain.final_position_m[list(order)])
    assert np.array_equal(shuffled.final_velocity_m_s, plain.final_velocity_m_s[list(order)])


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


@each_pic
@pytest.mark.parametrize("entry", ELASTIC, ids=lambda entry: entry.name)
def test_a_reversed_elastic_run_leads_back_to_its_start(entry: CatalogueScene, solve: Callable[[Scene], Trace]) -> None:
    """Elastic impacts know no direction of time: with all velocities reversed at the end, the start comes back.

    Impacts return in reverse order at mirrored times. The bound is not guessed: each impact may be off by some tens of
    roundings, and the way back makes an error grow by as much as a displacement of a disc there really grows.
    """
    scene = entry.scene
    there = solve(scene)
    reverse = from_end(scene, there, backwards=True)
    back = solve(reverse)
    roundings = 64 * len(there.impacts) * 2.0**-53
    extent = max(abs(c) + disc.radius_m for s in (scene, reverse) for disc in s.discs for c in disc.position_m)
    bound = roundings * amplification(reverse) * extent
    start = np.array([disc.position_m for disc in scene.discs])
    assert back.impacts[["first", "second"]].tolist() == there.impacts[["first", "second"]].tolist()[::-1]
    assert np.max(np.abs(back.final_position_m - start)) <= bound
