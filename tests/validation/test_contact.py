"""Contact against what knows nothing of modes: many small steps, bounces at 60 digits, and what must be conserved."""

from __future__ import annotations

import math
import random
from collections.abc import Iterator

import numpy as np
import pytest
from mpmath import mp, mpf
from tests.campaign import contact
from tests.checker.small_steps import Ends, stepped
from tests.lengths import each, long_after
from tests.stage import disc_at, staged, wall_at

from carom import Disc, Mode, Outcome, Scene, Trace, certify, solve_pic
from carom.scenes import find_scenes

G = 10.0


def drawn(seed: int) -> Scene:
    """A disc thrown on a slope, with spin, of any restitution, friction and inertia; now and then begun in contact."""
    rng = random.Random(seed)
    angle = rng.choice([0.0, 1.0]) * rng.uniform(-0.6, 0.6)
    nx, ny = math.sin(angle), math.cos(angle)
    up, u, into = rng.choice([0.0, rng.uniform(0.1, 1.0)]), rng.uniform(-3, 3), rng.uniform(0, 2)
    disc = Disc(
        position_m=((0.5 + up) * nx, (0.5 + up) * ny),
        velocity_m_s=(u * ny - into * nx, -u * nx - into * ny) if up else (u * ny, -u * nx),
        radius_m=0.5,
        spin_rad_s=rng.choice([0.0, rng.uniform(-6, 6)]),
        inertia_factor=rng.choice([0.4, 0.5, 1.0]),
    )
    return Scene(
        name=f"drawn {seed}",
        discs=[disc],
        walls=[wall_at(0.0, 0.0, nx, ny)],
        wall_restitution=rng.choice([0.0, 0.3, 0.6]),
        wall_friction=rng.choice([0.0, 0.1, 0.3, 0.8]),
        wall_rolling_resistance=rng.choice([0.0, 0.0, 0.05, 0.4]),
        gravity_m_s2=(0.0, -G),
        duration_s=2.0,
    )


def apart(scene: Scene, steps: int, trace: Trace) -> float:
    """Return how far small steps end from PIC: places and velocities, rims included."""
    place, velocity, spin = map(np.array, stepped(scene, steps, scene.duration_s))
    told = np.zeros(len(spin)) if trace.final_spin_rad_s is None else trace.final_spin_rad_s
    return max(
        float(np.abs(place - trace.final_position_m).max()),
        float(np.abs(velocity - trace.final_velocity_m_s).max()),
        float(np.abs((spin - told) * scene.arrays.radius_m).max()) if scene.wall_friction else 0.0,
    )


def converges(seeds: range, steps: int) -> Iterator[tuple[int, float, float]]:
    for seed in seeds:
        scene = drawn(seed)
        trace = solve_pic(scene)
        assert trace.outcome is Outcome.COMPLETED
        coarse, fine = apart(scene, steps, trace), apart(scene, 4 * steps, trace)
        if not (fine <= 0.5 * coarse or fine < 30.0 * G * scene.duration_s / steps):
            yield seed, coarse, fine


def test_small_steps_that_know_no_modes_come_to_the_same_end() -> None:
    """Of 12 discs thrown on slopes the ends of small steps come nearer to PIC's with the steps."""
    assert list(converges(range(12), 500)) == []


@pytest.mark.long
@pytest.mark.parametrize("first", range(0, 400, 50))
def test_small_steps_come_to_the_same_end_from_many_starts(first: int) -> None:
    """Of 400, with four times as many steps, likewise."""
    assert list(converges(range(first, first + 50), 2000)) == []


def test_one_to_three_discs_agree_with_small_steps() -> None:
    """Of three scenes of the campaign none is contradicted, gains energy, or lets a disc sink into a wall."""
    assert [said for seed in range(3) if (said := contact.judged(contact.drawn(seed))) not in contact.RIGHT] == []


@pytest.mark.long
@pytest.mark.parametrize("first", range(0, 1000, 100))
def test_a_thousand_scenes_agree_with_small_steps(first: int) -> None:
    """Of the first 1,000 none is contradicted, gains energy, or lets a disc sink into a wall."""
    seeds = range(first, first + 100)
    assert [said for seed in seeds if (said := contact.judged(contact.drawn(seed))) not in contact.RIGHT] == []


@pytest.mark.parametrize("seed", long_after(1, [8, 961]))
def test_small_steps_of_another_law_contradict_a_scene(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """With a twentieth less gravity they do, also where starts nearby part: number 961 has 96 impacts."""

    def lighter(scene: Scene, steps: int, until_s: float) -> Ends:
        return stepped(Scene(**{**dict(scene), "gravity_m_s2": (0.0, -0.95 * G)}), steps, until_s)

    monkeypatch.setattr(contact, "stepped", lighter)
    assert contact.judged(contact.drawn(seed)) not in contact.RIGHT


@each("regain", [-0.5, 0.0, 0.5, 1.0])
def test_a_disc_that_does_not_bounce_slides_on_with_what_friction_gives_back(regain: float) -> None:
    """Gripped with 1 m/s of slip it loses (1 + b)/3 of its speed; -b of slip is left, and taken at 3 m/s2."""
    scene = staged(
        "gives back",
        disc_at(0.0, 5.5, 1.0),
        wall_at(0.0, 0.0, 0.0, 1.0),
        gravity_m_s2=(0.0, -G),
        wall_friction=0.1,
        wall_restitution=0.0,
        wall_tangential_restitution=regain,
        duration_s=3.0,
    )
    speed, slides = 1.0 - (1.0 + regain) / 3.0, abs(regain) / 3.0
    rate = math.copysign(1.0, regain)
    way = 1.0 + speed * slides + rate * slides**2 / 2 + (2.0 - slides) * (speed + rate * slides)
    for trace in (solve_pic(scene), certify(scene).trace):
        assert trace.outcome is Outcome.COMPLETED
        assert trace.final_position_m[0].tolist() == pytest.approx([way, 0.5], rel=1e-14)
        assert trace.final_velocity_m_s[0].tolist() == pytest.approx([2 / 3, 0.0], rel=1e-14)


def held_in_its_landing(regain: float, friction: float) -> Scene:
    """A disc that bounces, at 1 m/s and without spin, on a wall whose friction is enough for its slip in no time."""
    return staged(
        f"held in its landing {regain}",
        disc_at(0.0, 0.6, 1.0),
        wall_at(0.0, 0.0, 0.0, 1.0),
        gravity_m_s2=(0.0, -G),
        wall_friction=friction,
        wall_restitution=0.5,
        wall_tangential_restitution=regain,
        duration_s=3.0,
    )


@each("regain", [-1.0, -0.5, 0.5, 1.0])
def test_slip_that_friction_takes_in_a_landing_is_taken_from_the_disc_and_from_its_rim(regain: float) -> None:
    """What is left of it after the bounces goes within 1e-15 s: the disc rolls on with two thirds of its speed."""
    trace = solve_pic(held_in_its_landing(regain, 1e19))
    assert trace.outcome is Outcome.COMPLETED
    assert trace.final_velocity_m_s[0].tolist() == pytest.approx([2 / 3, 0.0], rel=1e-12)
    assert trace.final_spin_rad_s is not None
    assert trace.final_spin_rad_s[0] == pytest.approx(-2 / 3 / 0.5, rel=1e-12)


def bounced(u: mpf, q: mpf, w: mpf, a: mpf, p: mpf, mu: mpf, e: mpf, k: mpf) -> tuple[mpf, mpf, mpf, mpf]:
    """Bounce at 60 digits until nothing is left: when, where along the wall, how fast, and with what slip."""
    time = way = mpf(0)
    while w > mpf(10) ** -50:
        most = mu * (1 + e) * w
        rubs = (u + q) / (1 + 1 / k)
        rubs = mp.sign(rubs) * min(abs(rubs), most)
        u, q, w = u - rubs, q - rubs / k, e * w
        hop = 2 * w / p
        way += u * hop + a * hop * hop / 2
        u += a * hop
        time += hop
    return time, way, u, u + q


@pytest.mark.parametrize("landings", long_after(1, [12, 150]))
def test_landings_are_those_of_bounces_at_sixty_digits(landings: int) -> None:
    """Of landings on slopes with friction: instant, place, speed and slip, to 1e-12."""
    rng, seen = random.Random(4), set[Mode]()
    for number in range(landings):
        angle = rng.choice([0.0, 1.0]) * rng.uniform(-0.9, 0.9)
        nx, ny = math.sin(angle), math.cos(angle)
        e, mu, k = rng.uniform(0.05, 0.9), rng.choice([0.0, 0.05, 0.2, 0.6]), rng.choice([0.4, 0.5, 1.0])
        u, q, w = rng.uniform(-3, 3), rng.uniform(-3, 3), rng.uniform(0.2, 3.0)
        disc = disc_at(0.5 * nx, 0.5 * ny, u * ny - w * nx, -u * nx - w * ny, spin_rad_s=q / 0.5, inertia_factor=k)
        scene = staged(
            f"landing {number}",
            disc,
            wall_at(0.0, 0.0, nx, ny),
            wall_restitution=e,
            wall_friction=mu,
            gravity_m_s2=(0.0, -G),
            duration_s=60.0,
        )
        modes = solve_pic(scene).modes
        assert modes is not None
        landed = modes[0]
        with mp.workdps(60):
            exact = bounced(*map(mpf, (u, q, w, G * nx, G * ny, mu, e, k)))
        (x, y), (vx, vy) = landed["position"].tolist(), landed["velocity"].tolist()
        speed = vx * ny - vy * nx
        slip = speed + 0.5 * landed["spin"] if landed["after"] == Mode.SLIDE else 0.0
        scale = 3.0 + G * float(exact[0])
        assert landed["time_s"] == pytest.approx(float(exact[0]), rel=1e-12)
        assert x * ny - y * nx == pytest.approx(float(exact[1]), abs=1e-12 * scale * (1.0 + float(exact[0])))
        assert (speed, slip) == pytest.approx((float(exact[2]), float(exact[3])), abs=1e-12 * scale)
        seen.add(Mode(int(landed["after"])))
    assert seen == {Mode.SLIDE, Mode.ROLL}


def test_angular_momentum_about_the_wall_is_known_at_all_times() -> None:
    """Whatever friction does: ``u - k R w`` grows by gravity's part along the wall, bounces, slide and roll alike."""
    for scene in (entry.scene for entry in find_scenes(["contact"])):
        turns = not math.isinf(scene.discs[0].inertia_factor)
        one_plane = len(scene.walls) == 1 and scene.arrays.has_half_planes
        falls = scene.gravity_m_s2 != (0.0, 0.0)
        if len(scene.discs) > 1 or not (one_plane and turns and falls) or scene.wall_rolling_resistance:
            continue  # rolling resistance changes it
        (_, _, nx, ny), disc = scene.arrays.half_planes()[0], scene.discs[0]
        k, a = disc.inertia_factor, scene.gravity_m_s2[0] * ny - scene.gravity_m_s2[1] * nx
        begun = disc.velocity_m_s[0] * ny - disc.velocity_m_s[1] * nx - k * disc.radius_m * disc.spin_rad_s
        for part in (0.1, 0.3, 0.55, 0.8, 1.0):
            trace = solve_pic(scene, until_s=part * scene.duration_s)
            (vx, vy), spins = trace.final_velocity_m_s[0], trace.final_spin_rad_s
            spin = 0.0 if spins is None else spins[0]
            momentum = vx * ny - vy * nx - k * disc.radius_m * spin
            assert momentum == pytest.approx(begun + a * part * scene.duration_s, abs=1e-13), scene.name
