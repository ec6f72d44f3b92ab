"""PIT that leaves out what can find nothing gives what the plain loop gives, to the bit."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.unit.solvers.strategies import line, scenes

from carom.scene import Disc, Scene, Wall
from carom.solvers.pit import skipping as pit_skipping
from carom.solvers.pit.frames import FrameSampledRun, ManyDiscsRun, SkippingRun, solve_pit
from carom.trace import impact_array

PitRun = FrameSampledRun | SkippingRun | ManyDiscsRun


def bits(run: PitRun) -> tuple[bytes, bytes, bytes, tuple[int, ...]]:
    """Everything that a run has found out, as bytes: -0 differs from 0 here, too."""
    position, velocity = np.ascontiguousarray(run.positions()), np.ascontiguousarray(run.velocities())
    return impact_array(run.log.records).tobytes(), position.tobytes(), velocity.tobytes(), run.log.ambiguous()


def after(run: PitRun, frames_s: list[float], at_once: int) -> PitRun:
    for k in range(0, len(frames_s), at_once):
        run.advance_frames(frames_s[k : k + at_once])
    return run


@settings(max_examples=400)
@given(
    scene=scenes(max_discs=7),
    rate=st.sampled_from([0.7, 3.0, 7.0, 12.0, 24.0]),
    at_once=st.sampled_from([1, 5, 1000]),
)
def test_impacts_velocities_and_positions_are_the_plain_loops_to_the_bit(
    scene: Scene, rate: float, at_once: int
) -> None:
    """On all scenes, both ways of skipping end in the very bytes of the plain loop, taken frame by frame or not.

    At the low rates discs are found deep inside each other, so that one impact turns a disc towards others that it
    overlaps already.
    """
    frames = [k / rate for k in range(1, scene.step_count(1 / rate))] + [scene.duration_s]
    plain = bits(after(FrameSampledRun(scene), frames, at_once))
    assert bits(after(SkippingRun(scene), frames, at_once)) == plain
    assert bits(after(ManyDiscsRun(scene), frames, at_once)) == plain


def crowd(rng: np.random.Generator, *, speed: float, spread: float, far: float) -> Scene:
    """Two dozen discs close together in a box, one in eight immovable, some at rest, `far` from the origin."""
    side, discs = 5, []
    for k in range(side * side - 1):
        radius = 0.45 * rng.uniform(1.0 / spread, 1.0)
        place = np.array([k % side, k // side]) + 0.5 + rng.uniform(-1, 1, 2) * (0.49 - radius)
        mass = math.inf if k % 8 == 3 else float(np.exp(rng.uniform(-3, 3)))
        velocity = (0.0, 0.0) if mass == math.inf or k % 5 == 0 else tuple(rng.normal(size=2) * speed)
        discs.append(Disc(position_m=tuple(place + far), velocity_m_s=velocity, radius_m=radius, mass_kg=mass))
    low, high = (far, far), (far + side, far + side)
    walls = [
        Wall(point_m=low, normal=(1, 0)),
        Wall(point_m=low, normal=(0, 1)),
        Wall(point_m=high, normal=(-1, 0)),
        Wall(point_m=high, normal=(-1, -3)),
    ]
    restitution, wall_restitution = float(rng.choice([1.0, 0.8, 0.0])), float(rng.choice([1.0, 0.5, 0.0]))
    kept = [wall for wall in walls if all(gap(disc, wall) >= 0 for disc in discs)]
    return Scene(
        name="crowd",
        discs=discs,
        walls=kept,
        duration_s=2.0,
        restitution=restitution,
        wall_restitution=wall_restitution,
    )


def gap(disc: Disc, wall: Wall) -> float:
    offset = np.array(disc.position_m) - np.array(wall.point_m)
    return float(offset @ np.array(wall.normal)) - disc.radius_m


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize(("speed", "spread", "far"), [(0.3, 1.1, 0.0), (3.0, 4.0, 0.0), (30.0, 2.0, 1e7)])
def test_crowds_in_a_box_are_the_plain_loops_to_the_bit(seed: int, speed: float, spread: float, far: float) -> None:
    """So it is for crowds in which every impact turns discs towards others, slow, fast, and far from the origin."""
    scene = crowd(np.random.default_rng(seed), speed=speed, spread=spread, far=far)
    frames = [k / 20 for k in range(1, 40)] + [scene.duration_s]
    plain = after(FrameSampledRun(scene), frames, 40)
    assert len(plain.log.records) > 0
    for run in (SkippingRun(scene), ManyDiscsRun(scene)):
        assert bits(after(run, frames, 40)) == bits(plain)


def test_two_discs_far_apart_are_looked_at_a_handful_of_times() -> None:
    """Of 6,000 frames of two discs that meet once, all but a handful are skipped, with the same result."""
    scene = line(0.0, 60.5, velocities=(1.0, 0.0), duration_s=100.0)
    trace, plain = solve_pit(scene, frame_rate_hz=60.0), solve_pit(scene, frame_rate_hz=60.0, skipping=False)
    assert trace.counts["frames"] == plain.counts["frames_looked_at"] == 6000
    assert trace.counts["frames_looked_at"] <= 5
    assert trace.counts["frames_looked_at"] + trace.counts["frames_skipped"] == 6000
    assert trace.impacts.tobytes() == plain.impacts.tobytes()
    assert trace.final_position_m.tobytes() == plain.final_position_m.tobytes()


def test_separating_pairs_are_not_tested() -> None:
    """Discs that fly apart are looked at once, and never again."""
    trace = solve_pit(line(0.0, 1.0, 2.0, velocities=(-1.0, 0.5, 3.0), duration_s=50.0))
    assert trace.counts["frames_looked_at"] == 1
    assert trace.counts["pair_tests"] == 3


def test_bounds_are_renewed_before_rounding_could_use_up_their_margin(monkeypatch: pytest.MonkeyPatch) -> None:
    """After so many frames every bound is found anew, with the same result."""
    scene = line(0.0, 5.5, 7.0, velocities=(1.0, -0.1, -0.3), duration_s=10.0)
    plain = solve_pit(scene, skipping=False)
    monkeypatch.setattr(pit_skipping, "MOST_FRAMES", 50)
    run = SkippingRun(scene)
    run._bounds_hold_to = 50  # noqa: SLF001 - what the patched module would have begun with
    after(run, [k / 60 for k in range(1, 600)] + [10.0], 600)
    assert run.frames_looked_at >= 600 // 50
    assert impact_array(run.log.records).tobytes() == plain.impacts.tobytes()


def test_a_thousand_discs_take_a_hundredth_of_the_pair_tests() -> None:
    """At 1,000 discs, packing .3, 60 frames a second: at most a hundredth of the plain loop's tests, bit-identical."""
    from carom.bench.gas import gas_scene

    scene = gas_scene(1000, 0.3)
    frames = [k / 60 for k in range(1, 4)]
    plain = after(FrameSampledRun(scene), frames, 3)
    fast = after(ManyDiscsRun(scene), frames, 3)
    assert bits(fast) == bits(plain)
    assert len(plain.log.records) > 0
    assert fast.pair_tests * 100 <= plain.pair_tests
