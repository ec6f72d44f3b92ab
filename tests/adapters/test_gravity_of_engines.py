"""Free fall by each engine's documented integrator, landings, and located runs under gravity."""

import math
from dataclasses import replace

import numpy as np
import pytest
from tests.adapters.engine_scenes import scale_tolerance
from tests.cases import each
from tests.scene_builders import Finish, disc_at, require_value, staged, wall_at

from carom import Disc, Scene
from carom.engines.api import Adapter
from carom.execution.adapter_profile import load_supported_adapter
from carom.execution.job import Job, Method, UnsupportedError
from carom.execution.observation.engine_run import observe_run

G = (0.5, -9.81)

#: Positions moved before velocities within a step, as Chipmunk documents of `cpSpaceStep`; the others are
#: semi-implicit: Bullet's `btDiscreteDynamicsWorld`, MuJoCo's "Euler", Box2D's `b2Island::Solve`.
POSITION_FIRST = {"pymunk"}


def _build_falling_scene(velocity: tuple[float, float] = (1.0, 3.0)) -> Scene:
    disc = Disc(position_m=(0.25, 2.0), velocity_m_s=velocity, radius_m=0.5, mass_kg=3.0)
    return staged("fall", disc, disc_at(9, 9, m=math.inf), gravity_m_s2=G, duration_s=1.0)


@each("profile", ["default", "tuned", "located"])
def test_free_fall_follows_the_documented_integrator(engine: Adapter, finish: Finish, profile: str) -> None:
    """After n steps a disc is at x0 + n dt v0 + g dt^2 n(n -+ 1)/2, minus where positions are updated first."""
    assert engine.capabilities.gravity
    scene, dt_s, n = _build_falling_scene(), 1 / 64, 64
    end = finish(engine, scene, dt_s, profile)
    falls = n * (n - 1) / 2 if engine.name in POSITION_FIRST else n * (n + 1) / 2
    disc = scene.discs[0]
    position = np.array(disc.position_m) + n * dt_s * np.array(disc.velocity_m_s) + np.array(G) * dt_s**2 * falls
    velocity = np.array(disc.velocity_m_s) + n * dt_s * np.array(G)
    # Sums of 64 steps, each rounded at no more than 8 m or 8 m/s.
    rounding = scale_tolerance(engine, n * float(np.spacing(8.0)))
    np.testing.assert_allclose(end.position_m[0], position, rtol=0, atol=rounding)
    np.testing.assert_allclose(end.velocity_m_s[0], velocity, rtol=0, atol=rounding)
    assert end.velocity_m_s[1].tolist() == [0, 0]


@each("profile", ["default", "tuned"])
@each("height", [1.0, 1.37])
def test_landing_with_restitution_zero_is_dated_at_the_touch(engine: Adapter, profile: str, height: float) -> None:
    """At e = 0 an impact is within two steps of the touch: noticed one step late, and acting in the next."""
    dt_s = 1 / 60
    bodies, laws = (disc_at(0, 0.5 + height), wall_at(0, 0, 0, 1)), {"wall_restitution": 0, "duration_s": 2.0}
    scene = staged("landing", *bodies, gravity_m_s2=(0, -9.81), **laws)
    trace = observe_run(engine, scene, profile, dt_s)
    assert abs(require_value(trace.effective_time_s)[0] - math.sqrt(2 * height / 9.81)) < 2 * dt_s


def _build_drop_scene() -> Scene:
    """An elastic disc that falls half a metre to the floor, and comes back for ever."""
    return staged("drop", disc_at(0, 0.7, r=0.2), wall_at(0, 0, 0, 1), gravity_m_s2=(0, -9.81), duration_s=2.6)


def test_located_profile_is_refused_for_falls_onto_fixed_bodies(engine: Adapter) -> None:
    """The located profile is unsupported for falls onto fixed bodies, with the speed error as reason."""
    job = Job(_build_drop_scene(), Method(engine.name, "located"), 1 / 60)
    with pytest.raises(UnsupportedError, match=r"gains or loses up to g dt \(0\.164 m/s\)"):
        load_supported_adapter(job)
    load_supported_adapter(replace(job, method=Method(engine.name, "tuned")))
    post = disc_at(0, -1, m=math.inf)
    onto_post = _build_drop_scene().model_copy(update={"walls": (), "discs": (*_build_drop_scene().discs, post)})
    with pytest.raises(UnsupportedError, match="this profile ends steps at impacts"):
        load_supported_adapter(replace(job, scene=onto_post))


def test_impact_of_two_falling_discs_is_located_to_rounding(engine: Adapter) -> None:
    """If only falling discs collide, a located run is allowed, and its impact has the time without gravity."""
    discs = [disc_at(-1, 0, 1, r=0.25), disc_at(1, 0.1, -1, r=0.25)]
    scene = staged("pair", *discs, gravity_m_s2=(0, -9.81), duration_s=1.5)
    job = Job(scene, Method(engine.name, "located"), 1 / 60)
    trace = observe_run(load_supported_adapter(job), scene, "located", 1 / 60)
    # The centres are 0.5 apart where they meet, 0.1 of it across, and close at 2 m/s from 2 apart.
    meeting_s = (2 - math.sqrt(0.5**2 - 0.1**2)) / 2
    assert trace.impacts["time_s"].tolist() == pytest.approx([meeting_s], abs=scale_tolerance(engine, 1e-12))
