"""Discs that are slowed down, on a table or damped: times against bisection, closed forms and energy."""

import math
import random

import numpy as np
import pytest
from tests.cases import each
from tests.random_scenes import draw_table_friction_scene
from tests.scene_builders import disc_at, require_value, staged

from carom import Chain, Disc, Outcome, Scene, SceneError, Wall, solve_pic, solve_pit
from carom.catalogue import CatalogueScene, find_scenes
from carom.model.energy import kinetic_energy
from carom.model.flights import free_flights
from carom.report.tracks import SHARPNESS, build_reference_tracks

A = 2.0


def position_at(disc: Disc, time: float) -> tuple[float, float]:
    """Return where a disc is that meets nothing: by its way, from its middle speed."""
    speed = math.hypot(*disc.velocity_m_s)
    lasts = min(time, speed / A) if speed else 0.0
    share = lasts - 0.5 * A * lasts * lasts / speed if speed else 0.0
    return disc.position_m[0] + share * disc.velocity_m_s[0], disc.position_m[1] + share * disc.velocity_m_s[1]


def compute_gap(one: Disc, other: Disc, time: float) -> float:
    return math.dist(position_at(one, time), position_at(other, time)) - one.radius_m - other.radius_m


def test_impact_times_on_a_table_match_bisection() -> None:
    """Random pairs of decelerated discs meet at the time found by bisection, to 4e-15 s, or neither finds one."""
    rng, met = random.Random(3), 0
    for _ in range(60):
        one = disc_at(rng.uniform(-2, 2), rng.uniform(-2, 2), rng.uniform(-4, 4), rng.uniform(-4, 4))
        moves = rng.choice((0.0, 1.0))
        place, velocity = ((rng.uniform(-most, most), rng.uniform(-most, most)) for most in (2, moves * 4))
        other = disc_at(*place, *velocity, r=0.8)
        if compute_gap(one, other, 0.0) <= 0.0:
            continue
        scene = staged("pair", one, other, table_deceleration_m_s2=A, duration_s=3.0)
        times = solve_pic(scene, max_impacts=1).impacts["time_s"]
        grid = next((k for k in range(1500) if compute_gap(one, other, 0.002 * (k + 1)) < 0.0), None)
        assert (grid is None) == (len(times) == 0)
        if grid is not None:
            low, high = 0.002 * grid, 0.002 * (grid + 1)
            for _ in range(60):
                middle = 0.5 * (low + high)
                low, high = (middle, high) if compute_gap(one, other, middle) > 0.0 else (low, middle)
            assert times[0] == pytest.approx(high, abs=4e-15)
            met += 1
    assert met > 5


def test_disc_on_a_dead_wall_stops_after_the_known_distance() -> None:
    """After a wall of restitution 0 at any angle a disc slides along it for u^2 / 2a and stops there."""
    rng = random.Random(5)
    for number in range(40):
        turn, u, radius = rng.uniform(0, 2 * math.pi), rng.uniform(0.1, 2), rng.uniform(0.1, 0.5)
        along, off = np.array((math.cos(turn), math.sin(turn))), np.array((-math.sin(turn), math.cos(turn)))
        onto = Wall(point_m=(0, 0), normal=off) if number % 2 else Chain(points_m=[tuple(-9 * along), tuple(9 * along)])
        disc = Disc(position_m=radius * off, velocity_m_s=u * along - rng.uniform(0, 2) * off, radius_m=radius)
        trace = solve_pic(staged("along", disc, onto, wall_restitution=0, table_deceleration_m_s2=A, duration_s=3))
        assert (trace.outcome, len(trace.impacts)) == (Outcome.COMPLETED, 1)
        assert trace.final_velocity_m_s.tolist() == [[0.0, 0.0]]
        np.testing.assert_allclose(trace.final_position_m[0], radius * off + u * u / (2 * A) * along, atol=1e-14)


@each("angle", [0.3, 2.0, 4.0])
def test_pit_moves_a_disc_on_a_table_along_the_known_path(angle: float) -> None:
    """In any direction, PIT has a slowed disc after 1 s and after its stop where the law of the table has it."""
    disc = disc_at(0.25, -0.5, 3.0 * math.cos(angle), 3.0 * math.sin(angle))
    for duration_s in (1.0, 2.0):  # it stops after 3 / A = 1.5 s
        scene = staged("table", disc, duration_s=duration_s, table_deceleration_m_s2=A)
        (found,) = solve_pit(scene, frame_rate_hz=60.0).final_position_m
        assert found == pytest.approx(position_at(disc, duration_s), rel=1e-12)


def test_table_removes_energy_m_a_per_metre() -> None:
    """On 20 random tables the initial energy equals the losses of impacts plus m a times the distances."""
    met = 0
    for number in range(20):
        scene = draw_table_friction_scene(number).model_copy(update={"duration_s": 60.0})
        trace = solve_pic(scene)
        if trace.outcome is Outcome.GLIDES:  # it ends after infinitely many hops along a ring
            continue
        assert not trace.final_velocity_m_s.any()
        movable = np.where(np.isfinite(scene.arrays.mass_kg), scene.arrays.mass_kg, 0.0)
        taken = scene.table_deceleration_m_s2 * sum(
            movable[flight.disc] * math.dist(flight.position_at(flight.end_s), flight.position_m)
            for flight in free_flights(trace)
        )
        for impact in trace.impacts:
            for side, sign in (("before", 1.0), ("after", -1.0)):
                for which in ("first", "second")[: 1 + int(impact["second"] >= 0)]:
                    velocity = impact[f"velocity_{which}_{side}"]
                    taken += sign * 0.5 * movable[impact[which]] * float(velocity @ velocity)
        assert kinetic_energy(scene, scene.arrays.velocity_m_s) == pytest.approx(taken, rel=1e-12), number
        met += len(trace.impacts)
    assert met > 40


@each(
    "field, fields, why",
    [
        ("table_deceleration_m_s2", {}, "with gravity"),
        ("table_deceleration_m_s2", {"gravity_m_s2": (0.0, 0.0), "damping_per_s": 0.1}, "with damping"),
        (
            "table_deceleration_m_s2",
            {"gravity_m_s2": (0.0, 0.0), "discs": [disc_at(0.0, 0.0, spin_rad_s=1.0)]},
            "with friction or spin",
        ),
        ("wall_rolling_resistance", {"gravity_m_s2": (0.0, 0.0)}, "without gravity"),
        ("wall_rolling_resistance", {"wall_tangential_restitution": 0.5}, "with wall_tangential"),
    ],
)
def test_resistance_without_a_closed_form_is_refused(field: str, fields: dict[str, object], why: str) -> None:
    """Table deceleration or rolling resistance in an unsupported combination is refused by name and reason."""
    asked = {"name": "t", "discs": [disc_at(0.0, 0.0)], "gravity_m_s2": (0.0, -1.0), "duration_s": 1.0} | fields
    with pytest.raises(SceneError, match=rf"{field}: must be 0 in a scene {why}"):
        Scene(**{**asked, field: 0.1})


@each("entry", find_scenes(["contact/damped-*"]))
def test_drawn_tracks_follow_damped_discs(entry: CatalogueScene) -> None:
    """A drawn track differs from the sampled path by at most twice its sharpness of the largest extent."""
    times = np.linspace(0.0, entry.scene.duration_s, 97).tolist()
    trace = solve_pic(entry.scene, sample_times_s=times)
    samples = require_value(trace.samples)
    assert len(samples.time_s) == 97
    way = np.ptp(np.concatenate([samples.position_m, [trace.final_position_m]]), axis=0).max()
    for disc, track in enumerate(build_reference_tracks(trace)):
        off = np.abs(track.positions_at(samples.time_s) - samples.position_m[:, disc]).max()
        assert off <= 2.0 * SHARPNESS * way  # of both axes
