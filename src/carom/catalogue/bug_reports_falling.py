"""Complaints about falling and bouncing: a ball is dropped on a floor. These scenes need gravity."""

from __future__ import annotations

import math

from carom.catalogue.bug_report import complained, gains_energy, loses_energy, never_bounces
from carom.catalogue.classics_walled import FLOOR
from carom.catalogue.closed_forms import answered, disc, impact, scene_of
from carom.catalogue.entry import Staged

_OURS = "The thread gives no other sizes; the rest is chosen here."


def _dropped(
    *,
    height_m: float,
    duration_s: float,
    radius_m: float = 0.5,
    gravity_m_s2: float = 9.81,
    restitution: float = 1.0,
    rate_hz: float = 60.0,
    spin_rad_s: float = 0.0,
) -> Staged:
    """Stage a ball that is dropped from rest, with its lowest point `height_m` above a floor."""
    scene = scene_of(
        discs=[disc(complex(0, radius_m + height_m), 0j, radius_m, spin_rad_s=spin_rad_s)],
        walls=[FLOOR],
        wall_restitution=restitution,
        gravity_m_s2=(0.0, -gravity_m_s2),
        duration_s=duration_s,
        frame_rate_hz=rate_hz,
    )
    time = math.sqrt(2 * height_m / gravity_m_s2)
    speed = gravity_m_s2 * time
    impacts = []
    while time <= duration_s:
        speed *= restitution
        impacts.append(impact(time, 0, -1, complex(0, speed)))
        since, time = time, time + 2 * speed / gravity_m_s2
    left = duration_s - since
    source = (
        "Free fall: the ball arrives at gt, leaves at e times that, and each flight takes 2v/g, e times the last one"
    )
    height, rising = radius_m + speed * left - gravity_m_s2 * left**2 / 2, speed - gravity_m_s2 * left
    return answered(scene, impacts, source, final=[(complex(0, height), complex(0, rising))])


@loses_energy(
    thread="https://github.com/bulletphysics/bullet3/issues/1530",
    reported="Dropped from small heights an ideal ball keeps its energy. Dropped from 10 m it loses energy at every "
    "bounce, until it bounces to some 4.5 m.",
    made=f"The height is from the thread. {_OURS}",
)
def _bullet3_1530() -> Staged:
    """An elastic ball is dropped from 10 m."""
    return _dropped(height_m=10.0, duration_s=20.0, rate_hz=240.0)


@gains_energy(
    thread="https://github.com/dimforge/rapier/issues/97",
    reported="A ball dropped on a static box, both with restitution 1, bounces higher and higher.",
    made=_OURS,
)
def _rapier_97() -> Staged:
    """An elastic ball is dropped on a floor."""
    return _dropped(height_m=4.0, duration_s=10.0)


@loses_energy(
    thread="https://github.com/dimforge/rapier/issues/974",
    reported="In a beta a ball always rebounds to 1 % of the drop, instead of the square of its restitution.",
    at_least=0.25,
    made="Height and restitution are from the thread. The run ends at the first apex, where the thread measures.",
)
def _rapier_974() -> Staged:
    """A ball of restitution .8 is dropped from 2 m."""
    # The first apex is at sqrt(2 h / g) down and e times that up.
    down = math.sqrt(4.0 / 9.81)
    return _dropped(height_m=2.0, restitution=0.8, duration_s=down + 0.8 * down)


@gains_energy(
    thread="https://github.com/erincatto/box2d/issues/76",
    reported="In the test of varying restitution the last ball, with restitution 1, jumps higher than before.",
    made=f"The thread names the test; {_OURS[0].lower()}{_OURS[1:]}",
)
def _box2d_76() -> Staged:
    """An elastic ball is dropped from 19 m."""
    return _dropped(height_m=19.0, radius_m=1.0, gravity_m_s2=10.0, duration_s=20.0)


@gains_energy(
    thread="https://github.com/erincatto/box2d/issues/167",
    reported="A sphere of restitution 1 jumps higher and higher instead of to the same height.",
    made=_OURS,
)
def _box2d_167() -> Staged:
    """An elastic ball is dropped from 5 m and bounces for half a minute."""
    return _dropped(height_m=5.0, radius_m=1.0, gravity_m_s2=10.0, duration_s=30.0)


@gains_energy(
    thread="https://github.com/jrouwe/JoltPhysics/issues/1286",
    reported="With restitution 1 and no damping, every bounce goes higher than the one before.",
    made=_OURS,
)
def _jolt_1286() -> Staged:
    """An elastic ball is dropped from 3 m."""
    return _dropped(height_m=3.0, duration_s=15.0)


@loses_energy(
    thread="https://github.com/avianphysics/avian/issues/594",
    reported="The bounces of a ball of restitution 1 decay quickly: contacts that are found early absorb the impact.",
    made=f"Gravity and the 120 steps per second are from the thread. {_OURS}",
)
def _avian_594() -> Staged:
    """An elastic ball bounces under ten times the usual gravity."""
    return _dropped(height_m=50.0, radius_m=10.0, gravity_m_s2=98.1, duration_s=10.0, rate_hz=120.0)


@loses_energy(
    thread="https://github.com/avianphysics/avian/issues/200",
    reported="Without friction and with restitution 1 a ball bounces for ever, but a spinning ball bounces ever lower.",
    made=f"The ball spins, and is dropped without friction, as in a comment of the thread. {_OURS}",
)
def _avian_200() -> Staged:
    """An elastic ball that spins is dropped on a smooth floor: without friction its spin has no effect."""
    return _dropped(height_m=1.0, duration_s=5.0, spin_rad_s=10.0)


@loses_energy(
    thread="https://github.com/liabru/matter-js/issues/256",
    reported="With restitution 1 and without any friction each bounce loses energy, and balls stick to walls.",
    made="Ball, ground and fall are from a page in the thread, at 100 pixels a metre. Gravity is the engine's.",
)
def _matter_256() -> Staged:
    """A ball of 80 cm falls 3 m to the ground, without friction and with restitution 1."""
    return _dropped(height_m=3.0, radius_m=0.8, gravity_m_s2=10.0, duration_s=12.0)


@gains_energy(
    thread="https://github.com/piqnt/planck.js/issues/223",
    reported="A small ball of restitution 1 bounces higher and higher.",
    made="Radius, gravity, step and height of the fall are from the script in the thread.",
)
def _planck_223() -> Staged:
    """A ball of 6.6 cm falls 2.5 m on a box."""
    height = 6.133333333333334 - 0.266 - (3.3333333333333335 + 0.066)
    return _dropped(height_m=height, radius_m=0.066, gravity_m_s2=9.0, duration_s=10.0)


@never_bounces(
    thread="https://github.com/NVIDIAGameWorks/PhysX/issues/351",
    reported="A ball's last bounces are missing: below a threshold, 2 m/s by default, it does not bounce at all.",
    made=f"The restitution is the mean of 1 and 1/2, those in the thread. {_OURS}",
)
def _physx_351() -> Staged:
    """A ball bounces five times on the ground, three of them at less than 2 m/s."""
    return _dropped(height_m=0.5, restitution=0.75, radius_m=0.25, duration_s=1.75)


@complained(
    thread="https://github.com/godot-jolt/godot-jolt/issues/374",
    reported="The smaller a ball is, the stranger it bounces: small balls gain height or do not bounce.",
    made=_OURS,
)
def _godot_jolt_374() -> Staged:
    """An elastic ball of 2 cm is dropped from a metre."""
    return _dropped(height_m=1.0, radius_m=0.02, duration_s=4.0)


@gains_energy(
    thread="https://github.com/chandlerprall/Physijs/issues/195",
    reported="A ball of restitution 1 bounces higher than it fell.",
    made="Radius and height are from the thread; gravity is chosen here.",
)
def _physijs_195() -> Staged:
    """A ball with a radius of 3 m is dropped, with its centre 30 m above the ground."""
    return _dropped(height_m=27.0, radius_m=3.0, duration_s=15.0)


@loses_energy(
    package="physicshub",
    thread="https://github.com/physicshub/physicshub.github.io/pull/303",
    reported="Balls lost energy at each bounce even with restitution 1: gravity was set to zero before the bounce "
    "could account for it.",
    made=_OURS,
)
def _physicshub_303() -> Staged:
    """An elastic ball is dropped from 2 m."""
    return _dropped(height_m=2.0, radius_m=0.25, duration_s=6.0)


@never_bounces(
    thread="https://github.com/viblo/pymunk/issues/11",
    reported="Elasticity had no effect: all impacts were inelastic until a number of elastic iterations was set.",
    made=_OURS,
)
def _pymunk_11() -> Staged:
    """A ball of restitution 4/5 is dropped from a metre."""
    return _dropped(height_m=1.0, radius_m=0.1, restitution=0.8, duration_s=1.5)
