"""Ensembles are, scene by scene and to the bit, what the solvers give."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from typing import Any

import numpy as np
import pytest
from tests.forms import plain_form

from carom.disc_arrays import DiscArrays
from carom.errors import InputError
from carom.scene import Disc, Scene
from carom.solvers.ensemble import TwoDiscEnsemble, pic_ensemble, pit_ensemble
from carom.solvers.pic import solve_pic
from carom.solvers.pit.solve import solve_pit

COUNT = 400


@pytest.fixture(scope="module")
def ensemble() -> TwoDiscEnsemble:
    """Pairs that come from all sides, of all masses, a few of them immovable; half are on a course to meet."""
    rng = np.random.default_rng(5)
    place = rng.uniform(-3, 3, (2, COUNT, 2))
    place[1] += np.sign(place[1]) * 3
    velocity = rng.normal(size=(2, COUNT, 2))
    velocity[1, ::2] = (place[0] - place[1])[::2] * 0.7 + velocity[0, ::2] + 0.3 * velocity[1, ::2]
    mass = np.exp(rng.uniform(-3, 3, (2, COUNT)))
    mass[0, ::9] = math.inf
    velocity[0, ::9] = 0.0
    radius = rng.uniform(0.1, 0.6, (2, COUNT))
    return TwoDiscEnsemble.of(
        place[0], velocity[0], radius[0], place[1], velocity[1], radius[1], mass[0], mass[1], restitution=0.8
    )


def scene_of(e: TwoDiscEnsemble, k: int, duration_s: float) -> Scene:
    discs = []
    for d in (e.first, e.second):
        place, velocity = tuple(d.position_m[k]), tuple(d.velocity_m_s[k])
        discs.append(Disc(position_m=place, velocity_m_s=velocity, radius_m=d.radius_m[k], mass_kg=d.mass_kg[k]))
    return Scene(name="pair", discs=discs, restitution=e.first.restitution, duration_s=duration_s)


def test_pic_of_an_ensemble_is_pic_of_each_scene(ensemble: TwoDiscEnsemble) -> None:
    """Each impact is that of `solve_pic`, to the bit, and at infinity where there is none."""
    found, impacts = pic_ensemble(ensemble, 6.0), 0
    for k in range(COUNT):
        scene = scene_of(ensemble, k, 6.0)
        trace = solve_pic(scene)
        assert math.isfinite(found["time_s"][k]) == (len(trace.impacts) > 0)
        if len(trace.impacts):
            impacts += 1
            assert found[k].tobytes() == trace.impacts[0].tobytes()
    assert impacts > COUNT // 4


@pytest.mark.parametrize("rate", [0.9, 8.0, 60.0])
def test_pit_of_an_ensemble_is_pit_of_each_scene(ensemble: TwoDiscEnsemble, rate: float) -> None:
    """So it is for PIT, at high and at low frame rates."""
    duration = 6.0
    frames = math.ceil(duration * rate)
    found, impacts = pit_ensemble(ensemble, rate, frames), 0
    for k in range(COUNT):
        scene = scene_of(ensemble, k, duration)
        assert scene.step_count(1 / rate) == frames
        trace = solve_pit(scene, frame_rate_hz=rate)
        assert math.isfinite(found["time_s"][k]) == (len(trace.impacts) > 0)
        if len(trace.impacts):
            impacts += 1
            assert found[k].tobytes() == trace.impacts[0].tobytes()
    assert impacts > COUNT // 20


@pytest.mark.parametrize("frames", [0, 1, 200])
def test_plain_and_compiled_ensembles_agree_to_the_bit(ensemble: TwoDiscEnsemble, frames: int) -> None:
    """In plain Python, and on any number of threads, each value is that of the compiled loop on one."""
    alone = pic_ensemble(ensemble, 2.5, threads=1), pit_ensemble(ensemble, 60.0, frames, threads=1)
    with plain_form():
        plain = pic_ensemble(ensemble, 2.5), pit_ensemble(ensemble, 60.0, frames)
    many = TwoDiscEnsemble(*(repeated(discs, 100) for discs in (ensemble.first, ensemble.second)))
    side_by_side = pic_ensemble(many, 2.5), pit_ensemble(many, 60.0, frames)
    for one, other, parts in zip(alone, plain, side_by_side, strict=True):
        assert other.tobytes() == one.tobytes()
        assert parts.tobytes() == np.concatenate([one] * 100).tobytes()


def repeated(discs: DiscArrays, times: int) -> DiscArrays:
    place, velocity = (np.concatenate([array] * times) for array in (discs.position_m, discs.velocity_m_s))
    radius, mass = (np.concatenate([array] * times) for array in (discs.radius_m, discs.mass_kg))
    return DiscArrays(place, velocity, radius, mass, restitution=discs.restitution)


def test_pit_misses_the_share_that_was_measured_before() -> None:
    """Impact parameters spread evenly, advances .5, 1, 2 and 4: the share missed is E[max(0, 1 - sqrt(1 - b^2)/a)].

    By the midpoint rule over b; a sample of N differs by a few standard deviations at most, sqrt(p (1-p)/N).
    """
    count = 20_000
    rng = np.random.default_rng(8)
    b = (np.arange(2000) + 0.5) / 2000
    for a in (0.5, 1.0, 2.0, 4.0):
        offset, phase = rng.random(count), rng.random(count)
        start = -np.sqrt(1 - offset**2) - a * (1 + phase)
        nothing = np.zeros(count)
        first, second = np.stack([start, nothing], axis=1), np.stack([nothing, offset], axis=1)
        pairs = TwoDiscEnsemble.of(first, (a, 0.0), 0.5, second, (0.0, 0.0), 0.5)
        assert np.isfinite(pic_ensemble(pairs)["time_s"]).all()
        missed = float(np.mean(np.isinf(pit_ensemble(pairs, 1.0, 8)["time_s"])))
        expected = float(np.mean(np.maximum(0.0, 1 - np.sqrt(1 - b**2) / a)))
        assert abs(missed - expected) < 4 * math.sqrt(max(expected, 1 / count) / count)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"radius_first": 0.0}, "the first discs: radius_m and mass_kg must be above 0"),
        ({"mass_first": math.inf, "mass_second": math.inf}, "must not both be infinite"),
        ({"restitution": 1.5}, "must lie in 0 to 1"),
        ({"position_first": [[math.nan, 0.0]]}, "the first discs: position_m must be finite"),
        ({"position_first": [0.0]}, "x and y along their last axis"),
        ({"mass_second": math.inf, "velocity_second": [[1.0, 0.0]]}, "the second discs: velocity_m_s must be"),
    ],
)
def test_an_ensemble_that_is_none_is_refused(change: dict[str, Any], words: str) -> None:
    """A value outside its range is refused, by name."""
    plain: dict[str, Any] = {
        "position_first": [[0.0, 0.0]],
        "velocity_first": [[0.0, 0.0]],
        "radius_first": 1.0,
        "position_second": [[3.0, 0.0]],
        "velocity_second": [[0.0, 0.0]],
        "radius_second": 1.0,
    }
    with pytest.raises(InputError, match=words):
        TwoDiscEnsemble.of(**{**plain, **change})


@pytest.mark.parametrize("form", [nullcontext, plain_form])
def test_impacts_too_far_out_are_refused(form: Callable[[], AbstractContextManager[object]]) -> None:
    """Where floats do not tell two centres in contact apart, the ensemble is refused, as a scene is."""
    pairs = TwoDiscEnsemble.of([[1e16, 0.0]], (1.0, 0.0), 1.0, [[1e16 + 8.0, 0.0]], (0.0, 0.0), 1.0)
    with form(), pytest.raises(InputError, match="tell their centres apart"):
        pic_ensemble(pairs)


def test_a_number_of_threads_below_one_is_refused(ensemble: TwoDiscEnsemble) -> None:
    """Fewer than one thread can't run anything."""
    with pytest.raises(InputError, match="threads must be 1 or more, got 0"):
        pic_ensemble(ensemble, threads=0)
