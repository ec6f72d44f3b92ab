"""Local errors: each impact against the closed form from the method's own state before it, on finite walls, too."""

import dataclasses
import math

import numpy as np
import pytest
from tests.cases import each

import carom
from carom import Scene, compare, solve_pic, solve_pit
from carom.catalogue import catalogue
from carom.comparator.measure.local_errors import find_own_states, measure_local_errors
from carom.comparator.scales import compute_scales
from carom.engines.registry import load_adapter
from carom.execution.observation.engine_run import observe_run

#: Rounding of positions of order 1 over relative speeds of order 0.1, at paths of a few lengths.
ROUNDING = 1e-12


def build_long_gas(duration_s: float) -> Scene:
    gas = catalogue()["classics/gas"].scene
    return gas.model_copy(update={"duration_s": duration_s})


def test_pic_has_no_local_errors_in_a_long_gas() -> None:
    """Each of over 1000 impacts of PIC in a gas follows from the state before it, to 1e-9."""
    trace = solve_pic(build_long_gas(30.0))
    assert len(trace.impacts) > 1000
    local = measure_local_errors(trace, compute_scales(trace.scene, trace))
    assert local.scored == len(trace.impacts)
    assert local.spurious == ()
    for name in ("velocity", "restitution", "energy", "time_s"):
        assert local.worst(name) < 1e-9, name  # the flattest graze of thousands: the normal takes what the time leaves
        assert local.median(name) < ROUNDING, name


def test_local_error_of_a_fault_beyond_the_horizon_is_exact() -> None:
    """In a gas far beyond its horizon, 3% less restitution in one impact is a local error of -0.03 there."""
    trace = solve_pic(build_long_gas(30.0))
    at = len(trace.impacts) - 100
    row = trace.impacts[at]
    impacts = trace.impacts.copy()
    centre = 0.5 * (row["velocity_first_before"] + row["velocity_second_before"]) if row["second"] >= 0 else 0.0
    for name in ("velocity_first_after", "velocity_second_after"):
        along = float((row[name] - centre) @ row["normal"])
        impacts[name][at] -= 0.03 * along * row["normal"]
    if row["second"] < 0:
        impacts["velocity_second_after"][at] = 0.0
    faulty = dataclasses.replace(trace, impacts=impacts, state_before=find_own_states(trace))
    local = measure_local_errors(faulty, compute_scales(trace.scene, trace))
    assert int(np.argmax(np.abs(local.restitution))) == at
    assert local.restitution[at] == pytest.approx(-0.03, abs=1e-9)


@each("name", ["paper/late", "paper/wrong-direction", "classics/deflection", "classics/sorting"])
def test_local_errors_of_pit_are_those_of_sampling(name: str) -> None:
    """The local errors of PIT are all due to sampling, to 1e-12, and it is late by less than one step."""
    scene = catalogue()[name].scene
    reference = solve_pic(scene)
    for pit in (solve_pit(scene), observe_run(load_adapter("pit"), scene, "tuned", 1 / scene.frame_rate_hz)):
        local = compare(reference, pit, sampling=pit).local
        assert local.scored == len(pit.impacts) > 0
        assert local.worst("solver_velocity") < ROUNDING
        np.testing.assert_allclose(local.sampling_velocity, local.velocity, rtol=0, atol=ROUNDING)
        assert np.all(local.time_s >= -ROUNDING)
        assert np.all(local.time_s < pit.dt_s + ROUNDING)
        # The first contact of paper/late is at 9.1 frames, and PIT finds it at frame 10.
        assert name != "paper/late" or local.time_s[0] / pit.dt_s == pytest.approx(0.9, abs=1e-12)


def test_impact_of_discs_that_pass_is_locally_spurious() -> None:
    """An impact of two discs that pass each other is spurious; without impacts there is no error."""
    scene, hit = catalogue()["classics/miss"].scene, catalogue()["classics/graze"].scene
    invented, right = dataclasses.replace(solve_pic(hit), scene=scene), solve_pic(scene)
    assert measure_local_errors(invented, compute_scales(scene, right)).spurious == (0,)
    local = measure_local_errors(right, compute_scales(scene, right))
    assert local.scored == 0
    assert math.isnan(local.median("velocity"))


@each("name", ["end-of-wall", "box-of-edges", "star", "stadium-rhombus"])
def test_local_errors_of_pit_at_finite_walls_are_those_of_sampling(name: str) -> None:
    """At finite walls the local errors of PIT are all due to sampling, and PIC has none, to 1e-14."""
    scene = carom.scene(f"tables/{name}")
    reference = carom.solve_pic(scene)
    scales = compute_scales(scene, reference)
    assert measure_local_errors(reference, scales).worst("velocity") < 1e-14
    found = measure_local_errors(observe_run(load_adapter("pit"), scene, "tuned", 1 / 60), scales)
    assert found.spurious == ()
    assert found.worst("solver_velocity") < 1e-14
    assert (found.worst("sampling_velocity") > 1e-3) is (name != "box-of-edges")  # faces have one normal everywhere
