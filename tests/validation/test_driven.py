"""Driven walls and discs against independent answers: fractions, moving frames and balances of energy."""

import math
import random
from fractions import Fraction
from functools import partial
from typing import Any

import numpy as np
import pytest
from mpmath import mp
from tests.cases import each, release_after
from tests.scene_builders import build_crushed_rows, disc_at, drive_on_legs, require_value, staged, wall_at
from tests.validation.mpmath_runs import run_brute_force

from carom import Chain, Disc, Outcome, Scene, solve_pic, solve_pic_framewise, solve_pit
from carom.model.energy import kinetic_energy, work_of_driven
from carom.model.walls import AnyWall

Vector = tuple[float, float]


# --- Fractions ---


@each("speed", [0.0, 1e3, 1e6])
def test_simultaneous_impacts_in_a_fast_corner_are_reported_as_ambiguous(speed: float) -> None:
    """A disc that meets both edges of a corner at one instant has an ambiguous second impact at any wall speed."""
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


Legs = list[tuple[Fraction, Fraction]]


def compute_bounces(left: Legs, right: Legs, speed: Fraction, end: Fraction) -> list[tuple[Fraction, int, Fraction]]:
    """Return time, wall and speed after each impact of a disc of 0.5 m at 0 with walls that start at -3 m and 29 m."""
    at, walls, time, place = [Fraction(-3), Fraction(29)], (left, right), Fraction(0), Fraction(0)
    found = list[tuple[Fraction, int, Fraction]]()
    for ends in [*sorted({begin for legs in walls for begin, _ in legs} - {0}), end]:
        moves = [[u for begin, u in legs if begin <= time][-1] for legs in walls]
        while True:  # all impacts before a leg ends
            gaps = place - at[0] - Fraction(1, 4), at[1] - place - Fraction(1, 4)
            closing = moves[0] - speed, speed - moves[1]
            waits = [(gap / pace, k) for k, (gap, pace) in enumerate(zip(gaps, closing, strict=True)) if pace > 0]
            wait, wall = min([*waits, (ends - time, -1)])
            time, place = time + wait, place + wait * speed
            at = [one + wait * u for one, u in zip(at, moves, strict=True)]
            if wall < 0:
                break
            speed = 2 * moves[wall] - speed
            found.append((time, -1 - wall, speed))
    return found


@each("seed", range(32))
def test_disc_between_driven_walls_matches_rational_recurrence(seed: int) -> None:
    """Impacts of a disc between two half-planes driven on legs are those of a recurrence in fractions."""
    rng, still = random.Random(f"legs {seed}"), (Fraction(0), Fraction(0))
    left, right = ([(Fraction(0), Fraction(rng.randint(-8, 8), 16))] for _ in range(2))
    if seed % 3 == 0:
        begins = sorted({Fraction(rng.randint(1, 512), 32) for _ in range(rng.choice((1, 5, 40)))})
        left, right = [still], [still, *((begin, Fraction(rng.randint(-8, 8), 16)) for begin in begins)]
    speed, end, closes = Fraction(rng.randint(-64, 64), 4), Fraction(20), left[0][1] - right[0][1]
    if closes > 0:
        end = min(end, Fraction(63, 2) / closes * Fraction(7, 8))  # before it is crushed
    walls = [
        wall_at(x, 0.0, nx, 0.0, **drive_on_legs(*((float(begin), (float(u), 0.0)) for begin, u in legs)))
        for x, nx, legs in ((-3.0, 1.0, left), (29.0, -1.0, right))
    ]
    scene = staged("driven", disc_at(0.0, 0.0, float(speed), r=0.25), *walls, duration_s=float(end))
    trace, found = solve_pic(scene), compute_bounces(left, right, speed, Fraction(scene.duration_s))
    assert seed % 3 or solve_pic_framewise(scene).impacts.tobytes() == trace.impacts.tobytes()
    assert trace.impacts["second"].tolist() == [wall for _, wall, _ in found]
    assert np.allclose(trace.impacts["time_s"], [float(t) for t, _, _ in found], rtol=0.0, atol=2e-11)
    assert np.allclose(trace.impacts["velocity_first_after"][:, 0], [float(v) for *_, v in found], rtol=1e-12)


@pytest.mark.long
def test_row_that_can_escape_is_not_crushed() -> None:
    """A row that is off its line by 1e-9, slips, is struck, or is freed in time does not end as crushed."""
    (scene, crushed_s), *_ = build_crushed_rows()
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
    path = drive_on_legs((0.0, (-0.5, 0.0)), (crushed_s - 2**-9, (0.5, 0.0)))
    turns = Disc(**{**dict(mallet), "velocity_m_s": (0.0, 0.0), **path})
    assert outcome(discs=(disc, turns)) is not Outcome.CRUSHED


def build_racks_scene(*discs: Disc, turns_s: float = 9.0, friction: float = 0.0) -> Scene:
    """Return discs between a fixed edge with friction and one that closes at 0.5 m/s until it reverses."""
    fixed = Chain(points_m=[(0.0, -1.0), (0.0, 1.0)], friction=friction)
    comes = Chain(points_m=[(2.0, -1.0), (2.0, 1.0)], **drive_on_legs((0.0, (-0.5, 0.0)), (turns_s, (0.5, 0.0))))
    return staged("racks", *discs, fixed, comes, duration_s=5.0)


def test_disc_that_can_leave_closing_racks_is_not_crushed() -> None:
    """A disc between two closing edges is crushed only if it stays between them."""
    out, stays = (disc_at(1.0, 0.0, -1.0, aside, r=0.25) for aside in (2.0, 0.01))
    turning, neighbour = stays.model_copy(update={"spin_rad_s": 24.0}), disc_at(1.0, 0.505, r=0.25)
    crushed = solve_pic(build_racks_scene(stays))
    assert crushed.outcome is solve_pic(build_racks_scene(stays, friction=0.1)).outcome is Outcome.CRUSHED
    assert solve_pic(build_racks_scene(out)).outcome is Outcome.COMPLETED
    freed = (
        build_racks_scene(stays, turns_s=2.998046875),
        build_racks_scene(turning, friction=0.1),
        build_racks_scene(stays, neighbour),
    )
    for scene in freed:
        outcome = solve_pic(scene, max_impacts=len(crushed.impacts) + 100).outcome
        assert outcome in {Outcome.MAX_IMPACTS, Outcome.COMPLETED}, scene


@each("along_m_s", [0.5, -0.5])
@each("place_m", [-0.999999, 0.999999])
def test_disc_that_moves_along_with_rough_closing_racks_is_crushed(along_m_s: float, place_m: float) -> None:
    """A disc that does not move relative to two rough edges stays a micrometre from their ends until it is crushed."""
    # The room of 1.5 m closes at 0.5 m/s.
    racks = [
        Chain(points_m=[(x, -1.0), (x, 1.0)], velocity_m_s=(speed, along_m_s)) for x, speed in ((0.0, 0.0), (2.0, -0.5))
    ]
    disc = disc_at(1.0, place_m, -1.0, along_m_s, r=0.25)
    trace = solve_pic(staged("racks", disc, *racks, duration_s=5.0, wall_friction=0.1), max_impacts=2000)
    assert trace.outcome is Outcome.CRUSHED
    assert trace.notes[0].endswith(" at 3 s")


def draw_rough_racks_scene(seed: int) -> Scene:
    """Return a disc with spin between two closing edges that have friction, and may move along themselves."""
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


@each("seeds", release_after(1, [range(2), range(2, 20), range(20, 40), range(40, 60)]))
def test_crushed_rough_disc_stays_between_its_racks(seeds: range) -> None:
    """In each rough run that ends as crushed, 60-digit brute force keeps the centre between both edges."""
    crushed = 0
    for seed in seeds:
        scene = draw_rough_racks_scene(seed)
        trace = solve_pic(scene)
        if trace.outcome is not Outcome.CRUSHED:
            continue
        crushed += 1
        assert trace.notes[0].endswith(" at 3 s"), seed  # 1.5 m of room at 0.5 m/s
        ends = [wall.points_m[1] for wall in scene.walls if isinstance(wall, Chain)]
        planes = [
            wall_at(x, 0.0, 1.0 - x, 0.0, velocity_m_s=wall.velocity_m_s)
            for (x, _), wall in zip(ends, scene.walls, strict=True)
        ]
        y, time, speed = scene.discs[0].position_m[1], 0.0, scene.discs[0].velocity_m_s[1]
        with mp.workdps(60):
            happened = run_brute_force(scene.model_copy(update={"walls": tuple(planes)}), 300)
        for impact_s, vy in ((float(one.time), float(one.after[1])) for one in happened):
            y, time, speed = y + speed * (impact_s - time), impact_s, vy
            assert all(abs(y - plane.velocity_m_s[1] * time) < end[1] for plane, end in zip(planes, ends, strict=True))
        assert 2.9 < time <= 3.0
    assert 0 < crushed < len(seeds)


# --- Moving frames and energy ---


def draw_mallets_scene(seed: int) -> Scene:
    """Return a rough disc between driven half-planes and driven, spinning discs."""
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
        wall_at(-6.0 * nx, -6.0 * ny, nx, ny, velocity_m_s=(rng.uniform(-0.5, 0.5), rng.uniform(-0.5, 0.5)))
        for nx, ny in ((-1.0, 0.0), (0.0, -1.0), (1.0, 0.0), (0.0, 1.0))
    ]
    angle = rng.uniform(0.0, math.tau)
    puck = disc_at(0.0, 0.0, 3.0 * math.cos(angle), 3.0 * math.sin(angle), r=0.4, spin_rad_s=rng.uniform(-5.0, 5.0))
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


def test_belt_accelerates_a_disc_and_its_rim() -> None:
    """A disc that drops on a belt of 1.5 m/s with friction 1 leaves at exactly -0.5 m/s with a rim of -1 m/s."""
    # A third of the slip of 1.5 m/s goes into the velocity and two thirds into the rim, since the inertia factor is
    # 1/2. The other side of a line runs the other way.
    belt = Chain(points_m=[(-3.0, 0.0), (3.0, 0.0)], surface_speed_m_s=1.5)
    for side in (1.0, -1.0):
        disc = disc_at(0.0, side, 0.0, -side, r=0.25)
        scene = staged("belt", disc, belt, wall_friction=1.0, duration_s=2.0, frame_rate_hz=64)
        for trace in (solve_pic(scene), solve_pit(scene)):
            assert trace.impacts["velocity_first_after"].tolist() == [[-0.5 * side, side]]
            assert require_value(trace.spins)["first_after"].tolist() == [-4.0]


def build_belts_scene() -> Scene:
    """Return a disc in a box whose walls are belts, with a spinning driven disc and a bar on legs."""
    return staged(
        "belts",
        disc_at(1.0, 0.5, 5.0, -3.0, r=0.25, m=2.0, spin_rad_s=5.0),
        disc_at(3.0, 2.5, -0.2, 0.1, m=math.inf, driven=True, spin_rad_s=4),
        Chain(points_m=[(-3, -2), (4, -2), (4, 4), (-3, 4)], closed=True, surface_speed_m_s=1.25),
        Chain(
            points_m=[(-2.0, -1.0), (-2.5, 1.0)],
            **drive_on_legs((0.0, (0.5, 0.0)), (2.0, (-0.25, 0.25)), (4.5, (0.0, -0.25))),
        ),
        restitution=0.95,
        wall_restitution=0.98,
        friction=0.05,
        wall_friction=0.3,
        duration_s=16.0,
        frame_rate_hz=61.0,
    )


def boost_scene(scene: Scene, drive: Vector) -> Scene:
    """Return the scene in a frame that moves at the opposite velocity: all immovable bodies become driven."""

    def faster(body: Disc | AnyWall, **more: bool) -> Any:
        def sum_of(velocity: Vector) -> Vector:
            return velocity[0] + drive[0], velocity[1] + drive[1]

        if body.legs:
            legs = [leg.model_copy(update={"velocity_m_s": sum_of(leg.velocity_m_s)}) for leg in body.legs]
            return body.model_copy(update=more | {"legs": tuple(legs)})
        return body.model_copy(update=more | {"velocity_m_s": sum_of(body.velocity_m_s)})

    discs = [faster(disc, driven=disc.immovable) for disc in scene.discs]
    return Scene(**{**dict(scene), "discs": discs, "walls": [faster(wall) for wall in scene.walls]})


@each("scene", [build_belts_scene(), *map(draw_mallets_scene, range(8))])
def test_scene_in_a_moving_frame_has_the_same_impacts(scene: Scene) -> None:
    """A scene in which all bodies move along at one velocity has its impacts at the same times."""
    # Velocities differ by that velocity, and spins are equal. Errors grow with each impact on a round body.
    drive = (3.0, -2.0)
    for solve, most, late_s in ((partial(solve_pic, max_impacts=6), 6, 1e-9), (solve_pit, 4, 1e-12)):
        rest, moving = solve(scene), solve(boost_scene(scene, drive))
        one, two = rest.impacts[:most], moving.impacts[:most]
        assert one[["first", "second"]].tolist() == two[["first", "second"]].tolist()
        assert np.allclose(one["time_s"], two["time_s"], rtol=0.0, atol=late_s)
        for name in (f"velocity_{side}_{when}" for side in ("first", "second") for when in ("before", "after")):
            assert np.allclose(one[name] + np.array(drive), two[name], rtol=0.0, atol=1e-8), name
        spins, expected = (require_value(trace.spins)["first_after"][:most] for trace in (moving, rest))
        assert np.allclose(spins, expected, rtol=0.0, atol=1e-8)


@each("scene", [build_belts_scene(), *map(draw_mallets_scene, range(10))])
def test_energy_balance_holds_with_legs_belts_friction_and_losses(scene: Scene) -> None:
    """The final kinetic energy is the initial one plus the work of driven bodies minus the loss of each impact."""
    # An impact loses (1 - e^2) w^2 m/2 of the speed w along the normal, and T (s - T/(2 M)) of the slip s and the
    # impulse T of friction, both relative to the driven surface.
    trace, disc = solve_pic(scene, max_impacts=50), scene.discs[0]
    assert len(trace.impacts) > (15 if scene.name == "belts" else 0)
    assert scene.name != "belts" or {-1, -2, 1} == {int(second) for second in trace.impacts["second"]}
    energy = kinetic_energy(scene, scene.arrays.velocity_m_s, scene.arrays.spins)
    mass, radius, ease, moved = disc.mass_kg, disc.radius_m, 1.0 + 1.0 / disc.inertia_factor, energy
    for row, spins, done in zip(trace.impacts, require_value(trace.spins), work_of_driven(trace), strict=True):
        (nx, ny), second = -row["normal"], int(row["second"])  # from the other body to the disc
        runs = scene.walls[-1 - second].surface_speed_m_s if second < 0 else 0.0
        runs += float(spins["second_before"]) * scene.discs[second].radius_m if second >= 0 else 0.0
        surface = row["velocity_second_before"] + runs * np.array([-ny, nx])
        push = mass * (row["velocity_first_after"] - row["velocity_first_before"])
        closing = float((row["velocity_first_before"] - surface) @ (nx, ny))
        slip = float((row["velocity_first_before"] - surface) @ (ny, -nx)) + radius * spins["first_before"]
        rub = -float(push @ (ny, -nx))
        e = scene.restitution if second >= 0 else scene.wall_restitution
        assert math.isclose(done, float(push @ surface), rel_tol=1e-13, abs_tol=1e-13)
        energy += done - (1 - e * e) * closing**2 * mass / 2 - rub * (slip - rub * ease / (2 * mass))
        moved += abs(done)
    ended = kinetic_energy(scene, trace.final_velocity_m_s, trace.final_spin_rad_s)
    assert math.isclose(energy, ended, abs_tol=1e-13 * moved)
