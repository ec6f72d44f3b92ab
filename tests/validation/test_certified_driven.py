"""Certified runs of what is driven and of what falls on what does not: sixty digits, rings as discs, turns, a crush."""

import math
import random
from typing import Any

import numpy as np
import pytest
from mpmath import mp
from tests.cases import each, release_after
from tests.scene_builders import build_crushed_rows, disc_at, drive_on_legs, require_value, staged, wall_at
from tests.validation.mpmath_runs import DIGITS, find_contradictions, run_brute_force
from tests.validation.test_driven import draw_mallets_scene

from carom import Chain, Disc, Scene, certify, solve_pic
from carom.model.trace import Outcome
from carom.model.walls import Ring
from carom.solvers.certified.result import Degenerate, Ending


@each("seeds", release_after(1, [range(10), range(10, 400)]))
def test_puck_among_mallets_matches_400_digit_runs(seeds: range) -> None:
    """Impacts of a rough puck among driven bodies are within their radii of brute force, and PIC's within 1e-8."""
    compared = 0
    for seed in seeds:
        scene = draw_mallets_scene(seed)
        certified, trace = certify(scene, max_impacts=6), solve_pic(scene, max_impacts=6)
        with mp.workdps(DIGITS):
            known = run_brute_force(scene, 6)
            assert find_contradictions(certified, known) == [], seed
        assert trace.impacts[["first", "second"]].tolist() == [(one.first, one.second) for one in known]
        found = [
            trace.impacts["time_s"],
            trace.impacts["velocity_first_after"],
            require_value(trace.spins)["first_after"],
        ]
        truth = [(float(one.time), [float(v) for v in one.after[:2]], float(one.spins[0])) for one in known]
        for numbers, exact in zip(found, zip(*truth, strict=True), strict=True):
            assert np.allclose(numbers, exact, rtol=0.0, atol=1e-8), seed
        compared += len(certified)
    assert compared > 2.5 * len(seeds)


def build_falling_scene(seed: int, *, as_rings: bool) -> Scene:
    """A disc that falls among three posts, driven or not, which are rings, or else discs of infinite mass."""
    rng = random.Random(seed)
    floor = wall_at(0.0, -5.0, 0.0, 1.0)
    posts: list[Any] = []
    for k in range(3):
        begins = (0.0, *sorted(rng.uniform(0.1, 2.0) for _ in range(rng.randint(0, 4))))
        legs = drive_on_legs(*((begin, (rng.gauss(0.0, 0.5), rng.gauss(0.0, 0.5))) for begin in begins))
        moves = legs if rng.random() < 0.5 else {}
        at, radius = (2.0 * (k - 1) + rng.uniform(-0.2, 0.2), rng.uniform(-2.0, -1.0)), rng.uniform(0.3, 0.6)
        if as_rings:
            posts.append(Ring(centre_m=at, radius_m=radius, **moves))
        else:
            driven = {"driven": True, **moves} if moves else {}
            posts.append(Disc(position_m=at, radius_m=radius, mass_kg=math.inf, **driven))
    puck = disc_at(rng.uniform(-1.0, 1.0), 1.0, rng.gauss(0.0, 0.5), r=0.25)
    laws = {"gravity_m_s2": (0.0, -4.0), "restitution": 0.9, "wall_restitution": 0.9, "duration_s": 9.0}
    laws |= {"friction": 0.25, "wall_friction": 0.25}
    walls = [floor, *posts] if as_rings else [floor]
    return staged("driven", puck, *([] if as_rings else posts), *walls, **laws)


@each("seeds", release_after(1, [range(3), range(3, 200)]))
def test_immovable_discs_and_rings_give_the_same_fall(seeds: range) -> None:
    """A disc that falls on immovable discs has the certified impacts of one that falls on rings of equal radius."""
    compared = 0
    for seed in seeds:
        discs, rings = (build_falling_scene(seed, as_rings=kind) for kind in (False, True))
        one, two, exact = certify(discs, max_impacts=6), certify(rings, max_impacts=6), solve_pic(discs, max_impacts=6)
        assert len(one) == len(two) == len(exact.impacts)
        for name in ("time_s", "velocity_first_after", "velocity_second_after"):
            off = np.abs(one.trace.impacts[name] - two.trace.impacts[name])
            assert np.all(off <= one.radii[name] + two.radii[name])
            assert np.allclose(one.trace.impacts[name], exact.impacts[name], rtol=1e-9, atol=1e-9)
        compared += len(one)
    assert compared > 2 * len(seeds)


@each("falls", [False, True])
def test_body_that_starts_moving_strikes_a_touching_disc_at_once(falls: bool) -> None:
    """A wall, edge or mallet that starts at 1 s at 2 m/s gives the disc it touches 4 m/s at exactly 1 s."""
    legs = drive_on_legs((0.0, (0.0, 0.0)), (1.0, (2.0, 0.0)), (1.5, (0.0, 1.0)))
    edge = Chain(points_m=[(0.0, -9.0), (0.0, 9.0)], **legs)
    mallet = disc_at(-0.5, 0.0, m=math.inf, driven=True, **legs)
    puck, laws = disc_at(0.25, 0.0, r=0.25), {"gravity_m_s2": (0.0, -float(falls)), "duration_s": 2.0}
    bodies = (wall_at(0.0, 0.0, 1.0, 0.0, **legs), edge, *(() if falls else (mallet,)))  # which the disc falls past
    for body in bodies:
        scene = staged("driven", puck, body, **laws)
        certified = certify(scene)
        assert certified.ending is Ending.COMPLETED
        assert certified.radii["time_s"].tolist() == [0.0]
        for trace in (certified.trace, solve_pic(scene)):
            assert trace.impacts["time_s"].tolist() == [1.0]
            assert trace.impacts["velocity_first_after"][0, 0] == 4.0
            assert trace.impacts["velocity_second_after"].tolist() == [[2.0, 0.0]]
            if body is mallet:  # 1 m, and half a metre up
                assert trace.final_position_m[1].tolist() == [0.5, 0.5]
                assert trace.final_velocity_m_s[1].tolist() == [0.0, 1.0]


def test_impact_at_the_change_of_a_leg_is_degenerate() -> None:
    """An impact at 2 s, when the wall changes its velocity, ends the certified run as AT_A_TURN."""
    # Ball arithmetic cannot decide on which side of the change the impact is.
    slope = Chain(points_m=[(-4.0, -3.0), (4.0, 3.0)])
    puck = disc_at(-25.0, 1.25, 25.0, r=1.0)  # it touches at the origin's (0, 1.25)
    legs = drive_on_legs((0.0, (0.0, 0.0)), (2.0, (-1.0, 0.0)))
    wall = wall_at(8.0, 0.0, -1.0, 0.0, **legs)  # its rim is 7 m from the disc's at the impact
    certified = certify(staged("driven", puck, slope, wall, duration_s=3.0))
    found = require_value(certified.degeneracy)
    assert certified.trace.impacts["time_s"].tolist() == [1.0]
    assert certified.trace.impacts["velocity_first_after"].tolist() == [[7.0, 24.0]]
    assert (found.kind, found.bodies) == (Degenerate.AT_A_TURN, (-2, 0))
    assert found.earliest_s <= 2.0 <= found.latest_s


def test_disc_between_closing_half_planes_ends_as_a_crush() -> None:
    """A disc between half-planes that close at 0.5 m/s ends the certified run as a crush at 3 s, without a proof."""
    walls = [wall_at(0.0, 0.0, 1.0, 0.0), wall_at(2.0, 0.0, -1.0, 0.0, velocity_m_s=(-0.5, 0.0))]
    puck = disc_at(1.0, 0.0, -1.0, 0.25, r=0.25)
    certified = certify(staged("driven", puck, *walls, duration_s=9.0))
    found = require_value(certified.degeneracy)
    assert (found.kind, found.bodies, found.proven) == (Degenerate.CRUSH, (-2, -1, 0), False)
    assert found.earliest_s < 3.0 == found.latest_s
    assert certified.trace.outcome is Outcome.CRUSHED is solve_pic(certified.trace.scene).outcome
    shorter = certify(certified.trace.scene.model_copy(update={"duration_s": 2.99}))
    assert shorter.degeneracy is None
    assert len(shorter.trace.impacts) > 256  # which is when a disc is looked at


def build_oblique_rows() -> list[tuple[Scene, float]]:
    """Rows on lines of slope 4/3 and 1, and when they are left no room: 5/4 of a height long, or its root of 2."""
    held: dict[str, Any] = {"r": 0.25, "m": math.inf, "driven": True}
    disc, comes = disc_at(0.75, 1.0, -0.75, -1.0, r=0.25), disc_at(1.5, 2.0, -0.375, -0.5, **held)
    edge = Chain(points_m=[(-2.0, 1.5), (2.0, -1.5)], half_width_m=0.0625)
    on_slope = disc_at(1.0, 1.3125, -1.0, -1.0, r=0.25), disc_at(2.25, 2.5625, -0.5, -0.5, **held)
    rows: list[tuple[Any, float]] = [
        ((disc, comes, disc_at(0.0, 0.0, **held)), 1.5 / 0.625),
        ((disc, comes, edge), (1.75 - 0.0625) / 0.625),
        ((*on_slope, wall_at(0.0, 0.3125, 1.0, 1.0)), (2.25 * math.sqrt(2.0) - 0.75) / math.sqrt(0.5)),
    ]
    return [(staged("aslant", *bodies, duration_s=5.0), crushed_s) for bodies, crushed_s in rows]


#: To begin with, the first along an axis, one between finite walls, and one aslant.
ROWS = [(*build_crushed_rows(), *build_oblique_rows())[k] for k in (0, -5, -3, *range(1, 9), 10, -2, -1)]


@each("scene, crushed_s", release_after(3, ROWS))
def test_closing_row_of_discs_ends_as_a_crush(scene: Scene, crushed_s: float) -> None:
    """A row of discs with no room left ends the certified run as a crush at the instant its free length is 0."""
    # PIC also ends as crushed, except in oblique rows, where rounding moves discs off the line.
    certified = certify(scene)
    found = require_value(certified.degeneracy)
    assert found.kind is Degenerate.CRUSH
    assert certified.trace.outcome is Outcome.CRUSHED
    assert found.earliest_s <= found.latest_s == pytest.approx(crushed_s, rel=1e-15)
    if scene.name != "aslant":
        trace, shorter = (solve_pic(scene.model_copy(update={"duration_s": end})) for end in (8.0, crushed_s - 0.125))
        assert trace.outcome is Outcome.CRUSHED
        assert float(trace.notes[0].rpartition(" at ")[2].removesuffix(" s")) == pytest.approx(crushed_s, rel=1e-15)
        assert trace.end_time_s <= crushed_s
        assert shorter.outcome is Outcome.COMPLETED  # till then impacts have a number
