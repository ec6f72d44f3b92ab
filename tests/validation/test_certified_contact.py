"""Certified runs in contact: closed forms, runs of 60 digits by every branch, PIC, and what ends by name."""

import json
import math
import random
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf
from tests.cases import each, release_after
from tests.random_scenes import draw_slope_scene
from tests.scene_builders import disc_at, require_value, staged, wall_at
from tests.validation import contact_runs
from tests.validation.certified_files import from_enclosures
from tests.validation.mpmath_runs import find_outside_radii

from carom import CertifiedTrace, Chain, Disc, Mode, Scene, Trace, Wall, certify, solve_pic
from carom.catalogue import find_scenes
from carom.comparator.horizon import compute_horizon
from carom.model.trace import EdgeKind
from carom.solvers.certified.result import Degenerate, Ending
from carom.solvers.certified.serialisation import enclosures

#: What is left open of an end, metres, metres per second and radians per second.
NARROW = 1e-14


def find_fields_outside_radii(certified: CertifiedTrace, end: contact_runs.End) -> list[str]:
    """Return what of an end is not within its radius of the truth."""
    trace = certified.trace
    told: list[tuple[str, Any, Any, tuple[Any, ...]]] = [
        ("place", trace.final_position_m[0], certified.final_position_radius_m[0], end.place),
        ("velocity", trace.final_velocity_m_s[0], certified.final_velocity_radius_m_s[0], end.velocity),
    ]
    if trace.final_spin_rad_s is not None and certified.final_spin_radius_rad_s is not None:
        told.append(("spin", trace.final_spin_rad_s[:1], certified.final_spin_radius_rad_s[:1], (end.spin,)))
    if trace.modes is not None and certified.mode_radii is not None:
        times = trace.modes["time_s"], certified.mode_radii["time_s"]
        told.append(("changes", *times, tuple(end.changes) if len(end.changes) == len(times[0]) else ()))
    return [name for name, values, radii, truths in told if find_outside_radii(values, radii, truths, 30)]


def measure_pic_error(trace: Trace, end: contact_runs.End, *, decided: bool) -> float:
    """Return by how much PIC is off of an end: of places, velocities and spin; where decided, of when modes change."""
    modes = [] if trace.modes is None or not decided else trace.modes["time_s"].tolist()
    spin = 0.0 if trace.final_spin_rad_s is None else float(trace.final_spin_rad_s[0])
    told = [*trace.final_position_m[0].tolist(), *trace.final_velocity_m_s[0].tolist(), spin, *modes]
    truths = [*end.place, *end.velocity, end.spin, *(end.changes if decided else ())]
    return max(abs(float(one - truth)) for one, truth in zip(map(mpf, told), truths, strict=True))


def draw_contact_scene(seed: int) -> Scene:
    """Return a scene of one to three discs on a floor, a slope or edges, now and then begun in contact."""
    rng = random.Random(seed)
    walls: list[Wall | Chain] = [wall_at(0.0, 0.0, 0.0, 1.0)]
    if rng.random() < 0.3:
        end, rise = rng.uniform(2.9, 4.0), rng.uniform(-1.0, 1.0)
        walls = [Chain(points_m=((-6.0, 0.0), (end, 0.0), (end + 2.0, rise))[: rng.choice((2, 3))])]
    walls += [wall_at(-3.0, 0.0, 0.6, 0.8)] * rng.choice((0, 1))
    walls += [wall_at(7.0, 0.0, -1.0, 0.0)] * rng.choice((0, 1))
    discs = []
    for i in range(rng.choice((1, 1, 2, 3))):
        radius, u = rng.choice((0.5, 0.375)), rng.uniform(-4, 4)
        y, spin = rng.choice((radius, rng.uniform(0.5, 2.0))), rng.choice((0.0, rng.uniform(-6, 6)))
        disc = disc_at(-1.2 + 1.7 * i, y, u, r=radius, spin_rad_s=spin, inertia_factor=rng.choice((0.4, 0.5, 1.0)))
        discs.append(disc)
    return staged(
        f"contact {seed}",
        *discs,
        *walls,
        restitution=rng.choice((0.5, 0.9, 1.0)),
        wall_restitution=rng.choice((0.0, 0.3, 0.6)),
        wall_friction=rng.choice((0.0, 0.1, 0.4, 0.8)),
        wall_rolling_resistance=rng.choice((0.0, 0.02, 0.2, 0.6)),
        gravity_m_s2=(0.0, -10.0),
        duration_s=rng.uniform(0.5, 2.5),
    )


@each("first", release_after(1, range(0, 240, 12)))
def test_pic_matches_certified_ends_of_random_contact_scenes(first: int) -> None:
    """PIC's final positions of one to three discs are within 1e-9 m of each certified run that completes."""
    proven = 0
    for seed in range(first, first + 12):
        scene = draw_contact_scene(seed)
        certified = certify(scene, max_impacts=60)
        if certified.ending is not Ending.COMPLETED:
            continue
        trace = solve_pic(scene)
        assert np.abs(trace.final_position_m - certified.trace.final_position_m).max() < 1e-9, f"drawn({seed})"
        proven += 1
    assert proven > 4


@each(
    "disc, other, friction, meets_s",
    [
        (disc_at(0.0, 0.5, 1.0), disc_at(3.0, 0.125, r=0.125), 0.0, 2.5),
        (disc_at(0.0, 0.5, 3.0), disc_at(2.375, 0.5), 0.125, 0.5),
    ],
)
def test_discs_on_a_floor_meet_at_the_known_time(disc: Disc, other: Disc, friction: float, meets_s: float) -> None:
    """Discs on a floor meet 2 sqrt(r1 r2) apart along it, also while one slides at 3 m/s and slows down by 1 m/s^2."""
    laws = {"gravity_m_s2": (0.0, -8.0), "wall_friction": friction, "wall_restitution": 0.0}
    scene = staged("two", disc, other, wall_at(0.0, 0.0, 0.0, 1.0), **laws, duration_s=2.625)
    certified = certify(scene)
    ended = certified.degeneracy  # the large disc presses the small one on the floor
    found_s = float(certified.trace.impacts["time_s"][0]) if ended is None else ended.earliest_s
    assert [found_s, float(solve_pic(scene).impacts["time_s"][0])] == pytest.approx([meets_s, meets_s], rel=1e-15)


def test_disc_that_turns_back_leaves_the_beginning_of_its_edge() -> None:
    """A disc at 2 m/s, 1 m from the beginning of its edge, slows down by 2 m/s^2 and leaves after 1 + sqrt(2) s."""
    edge = Chain(points_m=[(0.0, 0.0), (9.0, 0.0)])
    scene = staged("back", disc_at(1.0, 0.5, 2.0), edge, gravity_m_s2=(-2.0, -8.0), duration_s=2.5)
    for trace in (certify(scene).trace, solve_pic(scene)):
        last = require_value(trace.modes)[-1]
        assert (Mode(last["after"]), last["time_s"]) == (Mode.FLIGHT, pytest.approx(1.0 + math.sqrt(2.0), rel=1e-15))


def test_more_digits_resolve_more_bounces() -> None:
    """With restitution 1/2, 6 digits resolve 15 to 24 bounces and 30 digits 90 to 110."""
    scene = find_scenes(["contact/drop"])[0].scene
    few, many = certify(scene, digits=6), certify(scene, digits=30)
    assert 15 <= len(few) <= 24
    assert 90 <= len(many) <= 110
    with mp.workdps(60):
        ends = 3 * mp.sqrt(mpf(2) / 10)
    for certified in (few, many):
        begun = float(require_value(certified.trace.modes)["time_s"][0])
        assert abs(mpf(begun) - ends) <= require_value(certified.mode_radii)["time_s"][0]


def test_sliding_disc_meets_another_vertex_of_its_wall() -> None:
    """A disc that slides at 2 m/s along a hooked chain meets its overhanging end at 1 s: resting contact."""
    hook = Chain(points_m=[(0.0, 0.0), (8.0, 0.0), (8.0, 3.0), (4.0, 0.8)])
    certified = certify(staged("hook", disc_at(1.6, 0.5, 2.0), hook, gravity_m_s2=(0.0, -4.0), duration_s=2.0))
    found = require_value(certified.degeneracy)
    assert (found.kind, found.bodies) == (Degenerate.RESTING_CONTACT, (-1, 0))
    assert found.latest_s == pytest.approx(1.0, rel=1e-15)


def test_slow_roll_over_an_edge_ends_as_an_edge_degeneracy() -> None:
    """A disc that rolls at 2 m/s, below sqrt(g R), over the end of an edge ends the run with a proven degeneracy."""
    (entry,) = find_scenes(["contact/edge"])
    disc = entry.scene.discs[0].model_copy(update={"velocity_m_s": (2.0, 0.0), "spin_rad_s": -4.0})
    certified = certify(Scene(**{**dict(entry.scene), "discs": [disc]}))
    found = require_value(certified.degeneracy)
    assert (found.kind, found.proven) == (Degenerate.EDGE, True)
    assert found.earliest_s <= 0.5 <= found.latest_s


def test_disc_falls_back_onto_the_vertex_it_left() -> None:
    """A disc that rolls off the end of a slope falls back and strikes the end vertex, as in PIC."""
    disc, slope = disc_at(0.1, 0.7, 2.0, 1.5, spin_rad_s=-5.0), Chain(points_m=((-1.0, -0.75), (1.0, 0.75)))
    laws = {"gravity_m_s2": (0.0, -6.0), "wall_friction": 0.9, "wall_restitution": 0.5}
    scene = staged("back", disc, slope, **laws, duration_s=0.42)
    certified, trace = certify(scene), solve_pic(scene)
    assert len(trace.impacts) == 1
    assert require_value(certified.trace.modes)["after"].tolist() == [Mode.ROLL, Mode.FLIGHT]
    assert require_value(certified.trace.edges)["kind"][0] == EdgeKind.VERTEX
    assert compute_horizon(certified, trace).covers_the_scene


@each("factor, steepest", [(math.inf, 0.75), (0.5, 0.25)])
def test_static_friction_threshold_is_exact_to_the_last_bit(factor: float, steepest: float) -> None:
    """Friction of exactly tan(slope) holds a block, a third of it rolls a disc; one float less lets either slide."""
    modes = []
    for friction in (steepest, math.nextafter(steepest, 0.0)):
        law = {"gravity_m_s2": (3.0, -4.0), "wall_friction": friction, "wall_restitution": 0.0}
        disc, floor = disc_at(0.0, 0.5, inertia_factor=factor), wall_at(0.0, 0.0, 0.0, 1.0)
        certified = certify(staged("holds", disc, floor, **law, duration_s=1.0))
        modes.append(Mode(require_value(certified.trace.modes)["after"][0]))
    assert modes == [Mode.REST if factor == math.inf else Mode.ROLL, Mode.SLIDE]


def test_contact_modes_and_spins_survive_serialisation() -> None:
    """Modes, spins and their radii are written, and reading and writing them again gives the same document."""
    for name, told in (("contact/lands-sliding", "modes mode_radii spins"), ("spin/slide", "spins spin_radii")):
        document = json.loads(json.dumps(enclosures(certify(find_scenes([name])[0].scene))))
        assert {*told.split(), "final_spin_rad_s"} <= document.keys()
        assert enclosures(from_enclosures(document)) == document


@each("seeds", release_after(1, [range(2), *(range(k, k + 20) for k in range(2, 402, 20))]))
@each("gives_back", [False, True])
def test_discs_on_slopes_match_60_digit_runs(gives_back: bool, seeds: range) -> None:
    """Certified ends and mode changes of discs on slopes are within their radii of 60-digit runs."""
    proven = 0
    with mp.workdps(contact_runs.DIGITS):
        for seed in seeds:
            scene = draw_slope_scene(seed, gives_back=gives_back)
            certified, trace, end = certify(scene), solve_pic(scene), contact_runs.run_contact_scene(scene)
            decided = certified.ending is Ending.COMPLETED
            assert (off := measure_pic_error(trace, end, decided=decided)) < 1e-12, f"PIC of {scene.name}: {off}"
            if decided:
                radii = certified.final_position_radius_m, certified.final_velocity_radius_m_s
                spins = certified.final_spin_radius_rad_s
                assert max(radius.max() for radius in (*radii, spins) if radius is not None) < NARROW
                assert find_fields_outside_radii(certified, end) == [], scene.name
                proven += 1
            else:
                assert require_value(certified.degeneracy).kind is Degenerate.COLLAPSE
    assert proven >= (0.85 if gives_back else 1.0) * len(seeds)


@each(
    "laws, inertia_factor, along, spin",
    [
        pytest.param((0.5, 0.375), 0.75, 3.5, 0.0, id="each bounce is at the limit between sliding and sticking"),
        pytest.param((0.25, 1.0), 0.5, 0.0, 1.0, id="the bound of the slip is exact"),
        pytest.param((0.125, 1.0), 0.5, 0.0, 2.0**-20, id="the slip is undecided after the first bounces"),
    ],
)
def test_bounces_that_reverse_slip_end_in_rolling(
    laws: tuple[float, float], inertia_factor: float, along: float, spin: float
) -> None:
    r"""A disc that has bounced on a level floor rolls at ``(u - k R w) / (1 + k)``.

    Friction acts at the contact, so ``u - k R w`` keeps its value. k is the inertia factor. Tangential restitution is
    1/2, and the bounces end with three digits.
    """
    restitution, friction = laws
    disc = disc_at(0.0, 2.5, along, spin_rad_s=spin, inertia_factor=inertia_factor)
    law = {"wall_restitution": restitution, "wall_friction": friction, "wall_tangential_restitution": 0.5}
    floor = wall_at(0.0, 0.0, 0.0, 1.0)
    certified = certify(staged("rolls", disc, floor, gravity_m_s2=(0.0, -4.0), **law, duration_s=4.0), digits=3)
    assert certified.ending is Ending.COMPLETED
    rolls = (along - inertia_factor * 0.5 * spin) / (1.0 + inertia_factor)
    assert certified.trace.final_velocity_m_s[0] == pytest.approx((rolls, 0.0), rel=1e-14)


@each(
    "bodies, other",
    [
        pytest.param((disc_at(0, -5.5, m=1e6), disc_at(0, 4.0 * 2.9**2 - 8.5, m=1e6)), 1, id="a heavy disc falls"),
        pytest.param((disc_at(0, -5.5, 1.0), wall_at(2.4 + math.sqrt(0.5), -10, -1, 1)), -2, id="a slope is ahead"),
    ],
)
def test_bounces_before_another_impact_are_all_applied(bodies: tuple[Any, ...], other: int) -> None:
    r"""A disc that bounces at 1, 2, 2.5, 2.75 and 2.875 s, and then meets another body, has these five bounces.

    It meets the other body at about 2.9 s, and its bounces would end at 3 s. With one digit, bounces from 2.75 s on
    are replaced by their sum if the disc certainly meets nothing else.
    """
    floor = wall_at(0.0, -10.0, 0.0, 1.0)
    law = {"gravity_m_s2": (0.0, -8.0), "wall_restitution": 0.5}
    impacts = certify(staged("struck", bodies[0], floor, *bodies[1:], **law, duration_s=3.0), digits=1).trace.impacts
    assert impacts["time_s"][:5].tolist() == [1.0, 2.0, 2.5, 2.75, 2.875]
    assert impacts["second"][:6].tolist() == [-1] * 5 + [other]
