"""Driven walls and discs against what knows nothing of them: Galileo, fractions, sixty digits, and books of energy."""

from __future__ import annotations

import math
import random
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from mpmath import mp
from tests.lengths import each, long_after
from tests.stage import crushed_rows, disc_at, staged, wall_at
from tests.validation.mpmath_runs import brute_force

from carom import Chain, Disc, Outcome, Ring, Scene, Trace, Wall, solve_pic, solve_pit
from carom.scenes import find_scenes
from carom.trace import kinetic_energy, work_of_driven

Vector = tuple[float, float]


def half_plane(x: float, nx: float, speed: float = 0.0) -> Wall:
    """A half-plane across the x axis, driven along it."""
    return wall_at(x, 0.0, nx, 0.0, velocity_m_s=(speed, 0.0))


# --- Galileo ---


def a_table(seed: int) -> Scene:
    """Three discs, one immovable, in a closed chain with a post; some have friction, losses or gravity."""
    rng = random.Random(seed)
    rough = {"friction": rng.uniform(0.0, 0.5), "wall_friction": rng.uniform(0.0, 0.5)} if seed % 2 else {}
    return staged(
        "driven",
        disc_at(rng.uniform(-3.5, -2.5), rng.uniform(-2.0, 2.0), *_velocity(rng), r=0.25),
        disc_at(rng.uniform(2.5, 3.5), rng.uniform(-2.0, 2.0), *_velocity(rng), r=0.25),
        disc_at(0.0, rng.uniform(1.5, 2.0), r=0.3, m=math.inf),
        Chain(points_m=[(-5, -3), (5, -3), (5, 3), (-5, 3)], bulges=[0.0, 0.5, 0.0, -0.1], closed=True),
        Ring(centre_m=(0.0, rng.uniform(-1.5, -1.0)), radius_m=0.4),
        wall_at(0.0, 4.0, 0.1, -1.0),
        restitution=rng.choice([1.0, 0.9]),
        wall_restitution=rng.choice([1.0, 0.9]),
        gravity_m_s2=(0.0, -2.0) if seed % 3 == 0 else (0.0, 0.0),
        duration_s=4.0,
        **rough,
    )


def _velocity(rng: random.Random) -> Vector:
    angle = rng.uniform(0.0, math.tau)
    return (3.0 * math.cos(angle), 3.0 * math.sin(angle))


def boosted(scene: Scene, drive: Vector) -> Scene:
    """The scene as it is seen from what moves the other way: all that stood is driven."""

    def sum_of(velocity: Vector) -> Vector:
        return velocity[0] + drive[0], velocity[1] + drive[1]

    discs = [
        disc.model_copy(update={"velocity_m_s": sum_of(disc.velocity_m_s), "driven": disc.immovable})
        for disc in scene.discs
    ]
    walls = [wall.model_copy(update={"velocity_m_s": sum_of(wall.velocity_m_s)}) for wall in scene.walls]
    return Scene(**{**dict(scene), "discs": discs, "walls": walls})


@pytest.mark.parametrize("seed", long_after(12, range(24)))
def test_seen_from_a_moving_frame_the_same_impacts_happen(seed: int) -> None:
    """A scene of which everything is driven along has its impacts at the same times, and velocities more by the drive.

    An error grows with each impact on something round: eight impacts are compared, in which it grows to no more than
    a thousandth of a millionth.
    """
    scene, drive, count = a_table(seed), (3.0, -2.0), 8
    rest, moving = solve_pic(scene, max_impacts=count), solve_pic(boosted(scene, drive), max_impacts=count)
    assert len(rest.impacts) > 2
    assert np.array_equal(rest.impacts[["first", "second"]], moving.impacts[["first", "second"]])
    assert np.allclose(rest.impacts["time_s"], moving.impacts["time_s"], rtol=0.0, atol=1e-9)
    for name in ("velocity_first_before", "velocity_first_after", "velocity_second_before", "velocity_second_after"):
        assert np.allclose(rest.impacts[name] + np.array(drive), moving.impacts[name], rtol=0.0, atol=1e-8), name
    if rest.spins is not None and moving.spins is not None:
        assert np.allclose(rest.spins["first_after"], moving.spins["first_after"], rtol=0.0, atol=1e-8)


@each("seed", range(6))
def test_pit_sees_the_same_from_a_moving_frame(seed: int) -> None:
    """PIT's first impacts, whose frames stand at the same instants, are those of the scene at rest."""
    scene, drive = a_table(seed), (3.0, -2.0)
    rest, moving = solve_pit(scene).impacts[:4], solve_pit(boosted(scene, drive)).impacts[:4]
    assert len(rest) == 4
    assert np.array_equal(rest[["first", "second"]], moving[["first", "second"]])
    assert np.allclose(rest["time_s"], moving["time_s"], rtol=0.0, atol=1e-12)
    assert np.allclose(
        rest["velocity_first_after"] + np.array(drive), moving["velocity_first_after"], rtol=0.0, atol=1e-9
    )


# --- Fractions ---


@pytest.mark.parametrize("speed", [0.0, 1e3, 1e6])
def test_a_corner_that_is_driven_fast_is_no_more_certain_than_one_that_stands(speed: float) -> None:
    """Both edges of 80 degrees are met at one instant, in all directions: the order is a convention, and is said to be.

    The instants are told apart by the rounding of where disc and corner are, which grows with how far they have come.
    """
    half = math.tan(math.radians(40.0))

    def turned(x: float, y: float, angle: float) -> Vector:
        return x * math.cos(angle) - y * math.sin(angle), x * math.sin(angle) + y * math.cos(angle)

    for angle in np.linspace(0.1, 6.0, 20).tolist():
        edges = [turned(*point, angle) for point in ((4.0, -half), (5.0, 0.0), (4.0, half))]
        corner = Chain(points_m=edges, velocity_m_s=turned(speed - 1.0, 0.0, angle))
        disc = disc_at(*turned(0.3, 0.0, angle), *turned(speed, 0.0, angle), r=0.1)
        trace = solve_pic(staged("corner", disc, corner, duration_s=20.0))
        assert len(trace.impacts) == 2
        assert trace.ambiguous == (1,)


@each("seed", range(20))
def test_two_driven_walls_and_a_disc_are_a_recurrence_of_fractions(seed: int) -> None:
    """A disc between two half-planes of any velocity along one line has the times and speeds of exact arithmetic."""
    rng = random.Random(seed)
    left, right = (Fraction(rng.randint(-8, 8), 16) for _ in range(2))
    speed, place, radius = Fraction(rng.randint(-64, 64), 16), Fraction(0), Fraction(1, 4)
    walls = [
        half_plane(-3.0, 1.0, float(left)),
        half_plane(3.0, -1.0, float(right)),
    ]
    crushed = (6 - 2 * radius) / (left - right) if left > right else None
    duration = min(Fraction(20), crushed * Fraction(7, 8)) if crushed else Fraction(20)
    scene = staged("driven", disc_at(0.0, 0.0, float(speed), r=0.25), *walls, duration_s=float(duration))
    trace, time = solve_pic(scene), Fraction(0)
    for impact in trace.impacts:
        waits = {
            -1: (place - radius + 3 - left * time) / (left - speed) if speed < left else None,
            -2: (3 + right * time - radius - place) / (speed - right) if speed > right else None,
        }
        wall, wait = min(((k, w) for k, w in waits.items() if w is not None), key=lambda pair: pair[1])
        time, place = time + wait, place + speed * wait
        speed = 2 * (left if wall == -1 else right) - speed
        assert impact["second"] == wall
        assert abs(impact["time_s"] - float(time)) < 1e-12 * float(duration)
        assert abs(impact["velocity_first_after"][0] - float(speed)) < 1e-12 * max(1.0, abs(float(speed)))
    later = [
        time + w
        for w in (
            (place - radius + 3 - left * time) / (left - speed) if speed < left else None,
            (3 + right * time - radius - place) / (speed - right) if speed > right else None,
        )
        if w is not None
    ]
    assert all(float(t) > scene.duration_s * (1.0 - 1e-12) for t in later)


def test_speed_times_room_stays_the_same_before_a_disc_is_crushed() -> None:
    """The run ends by name, with the instant at which no room is left; each impact on the piston keeps (v - U) gap."""
    scene = staged(
        "driven", disc_at(1.0, 0.0, -1.0, r=0.25), half_plane(0.0, 1.0), half_plane(2.0, -1.0, -0.5), duration_s=5.0
    )
    trace = solve_pic(scene)
    (listed,) = find_scenes(["driven/crush"])
    for crushed in (trace, solve_pic(listed.scene)):
        assert crushed.outcome is Outcome.CRUSHED
        assert crushed.notes == trace.notes
    assert trace.notes[:1] == ("disc 0 is crushed between wall 0 and wall 1 at 3 s",)  # 1.5 m of room at 0.5 m/s
    assert trace.end_time_s < 3.0
    on_piston = trace.impacts[trace.impacts["second"] == -2]
    room = 1.5 - 0.5 * on_piston["time_s"]
    kept = (-on_piston["velocity_first_after"][:, 0] - 0.5) * room
    assert np.allclose(kept, kept[0], rtol=1e-9)
    shorter = solve_pic(scene.model_copy(update={"duration_s": 2.96875}))
    assert shorter.outcome is Outcome.COMPLETED  # no room is left after the end, and till then impacts have a number


@pytest.mark.parametrize(("scene", "crushed_s"), long_after(1, crushed_rows()))
def test_a_row_of_discs_is_crushed_when_its_room_is_used_up(scene: Scene, crushed_s: float) -> None:
    """On one line, between bodies that no impact moves, discs are crushed when what is free of it is gone."""
    trace = solve_pic(scene)
    assert trace.outcome is Outcome.CRUSHED
    assert float(trace.notes[0].rpartition(" at ")[2].removesuffix(" s")) == pytest.approx(crushed_s, rel=1e-15)
    assert trace.end_time_s <= crushed_s
    shorter = solve_pic(scene.model_copy(update={"duration_s": crushed_s - 0.125}))
    assert shorter.outcome is Outcome.COMPLETED  # till then impacts have a number


@pytest.mark.long
def test_a_row_that_may_get_out_is_not_called_crushed() -> None:
    """Off the line by 1e-9 m it leaves sideways; so it may where it is rubbed, or struck, or a mallet turns back."""
    (scene, crushed_s), *_ = crushed_rows()
    beyond = len(solve_pic(scene).impacts) + 100
    disc, mallet = scene.discs

    def outcome(**fields: Any) -> Outcome:
        return solve_pic(scene.model_copy(update=fields), max_impacts=beyond).outcome

    aside = disc.model_copy(update={"position_m": (1.0, 1e-9)})
    assert outcome(discs=(aside, mallet)) is Outcome.COMPLETED
    assert outcome(discs=(disc.model_copy(update={"velocity_m_s": (-1.0, 1e-9)}), mallet)) is Outcome.COMPLETED
    assert outcome(gravity_m_s2=(0.0, -1e-9)) is not Outcome.CRUSHED
    for rough, turning in (({"friction": 0.1}, mallet), ({"wall_friction": 0.1}, disc)):
        assert outcome(**rough) is Outcome.CRUSHED  # nothing slips
        turns = turning.model_copy(update={"spin_rad_s": 1e-9})
        assert (
            outcome(**rough, discs=tuple(turns if one is turning else one for one in scene.discs))
            is not Outcome.CRUSHED
        )
    (belt,) = (wall.model_copy(update={"surface_speed_m_s": 1e-9}) for wall in scene.walls)
    assert outcome(wall_friction=0.1, walls=(belt,)) is not Outcome.CRUSHED
    beside = disc_at(0.5, 0.505, r=0.25)
    assert outcome(discs=(disc, mallet, beside)) is Outcome.MAX_IMPACTS
    path = on_legs((0.0, (-0.5, 0.0)), (crushed_s - 2**-9, (0.5, 0.0)))
    turns = Disc(**{**dict(mallet), "velocity_m_s": (0.0, 0.0), **path})
    assert outcome(discs=(disc, turns)) is not Outcome.CRUSHED


def test_a_disc_between_edges_that_it_leaves_sideways_is_not_crushed() -> None:
    """Between two racks that close, a disc that gets out at the side goes on; one that stays is named."""
    fixed = Chain(points_m=[(0.0, -1.0), (0.0, 1.0)])
    comes = Chain(points_m=[(2.0, -1.0), (2.0, 1.0)], velocity_m_s=(-0.5, 0.0))
    out = staged("driven", disc_at(1.0, 0.0, -1.0, 2.0, r=0.25), fixed, comes, duration_s=5.0)
    stays = staged("driven", disc_at(1.0, 0.0, -1.0, 0.01, r=0.25), fixed, comes, duration_s=5.0)
    assert solve_pic(out).outcome is Outcome.COMPLETED
    assert solve_pic(stays).outcome is Outcome.CRUSHED


def rubbed_between_racks(seed: int) -> Scene:
    """Return a disc, with a spin, between two racks that close, and go along; they rub, and some give back."""
    rng = random.Random(f"racks {seed}")
    half = rng.uniform(0.2, 1.0)
    racks = [
        Chain(points_m=[(x, -half), (x, half)], velocity_m_s=(speed, rng.choice([0.0, rng.uniform(-0.2, 0.2)])))
        for x, speed in ((0.0, 0.0), (2.0, -0.5))
    ]
    disc = disc_at(1.0, rng.uniform(-0.1, 0.1), -1.0, rng.uniform(-0.5, 0.5), r=0.25)
    turning = disc.model_copy(update={"spin_rad_s": rng.uniform(-6.0, 6.0)})
    rough = {"wall_friction": rng.choice([0.05, 0.2, 1.0]), "wall_restitution": rng.choice([1.0, 1.0, 0.75])}
    return staged("driven", turning, *racks, duration_s=5.0, **rough)


@pytest.mark.parametrize("seeds", long_after(1, [range(2), range(2, 20), range(20, 40), range(40, 60)]))
def test_a_disc_that_is_rubbed_is_called_crushed_only_where_it_stays_between_the_racks(seeds: range) -> None:
    """Sixty digits follow it between half-planes, 300 impacts long: of a named one the centre never leaves a rack."""
    called = 0
    for seed in seeds:
        scene = rubbed_between_racks(seed)
        trace = solve_pic(scene)
        called += trace.outcome is Outcome.CRUSHED
        if trace.outcome is not Outcome.CRUSHED:
            continue
        assert trace.notes[0].endswith(" at 3 s"), seed  # 1.5 m of room at 0.5 m/s
        ends = [wall.points_m[1] for wall in scene.walls if isinstance(wall, Chain)]
        planes = [
            Wall(point_m=(x, 0.0), normal=(1.0 - x, 0.0), velocity_m_s=wall.velocity_m_s)
            for (x, _), wall in zip(ends, scene.walls, strict=True)
        ]
        y, time, speed = scene.discs[0].position_m[1], 0.0, scene.discs[0].velocity_m_s[1]
        with mp.workdps(60):
            happened = brute_force(scene.model_copy(update={"walls": tuple(planes)}), 300)
        for impact_s, vy in ((float(one.time), float(one.after[1])) for one in happened):
            y, time, speed = y + speed * (impact_s - time), impact_s, vy
            assert all(abs(y - plane.velocity_m_s[1] * time) < end[1] for plane, end in zip(planes, ends, strict=True))
        assert 2.9 < time <= 3.0
    assert 0 < called < len(seeds)


# --- Sixty digits ---


def among_mallets(seed: int) -> Scene:
    """A rough disc between driven half-planes and driven, spinning discs, on courses of their own."""
    rng = random.Random(1000 + seed)
    mallets = [
        disc_at(
            3.0 * math.cos(angle),
            3.0 * math.sin(angle),
            -rng.uniform(0.0, 1.0) * math.cos(angle),
            -rng.uniform(0.0, 1.0) * math.sin(angle),
            r=rng.uniform(0.3, 0.8),
            m=math.inf,
            driven=True,
            spin_rad_s=rng.uniform(-5.0, 5.0),
        )
        for angle in (0.5, 2.5, 4.5)
    ]
    walls = [
        wall_at(
            6.0 * math.cos(angle),
            6.0 * math.sin(angle),
            -math.cos(angle),
            -math.sin(angle),
            velocity_m_s=(rng.uniform(-0.5, 0.5), rng.uniform(-0.5, 0.5)),
        )
        for angle in (0.3, 1.9, 3.5, 5.1)
    ]
    puck = Disc(position_m=(0.0, 0.0), velocity_m_s=_velocity(rng), radius_m=0.4, spin_rad_s=rng.uniform(-5.0, 5.0))
    return staged(
        "driven",
        puck,
        *mallets,
        *walls,
        restitution=rng.uniform(0.6, 1.0),
        wall_restitution=rng.uniform(0.6, 1.0),
        friction=rng.uniform(0.0, 0.6),
        wall_friction=rng.uniform(0.0, 0.6),
        duration_s=6.0,
    )


def agreed(seeds: range) -> int:
    compared = 0
    for seed in seeds:
        scene = among_mallets(seed)
        with mp.workdps(60):
            trace, known = solve_pic(scene, max_impacts=6), brute_force(scene, 6)
        assert len(trace.impacts) == len(known)
        assert trace.spins is not None
        for row, spins, one in zip(trace.impacts, trace.spins, known, strict=True):
            assert (row["first"], row["second"]) == (one.first, one.second)
            assert abs(row["time_s"] - float(one.time)) < 1e-9, (seed, one.time)
            after = [float(v) for v in one.after[:2]]
            assert np.allclose(row["velocity_first_after"], after, rtol=0.0, atol=1e-8), (seed, one.time)
            assert abs(spins["first_after"] - float(one.spins[0])) < 1e-7
            compared += 1
    return compared


def test_a_puck_among_mallets_has_the_impacts_of_sixty_digits() -> None:
    """Six impacts each of forty rough pucks among spinning, driven discs and driven walls: order, times, velocities."""
    assert agreed(range(40)) > 100


@pytest.mark.long
def test_a_thousand_pucks_have_the_impacts_of_sixty_digits() -> None:
    """The same of a thousand."""
    assert agreed(range(40, 1040)) > 2500


# --- Energy ---


def work_and_loss(scene: Scene, trace: Trace) -> tuple[float, float]:
    """What driven surfaces give, impulse times their velocity; and what is lost, seen from them: from the records."""
    work = loss = 0.0
    assert trace.spins is not None
    for row, spins in zip(trace.impacts, trace.spins, strict=True):
        disc = scene.discs[int(row["first"])]
        assert int(row["second"]) < 0 or scene.discs[int(row["second"])].immovable
        normal = -row["normal"]  # to the first
        rim = 0.0
        if row["second"] >= 0:
            rim = scene.discs[int(row["second"])].radius_m * float(spins["second_before"])
        surface = row["velocity_second_before"] + rim * np.array([-normal[1], normal[0]])
        work += disc.mass_kg * float((row["velocity_first_after"] - row["velocity_first_before"]) @ surface)
        for when, sign in (("before", 1.0), ("after", -1.0)):
            seen = row[f"velocity_first_{when}"] - surface
            turning = disc.inertia_factor * (disc.radius_m * float(spins[f"first_{when}"])) ** 2
            loss += sign * 0.5 * disc.mass_kg * (float(seen @ seen) + turning)
    return work, loss


@each("seed", range(10))
def test_energy_is_what_is_given_less_what_is_lost(seed: int) -> None:
    """The energy at the end is that at the start, and the work of driven surfaces, less the losses seen from there."""
    scene = among_mallets(seed)
    trace = solve_pic(scene, max_impacts=50)
    begun = kinetic_energy(scene, scene.arrays.velocity_m_s, scene.arrays.spins)
    ended = kinetic_energy(scene, trace.final_velocity_m_s, trace.final_spin_rad_s)
    work, loss = work_and_loss(scene, trace)
    assert loss >= 0.0
    assert abs(ended - (begun + work - loss)) < 1e-12 * (begun + abs(work) + loss)


@pytest.mark.parametrize("mass", [1e8, 1e12])
def test_a_driven_disc_is_the_limit_of_a_heavy_one(mass: float) -> None:
    """A free disc of 1e8 or 1e12 kg in its place makes a difference of some masses' quotient."""
    driven = disc_at(2.0, 0.3, -1.0, 0.25, m=math.inf, driven=True, spin_rad_s=3.0)
    heavy = driven.model_copy(update={"mass_kg": mass, "driven": False})
    laws = {"friction": 0.25, "restitution": 0.8, "duration_s": 2.0}
    puck = disc_at(0.0, 0.0, 2.0, spin_rad_s=-2.0)
    one, two = (solve_pic(staged("driven", puck, other, **laws)) for other in (driven, heavy))
    assert len(one.impacts) == len(two.impacts) == 1
    off = np.abs(one.final_velocity_m_s - two.final_velocity_m_s).max()
    assert 0.0 < off < 20.0 / mass


# --- Legs and belts ---


def on_legs(*legs: tuple[float, Vector]) -> dict[str, Any]:
    return {"legs": [{"from_s": begin, "velocity_m_s": velocity} for begin, velocity in legs]}


@pytest.mark.parametrize("falls", [False, True])
def test_a_body_that_starts_at_a_touching_disc_strikes_it_at_that_instant(falls: bool) -> None:
    """A wall, an edge and a mallet that start at 1 s at 2 m/s give a disc that touches them 4 m/s, at 1 s exactly."""
    legs, end = on_legs((0.0, (0.0, 0.0)), (1.0, (2.0, 0.0)), (1.5, (0.0, 1.0))), 2.0
    gravity = (0.0, -1.0) if falls else (0.0, 0.0)
    mallet = disc_at(-0.5, 0.0, m=math.inf, driven=True, **legs)
    for bodies in (
        {"walls": [wall_at(0.0, 0.0, 1.0, 0.0, **legs)]},
        {"walls": [Chain(points_m=[(0.0, -9.0), (0.0, 9.0)], **legs)]},
        {"walls": [], "discs": [mallet]},
    ):
        if falls and "discs" in bodies:
            continue  # the disc falls past it
        discs, walls = bodies.get("discs", []), bodies["walls"]
        trace = solve_pic(
            staged("driven", disc_at(0.25, 0.0, r=0.25), *discs, *walls, gravity_m_s2=gravity, duration_s=end)
        )
        assert trace.impacts["time_s"].tolist() == [1.0]
        assert trace.impacts["velocity_first_after"][0, 0] == 4.0
        assert trace.impacts["velocity_second_after"].tolist() == [[2.0, 0.0]]
        if discs:  # 1 m, and half a metre up
            assert trace.final_position_m[1].tolist() == [0.5, 0.5]
            assert trace.final_velocity_m_s[1].tolist() == [0.0, 1.0]


def test_a_path_in_many_pieces_is_the_same_path() -> None:
    """Two hundred legs of one velocity give the impacts of a wall and a mallet of that velocity, to rounding."""
    cut = [(k / 16, (-0.5, 0.25)) for k in range(200)]

    def scene(moves: dict[str, Any]) -> Scene:
        return staged(
            "driven",
            disc_at(0.5, 0.25, 4.0, -3.0, r=0.25),
            disc_at(4.0, 4.0, m=math.inf, driven=True, **moves),
            Chain(points_m=[(-6, -6), (6, -6), (6, 6), (-6, 6)], closed=True),
            Chain(points_m=[(3.0, -2.0), (3.5, 2.0)], half_width_m=0.125, **moves),
            duration_s=12.0,
        )

    whole, pieces = solve_pic(scene({"velocity_m_s": (-0.5, 0.25)})), solve_pic(scene(on_legs(*cut)))
    assert len(whole.impacts) > 5
    assert whole.impacts[["first", "second"]].tolist() == pieces.impacts[["first", "second"]].tolist()
    assert np.allclose(whole.impacts["time_s"], pieces.impacts["time_s"], rtol=0.0, atol=1e-12)
    assert np.allclose(whole.final_position_m, pieces.final_position_m, rtol=0.0, atol=1e-11)


@each("seed", range(12))
def test_a_disc_and_a_wall_on_random_legs_are_a_recurrence_of_fractions(seed: int) -> None:
    """A disc between a wall at rest and one on legs has the times and speeds of fractions, by Algorithm 2 too."""
    from carom import solve_pic_framewise

    rng = random.Random(f"legs {seed}")
    begins = sorted({Fraction(rng.randint(1, 512), 32) for _ in range(rng.choice((1, 5, 40)))})
    legs = [(Fraction(0), Fraction(0)), *((begin, Fraction(rng.randint(-8, 8), 16)) for begin in begins)]
    walls = [
        half_plane(0.0, 1.0),
        wall_at(32.0, 0.0, -1.0, 0.0, **on_legs(*((float(t), (float(u), 0.0)) for t, u in legs))),
    ]
    scene = staged("driven", disc_at(1.0, 0.0, -8.0, r=0.25), *walls, duration_s=20.0)
    trace = solve_pic(scene)
    assert solve_pic_framewise(scene).impacts.tobytes() == trace.impacts.tobytes()
    time, place, speed, far = Fraction(0), Fraction(1), Fraction(-8), [Fraction(32)]
    for (begin, u), (end, _) in zip(legs, [*legs[1:], (Fraction(20), None)], strict=True):
        far.append(far[-1] + u * (end - begin))
    found = list[tuple[Fraction, int, Fraction]]()
    for (begin, u), (end, _), at in zip(legs, [*legs[1:], (Fraction(20), None)], far, strict=False):
        while True:  # all impacts before the leg ends
            now = max(time, begin)
            here = place + speed * (now - time)
            wait = (Fraction(1, 4) - here) / speed if speed < 0 else None
            gap = at + u * (now - begin) - Fraction(1, 4) - here
            other = gap / (speed - u) if speed > u and gap >= 0 else None
            met = min(((w, k) for k, w in ((-1, wait), (-2, other)) if w is not None), default=None)
            if met is None or now + met[0] >= end:
                break
            place, time = here + speed * met[0], now + met[0]
            speed = -speed if met[1] == -1 else 2 * u - speed
            found.append((time, met[1], speed))
    assert trace.impacts["second"].tolist() == [wall for _, wall, _ in found]
    assert np.allclose(trace.impacts["time_s"], [float(t) for t, _, _ in found], rtol=0.0, atol=1e-12)
    assert np.allclose(trace.impacts["velocity_first_after"][:, 0], [float(v) for *_, v in found], rtol=1e-12)


def test_a_belt_gives_a_disc_what_friction_holds_it_by() -> None:
    """A disc that drops on a belt at 1.5 m/s, with friction 1, leaves at -0.5 m/s with a rim of -1 m/s, each exactly.

    Of a slip of 1.5 m/s a third goes into the velocity and two thirds into the rim, since the inertia factor is 1/2.
    The other side of a line runs the other way.
    """
    for side, belt in (
        (1.0, wall_at(0.0, 0.0, 0.0, 1.0, surface_speed_m_s=1.5)),
        (1.0, Chain(points_m=[(-3.0, 0.0), (3.0, 0.0)], surface_speed_m_s=1.5)),
        (-1.0, Chain(points_m=[(-3.0, 0.0), (3.0, 0.0)], surface_speed_m_s=1.5)),
    ):
        scene = staged(
            "driven", disc_at(0.0, side, 0.0, -side, r=0.25), belt, wall_friction=1.0, duration_s=2.0, frame_rate_hz=64
        )
        for trace in (solve_pic(scene), solve_pit(scene)):
            assert trace.impacts["velocity_first_after"].tolist() == [[-0.5 * side, side]]
            assert trace.spins is not None
            assert trace.spins["first_after"].tolist() == [-4.0]


def test_the_books_of_energy_balance_with_legs_belts_friction_and_losses() -> None:
    """Kinetic energy at the end is that at the start, and the work of what is driven, less what each impact loses.

    An impact loses (1 - e^2) w^2 m/2 of the speed w along the normal, and T (s - T/(2 M)) of the slip s and the impulse
    T of friction, both as seen from the driven surface.
    """
    scene = staged(
        "driven",
        disc_at(1.0, 0.5, 5.0, -3.0, r=0.25, m=2.0, spin_rad_s=5.0),
        disc_at(3.0, 2.5, -0.2, 0.1, m=math.inf, driven=True, spin_rad_s=4),
        Chain(points_m=[(-3, -2), (4, -2), (4, 4), (-3, 4)], closed=True, surface_speed_m_s=1.25),
        Chain(
            points_m=[(-2.0, -1.0), (-2.5, 1.0)],
            **on_legs((0.0, (0.5, 0.0)), (2.0, (-0.25, 0.25)), (4.5, (0.0, -0.25))),
        ),
        restitution=0.95,
        wall_restitution=0.98,
        friction=0.05,
        wall_friction=0.3,
        duration_s=16.0,
    )
    trace = solve_pic(scene)
    assert len(trace.impacts) > 15
    assert trace.spins is not None
    assert {int(second) for second in trace.impacts["second"]} == {-1, -2, 1}
    disc, energy = scene.discs[0], kinetic_energy(scene, scene.arrays.velocity_m_s, scene.arrays.spins)
    work = work_of_driven(trace)
    mass, radius, ease = disc.mass_kg, disc.radius_m, 1.0 + 1.0 / disc.inertia_factor
    for row, spins, done in zip(trace.impacts, trace.spins, work, strict=True):
        nx, ny = -row["normal"]  # from the other body to the disc
        runs = 1.25 if row["second"] == -1 else 0.5 * 4.0 if row["second"] == 1 else 0.0
        surface = row["velocity_second_before"] + runs * np.array([-ny, nx])
        push = mass * (row["velocity_first_after"] - row["velocity_first_before"])
        closing = float((row["velocity_first_before"] - surface) @ (nx, ny))
        slip = float((row["velocity_first_before"] - surface) @ (ny, -nx)) + radius * spins["first_before"]
        rub = -float(push @ (ny, -nx))
        e = scene.restitution if row["second"] == 1 else scene.wall_restitution
        assert math.isclose(done, float(push @ surface), rel_tol=1e-13, abs_tol=1e-14)
        energy += done - (1 - e * e) * closing**2 * mass / 2 - rub * (slip - rub * ease / (2 * mass))
    assert math.isclose(energy, kinetic_energy(scene, trace.final_velocity_m_s, trace.final_spin_rad_s), rel_tol=1e-13)


@pytest.mark.long
@pytest.mark.parametrize("freed_by", ["a wall that turns back", "friction", "a third body"])
def test_a_disc_that_friction_or_a_third_body_may_free_is_not_called_crushed(freed_by: str) -> None:
    """What turns and is rubbed, is struck, or has something in its way, may get out; a wall that turns back lets it."""
    fixed, comes = Chain(points_m=[(0.0, -1.0), (0.0, 1.0)]), Chain(points_m=[(2.0, -1.0), (2.0, 1.0)])
    squeezed = disc_at(1.0, 0.0, -1.0, 0.01, r=0.25)
    closing = comes.model_copy(update={"velocity_m_s": (-0.5, 0.0)})
    called = solve_pic(staged("driven", squeezed, fixed, closing, duration_s=5.0))
    assert called.outcome is Outcome.CRUSHED
    beyond = len(called.impacts) + 100
    if freed_by == "a wall that turns back":
        turns = Chain(**{**dict(comes), **on_legs((0.0, (-0.5, 0.0)), (2.998046875, (0.5, 0.0)))})
        free = solve_pic(staged("driven", squeezed, fixed, turns, duration_s=5.0))
        assert free.outcome is Outcome.COMPLETED
        assert len(free.impacts) > beyond
    elif freed_by == "friction":
        walls = [fixed.model_copy(update={"friction": 0.1}), closing]
        assert solve_pic(staged("driven", squeezed, *walls, duration_s=5.0)).outcome is Outcome.CRUSHED
        turning = squeezed.model_copy(update={"spin_rad_s": 24.0})
        free = solve_pic(staged("driven", turning, *walls, duration_s=5.0), max_impacts=beyond)
        assert free.outcome is not Outcome.CRUSHED
    else:
        beside = disc_at(1.0, 0.505, r=0.25)
        crowded = staged("driven", squeezed, beside, fixed, closing, duration_s=5.0)
        assert solve_pic(crowded, max_impacts=beyond).outcome is not Outcome.CRUSHED


@each("seed", range(8))
def test_seen_from_a_moving_frame_legs_do_the_same(seed: int) -> None:
    """A scene of bodies on legs, driven along as a whole, has its impacts at the same times; half of them fall.

    One disc begins without a speed along gravity under a ceiling that is a line, which has another side.
    """
    rng = random.Random(f"galileo {seed}")

    def legs(drive: Vector) -> dict[str, Any]:
        begins = [0.0, *sorted(rng.uniform(0.0, 4.0) for _ in range(4))]
        return on_legs(*((t, (rng.uniform(-0.5, 0.5) + drive[0], rng.uniform(-0.5, 0.5) + drive[1])) for t in begins))

    def scene(drive: Vector) -> Scene:
        rng.seed(f"galileo {seed}")
        u, v = drive
        return staged(
            "driven",
            disc_at(0.0, rng.uniform(-2.0, 2.0), rng.uniform(2.0, 4.0) + u, 1.0 + v, r=0.3),
            disc_at(0.0, 3.0, rng.uniform(-4.0, -2.0) + u, v, r=0.3),
            disc_at(0.0, -3.2, r=0.4, m=math.inf, driven=True, **legs(drive)),
            Chain(points_m=[(-5, -4), (5, -4), (5, 4), (-5, 4)], closed=True, velocity_m_s=drive),
            Chain(points_m=[(-2.5, -1), (-2.5, 1)], half_width_m=0.1, **legs(drive)),
            Ring(centre_m=(2.5, 0.0), radius_m=0.4, **legs(drive)),
            gravity_m_s2=(0.0, -1.0) if seed % 2 else (0.0, 0.0),
            wall_friction=0.2,
            duration_s=5.0,
        )

    rest, moving = solve_pic(scene((0.0, 0.0)), max_impacts=6), solve_pic(scene((3.0, -2.0)), max_impacts=6)
    assert len(rest.impacts) > 3
    assert rest.impacts[["first", "second"]].tolist() == moving.impacts[["first", "second"]].tolist()
    assert np.allclose(rest.impacts["time_s"], moving.impacts["time_s"], rtol=0.0, atol=1e-9)
    assert np.allclose(
        rest.impacts["velocity_first_after"] + (3.0, -2.0), moving.impacts["velocity_first_after"], rtol=0.0, atol=1e-8
    )
