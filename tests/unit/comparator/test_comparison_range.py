"""The range of a comparison: it ends where no step can show more bounces, on a floor or in a crush."""

import math
from dataclasses import replace

import numpy as np
from tests.cases import each, release_after
from tests.planted.faults import drop_impact
from tests.scene_builders import alter_impact, disc_at, staged, wall_at

from carom import compare, solve_pic, solve_pit
from carom.comparator import Grade
from carom.comparator.comparison_range import _find_falling_back, clip_before_rest
from carom.comparator.match_impacts import ComparisonRange
from carom.model.scene import Scene

#: Nothing ends it.
WHOLE = ComparisonRange(10**6, math.inf)


def build_drop_scene(restitution: float, height_m: float, *, duration_s: float = 3.0, tilt: float = 0.0) -> Scene:
    """A disc of half a metre falls with 10 m/s^2 on a floor, which is level or falls off to one side."""
    ball, floor = disc_at(0, height_m, 0.4), wall_at(0, 0, tilt, 1)
    return staged("dropped", ball, floor, wall_restitution=restitution, gravity_m_s2=(0, -10), duration_s=duration_s)


@each("heights", release_after(1, [2, 6]))
@each("frame_rate_hz", release_after(1, [60, 240, 960]))
@each("tilt", release_after(1, [0.3, 0.0]))
@each("restitution", release_after(1, [0.7, 0.0, 0.2, 0.5]))
def test_pit_of_a_disc_that_comes_to_rest_is_sampled_at_worst(
    restitution: float, tilt: float, frame_rate_hz: int, heights: int
) -> None:
    """PIT of a bouncing disc that comes to rest is SAMPLED at worst: hops that frames cannot resolve are ignored."""
    rng = np.random.default_rng(7)
    for height_m in rng.uniform(0.65, 1.8, heights).tolist():
        scene = build_drop_scene(restitution, height_m, tilt=tilt)
        reference, pit = solve_pic(scene), solve_pit(scene, frame_rate_hz=frame_rate_hz)
        assert reference.contact_s < scene.duration_s
        score = compare(reference, pit, sampling=pit)
        assert score.grade in {Grade.SAMPLED, Grade.CLOSE, Grade.EXACT}, (height_m, score.findings)
        assert score.expected >= 1


@each("row", [0, 1, 2])
def test_bounce_that_frames_can_resolve_counts(row: int) -> None:
    """A run without one of the first three bounces of a ball with e = 1/2 is INACCURATE or WRONG."""
    # Those bounces are 10 frames apart or more.
    scene = build_drop_scene(0.5, 1.5)
    pit = solve_pit(scene, frame_rate_hz=240)
    score = compare(solve_pic(scene), drop_impact(pit, row), sampling=pit)
    assert score.grade in {Grade.INACCURATE, Grade.WRONG}
    assert score.total.time_s > 0.1 or score.missed


def test_invented_bounce_before_rest_is_spurious() -> None:
    """A run with an extra impact half way up the first hop has one spurious impact and is WRONG."""
    scene = build_drop_scene(0.5, 1.5)
    pit = solve_pit(scene, frame_rate_hz=240)
    impacts = np.insert(pit.impacts, 1, pit.impacts[0])
    impacts["time_s"][1] += 0.2
    score = compare(solve_pic(scene), replace(pit, impacts=impacts), sampling=pit)
    assert len(score.spurious) == 1
    assert score.grade is Grade.WRONG


@each(
    "scene",
    [
        staged(
            "up",
            *(disc_at(0, 0.5, 0, 3.0), wall_at(0, 1.449, 0, -1)),
            wall_restitution=0.5,
            gravity_m_s2=(0, -10),
            duration_s=0.4,
        ),
        build_drop_scene(1.0, 0.5001),
        staged("slow", disc_at(0, 0.51, 0, -0.001), wall_at(0, 0, 0, 1), wall_restitution=0.5, duration_s=30),
    ],
)
def test_range_is_shortened_only_by_bounces_that_end(scene: Scene) -> None:
    """A light touch of the ceiling, bounces with e = 1, or a slow impact without gravity do not shorten the range."""
    reference = solve_pic(scene)
    assert len(reference.impacts)
    assert clip_before_rest(reference, WHOLE, 1 / 60, solve_pit(scene, frame_rate_hz=60)) == WHOLE


def test_crush_ends_the_range_at_impacts_two_steps_apart() -> None:
    """The range of a crush ends before the first impact that the next one follows within two steps."""
    # These are at 1.625 and 1.75 s, exactly two steps of 1/16 s apart.
    near, far = wall_at(0.0, 0.0, 1.0, 0.0), wall_at(2.5, 0.0, -1.0, 0.0, velocity_m_s=(-1.0, 0.0))
    scene = staged("crush", disc_at(1.0, 0.0, r=0.25), near, far, duration_s=3.0)
    until_s = clip_before_rest(solve_pic(scene), WHOLE, 1 / 16).until_s
    assert until_s == math.nextafter(1.625, 0.0)


@each("parting_m_s, falls_back", [(4.0, True), (5.0, False)])
def test_disc_gets_out_of_a_floor_if_its_speed_exceeds_that_of_a_fall(parting_m_s: float, *, falls_back: bool) -> None:
    r"""A disc found 17/16 m deep in a floor, at 8 m/s^2, gets out at 5 m/s and falls back at 4 m/s.

    To rise by this depth takes ``sqrt(2 * 8 * 17 / 16)``, which is 4.12 m/s.
    """
    scene = staged("deep", disc_at(0, 4.5), wall_at(0, 0, 0, 1), gravity_m_s2=(0, -8), duration_s=1.25)
    found = alter_impact(solve_pic(scene), 0, time_s=1.125, velocity_first_after=(0.0, parting_m_s))
    assert _find_falling_back(found, [0]).tolist() == [falls_back]
