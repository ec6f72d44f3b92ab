"""Certified runs in contact: closed forms, runs of 60 digits by every branch, PIC, and what ends by name."""

import json
import math
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf
from tests.cases import each, release_after
from tests.random_scenes import thrown
from tests.scene_builders import disc_at, staged, sure, wall_at
from tests.validation import contact_runs, contact_scenes
from tests.validation.certified_files import from_enclosures
from tests.validation.mpmath_runs import outside

from carom import CertifiedTrace, Chain, Mode, Scene, Trace, Wall, certify, solve_pic
from carom.catalogue import find_scenes
from carom.comparator.horizon import compute_horizon
from carom.model.trace import EdgeKind
from carom.solvers.certified.result import Degenerate, Ending
from carom.solvers.certified.serialisation import enclosures

#: What is left open of an end, metres, metres a second and radians a second.
NARROW = 1e-14


def widest(certified: CertifiedTrace) -> float:
    radii = [certified.final_position_radius_m, certified.final_velocity_radius_m_s]
    radii += [] if certified.final_spin_radius_rad_s is None else [certified.final_spin_radius_rad_s]
    return max(float(radius.max()) for radius in radii)


def beyond(certified: CertifiedTrace, end: contact_runs.End) -> list[str]:
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
    return [name for name, values, radii, truths in told if outside(values, radii, truths, 30)]


def apart(trace: Trace, end: contact_runs.End, *, decided: bool) -> float:
    """Return by how much PIC is off of an end: of places, velocities and spin; where decided, of when modes change."""
    modes = [] if trace.modes is None or not decided else trace.modes["time_s"].tolist()
    spin = 0.0 if trace.final_spin_rad_s is None else float(trace.final_spin_rad_s[0])
    told = [*trace.final_position_m[0].tolist(), *trace.final_velocity_m_s[0].tolist(), spin, *modes]
    truths = [*end.place, *end.velocity, end.spin, *(end.changes if decided else ())]
    return max(abs(float(one - truth)) for one, truth in zip(map(mpf, told), truths, strict=True))


#: Speeds along a slope of two discs, friction, and rolling resistance: in the end both discs do the same.
ALIKE = {"smooth": (-1.0, 1.0, 0.0, 0.0), "resists": (-0.5, 0.5, 0.5, 0.1)}


@each("name", ALIKE)
def test_discs_that_come_to_fall_alike_along_a_slope_never_meet_there(name: str) -> None:
    """One has turned and the other never did: their speeds differ by a constant, so that they part is decided."""
    upper, lower, friction, resistance = ALIKE[name]
    nx, ny = math.sin(0.3), math.cos(0.3)
    discs = [
        disc_at(place * ny + nx / 2, ny / 2 - place * nx, speed * ny, -speed * nx)
        for place, speed in ((0.0, upper), (3.0, lower))
    ]
    fields = {"gravity_m_s2": (0.0, -3.0), "wall_friction": friction, "wall_rolling_resistance": resistance}
    scene = staged(name, *discs, wall_at(0.0, 0.0, nx, ny), **fields, duration_s=20.0)
    certified, trace = certify(scene), solve_pic(scene)
    assert certified.ending is Ending.COMPLETED
    assert np.abs(trace.final_position_m - certified.trace.final_position_m).max() < 1e-11


def test_a_run_of_another_friction_is_beyond_the_radii() -> None:
    """With friction that is one part in 10^14 larger, a sliding disc ends elsewhere than is proven."""
    scene = find_scenes(["contact/slide-to-roll"])[0].scene
    other = Scene(**{**dict(scene), "wall_friction": scene.wall_friction * (1 + 1e-14)})
    with mp.workdps(contact_runs.DIGITS):
        assert beyond(certify(scene), contact_runs.run(scene)) == []
        assert beyond(certify(scene), contact_runs.run(other)) != []


@each("first", release_after(1, range(0, 240, 12)))
def test_one_to_three_discs_end_where_pic_has_them(first: int) -> None:
    """On edges, slopes and between walls: what is proven to the end is PIC's, and that is most."""
    proven = 0
    for seed in range(first, first + 12):
        scene = contact_scenes.drawn(seed)
        certified = certify(scene, max_impacts=60)
        if certified.ending is not Ending.COMPLETED:
            continue
        trace = solve_pic(scene)
        assert np.abs(trace.final_position_m - certified.trace.final_position_m).max() < 1e-9, f"drawn({seed})"
        proven += 1
    assert proven > 4


def test_bounces_are_told_as_far_as_the_digits_tell_them_apart() -> None:
    """Dropped with e = 1/2, each hop half of the last: 3 to 4 bounces a digit, and the end by the series."""
    scene = find_scenes(["contact/drop"])[0].scene
    few, many = certify(scene, digits=6), certify(scene, digits=30)
    assert 15 <= len(few) <= 24
    assert 90 <= len(many) <= 110
    with mp.workdps(60):
        ends = 3 * mp.sqrt(mpf(2) / 10)
    for certified in (few, many):
        assert certified.mode_radii is not None
        assert abs(mpf(float(sure(certified.trace.modes)["time_s"][0])) - ends) <= certified.mode_radii["time_s"][0]


def test_a_landing_on_a_slope_keeps_what_friction_can_not_change() -> None:
    """Friction takes no part of ``2 u - R w``, and a third of this is rolling: at three digits, too."""
    pull = (10 * math.sin(0.3), -10 * math.cos(0.3))
    laws = {"wall_restitution": 0.5, "wall_friction": 1.0, "wall_tangential_restitution": 0.5}
    scene = staged("slope", disc_at(0.0, 1.0, 0.3), wall_at(0, 0, 0, 1), gravity_m_s2=pull, **laws, duration_s=4.0)
    certified = certify(scene, digits=3)
    assert certified.ending is Ending.COMPLETED
    assert certified.trace.final_velocity_m_s[0, 0] == pytest.approx(2 * (0.3 + 4 * pull[0]) / 3, rel=1e-14)


def test_a_disc_that_slides_on_a_face_meets_another_vertex_of_the_same_wall() -> None:
    """The wall bends back over its floor: its end, .3 m above the centre, is met .4 m before, after 2 m at 2 m/s."""
    hook = Chain(points_m=[(0.0, 0.0), (8.0, 0.0), (8.0, 3.0), (4.0, 0.8)])
    certified = certify(staged("hook", disc_at(1.6, 0.5, 2.0), hook, gravity_m_s2=(0.0, -4.0), duration_s=2.0))
    assert certified.degeneracy is not None
    assert (certified.degeneracy.kind, certified.degeneracy.bodies) == (Degenerate.RESTING_CONTACT, (-1, 0))
    assert certified.degeneracy.latest_s == pytest.approx(1.0, rel=1e-15)


def test_a_disc_that_rolls_slowly_over_an_edge_ends_by_name() -> None:
    """At 2 m/s, below sqrt(g R), it does not fly off; the edge's end is named."""
    (entry,) = find_scenes(["contact/edge"])
    disc = entry.scene.discs[0].model_copy(update={"velocity_m_s": (2.0, 0.0), "spin_rad_s": -4.0})
    certified = certify(Scene(**{**dict(entry.scene), "discs": [disc]}))
    assert certified.degeneracy is not None
    assert certified.degeneracy.kind is Degenerate.EDGE
    assert certified.degeneracy.proven
    assert certified.degeneracy.earliest_s <= 0.5 <= certified.degeneracy.latest_s


def test_a_disc_that_comes_back_to_the_vertex_it_has_left_meets_it() -> None:
    """Rolling up to the end of a slope it flies off, falls back and strikes the vertex, as PIC has it."""
    disc = disc_at(0.1, 0.7, 2.0, 1.5, spin_rad_s=-5.0)
    scene = Scene(
        name="back",
        discs=[disc],
        walls=[Chain(points_m=((-1.0, -0.75), (1.0, 0.75)))],
        gravity_m_s2=(0.0, -6.0),
        wall_friction=0.9,
        wall_restitution=0.5,
        duration_s=0.42,
    )
    certified, trace = certify(scene), solve_pic(scene)
    assert len(trace.impacts) == 1
    assert sure(certified.trace.modes)["after"].tolist() == [Mode.ROLL, Mode.FLIGHT]
    assert sure(certified.trace.edges)["kind"][0] == EdgeKind.VERTEX
    assert compute_horizon(certified, trace).covers_the_scene


@each("factor, steepest", [(math.inf, 0.75), (0.5, 0.25)])
def test_friction_holds_to_the_last_bit(factor: float, steepest: float) -> None:
    """Under gravity of (3, -4) a floor of friction 3/4 holds a block, one of 1/4 a disc, and with less neither."""
    modes = []
    for friction in (steepest, math.nextafter(steepest, 0.0)):
        law = {"gravity_m_s2": (3.0, -4.0), "wall_friction": friction, "wall_restitution": 0.0}
        disc, floor = disc_at(0.0, 0.5, inertia_factor=factor), wall_at(0.0, 0.0, 0.0, 1.0)
        certified = certify(staged("holds", disc, floor, **law, duration_s=1.0))
        modes.append(Mode(sure(certified.trace.modes)["after"][0]))
    assert modes == [Mode.REST if factor == math.inf else Mode.ROLL, Mode.SLIDE]


def test_a_disc_that_does_not_bounce_lies_on_the_floor_also_where_something_is_driven() -> None:
    """All its numbers are exact, with a wall that moves away far off: it falls for 1 s, and stays where it lands."""
    wall = Wall(point_m=(9.0, 0.0), normal=(-1.0, 0.0), velocity_m_s=(1.0, 0.0))
    disc, floor = disc_at(0.0, 5.5), wall_at(0.0, 0.0, 0.0, 1.0)
    scene = staged("drop", disc, floor, wall, gravity_m_s2=(0.0, -10.0), wall_restitution=0.0, duration_s=3.0)
    certified = certify(scene)
    assert certified.ending is Ending.COMPLETED
    assert certified.trace.final_position_m.tolist() == [[0.0, 0.5]]


def test_contact_and_spins_survive_as_data() -> None:
    """Modes, spins and their radii are written and read with the rest."""
    for name, told in (("contact/lands-sliding", "modes mode_radii spins"), ("spin/slide", "spins spin_radii")):
        document = json.loads(json.dumps(enclosures(certify(find_scenes([name])[0].scene))))
        assert {*told.split(), "final_spin_rad_s"} <= document.keys()
        assert enclosures(from_enclosures(document)) == document


@each("seeds", release_after(1, [range(4), *(range(k, k + 20) for k in range(4, 404, 20))]))
@each("gives_back", [False, True])
def test_discs_thrown_on_slopes_are_within_their_radii_of_runs_of_60_digits(gives_back: bool, seeds: range) -> None:
    """With spin, any friction and rolling resistance, or friction that gives back: ends, and when modes change."""
    proven = 0
    with mp.workdps(contact_runs.DIGITS):
        for seed in seeds:
            scene = thrown(seed, gives_back=gives_back)
            certified, trace, end = certify(scene), solve_pic(scene), contact_runs.run(scene)
            decided = certified.ending is Ending.COMPLETED
            assert (off := apart(trace, end, decided=decided)) < 1e-12, f"PIC of {scene.name}: {off}"
            if decided:
                assert widest(certified) < NARROW
                assert beyond(certified, end) == [], scene.name
                proven += 1
            else:
                assert certified.degeneracy is not None
                assert certified.degeneracy.kind is Degenerate.COLLAPSE
    assert proven >= (0.85 if gives_back else 1.0) * len(seeds)
