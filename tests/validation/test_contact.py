"""Contact against what knows nothing of modes: many small steps, closed forms, and what must be conserved."""

from __future__ import annotations

import math

import pytest
from tests.campaign import contact
from tests.checker.small_steps import Ends, stepped
from tests.lengths import each, long_after
from tests.stage import disc_at, staged, wall_at

from carom import Outcome, Scene, certify, solve_pic
from carom.scenes import find_scenes

G = 10.0


@pytest.mark.parametrize("seeds", long_after(1, [range(3), *(range(k, k + 100) for k in range(0, 1000, 100))]))
def test_one_to_three_discs_agree_with_small_steps(seeds: range) -> None:
    """Of scenes of the campaign none is contradicted, gains energy, or lets a disc sink into a wall."""
    assert [said for seed in seeds if (said := contact.judged(contact.drawn(seed))) not in contact.RIGHT] == []


@pytest.mark.parametrize("seed", long_after(1, [8, 961]))
def test_small_steps_of_another_law_contradict_a_scene(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """With a twentieth less gravity they do, also where starts nearby part: number 961 has 96 impacts."""

    def lighter(scene: Scene, steps: int, until_s: float) -> Ends:
        return stepped(Scene(**{**dict(scene), "gravity_m_s2": (0.0, -0.95 * G)}), steps, until_s)

    monkeypatch.setattr(contact, "stepped", lighter)
    monkeypatch.setattr(contact, "REFINED", 1)
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
