"""Complaints about falling and bouncing: a ball dropped on a floor, again and again. These scenes need gravity."""

from __future__ import annotations

import math

from carom.catalogue.bug_report import complained, gains_energy, loses_energy, never_bounces
from carom.catalogue.closed_forms import answered, disc, impact, scene_of
from carom.catalogue.entry import Staged
from carom.catalogue.walled import FLOOR

_OURS = "The thread gives no other sizes; the rest are ours."


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
    """Stage a ball that is dropped from rest on a floor, `height_m` below its lowest point."""
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
        "Free fall: the floor is met at gt, left at e times that, and each flight takes 2v/g, e times the one before"
    )
    height, rising = radius_m + speed * left - gravity_m_s2 * left**2 / 2, speed - gravity_m_s2 * left
    return answered(scene, impacts, source, final=[(complex(0, height), complex(0, rising))])


@loses_energy(
    thread="https://github.com/bulletphysics/bullet3/issues/1530",
    reported="Dropped from small heights an ideal ball keeps its energy; from 10 m it loses some with every "
    "bounce until it bounces to some 4.5 m.",
    made=f"The height is the thread's. {_OURS}",
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
    reported="In a beta a ball rebounds to 1 % of the drop whatever its restitution, instead of the square of it.",
    at_least=0.25,
    made="Height and restitution are the thread's; the run ends at the first apex, where the thread measures.",
)
def _rapier_974() -> Staged:
    """A ball of restitution .8 is dropped from 2 m."""
    # To the first apex: sqrt(2 h / g) down and e times that up.
    down = math.sqrt(4.0 / 9.81)
    return _dropped(height_m=2.0, restitution=0.8, duration_s=down + 0.8 * down)


@gains_energy(
    thread="https://github.com/erincatto/box2d/issues/76",
    reported="In the test of varying restitution the last ball, of restitution 1, jumps higher than before.",
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
    reported="With restitution 1 and no damping every bounce goes higher than the one before.",
    made=_OURS,
)
def _jolt_1286() -> Staged:
    """An elastic ball is dropped from 3 m."""
    return _dropped(height_m=3.0, duration_s=15.0)


@loses_energy(
    thread="https://github.com/avianphysics/avian/issues/594",
    reported="The bounces of a ball of restitution 1 decay quickly: contacts found ahead of time absorb the impact.",
    made=f"Gravity and the 120 steps a second are the thread's. {_OURS}",
)
def _avian_594() -> Staged:
    """An elastic ball bounces under ten times the usual gravity."""
    return _dropped(height_m=50.0, radius_m=10.0, gravity_m_s2=98.1, duration_s=10.0, rate_hz=120.0)


@loses_energy(
    thread="https://github.com/avianphysics/avian/issues/200",
    reported="Without friction and with restitution 1 a ball bounces for ever; one that spins bounces lower each time.",
    made=f"Dropped, spinning, without friction, as in a comment of the thread. {_OURS}",
)
def _avian_200() -> Staged:
    """An elastic ball that spins is dropped on a smooth floor: a spin that rubs on nothing changes nothing."""
    return _dropped(height_m=1.0, duration_s=5.0, spin_rad_s=10.0)


@loses_energy(
    thread="https://github.com/liabru/matter-js/issues/256",
    reported="With restitution 1 and no friction of any kind energy is lost at each bounce, and balls stick to walls.",
    made="Ball, ground and fall are those of a page in the thread, 100 pixels to a metre; the pull is the engine's.",
)
def _matter_256() -> Staged:
    """A ball of 80 cm falls 3 m to the ground, without friction and with restitution 1."""
    return _dropped(height_m=3.0, radius_m=0.8, gravity_m_s2=10.0, duration_s=12.0)


@gains_energy(
    thread="https://github.com/piqnt/planck.js/issues/223",
    reported="A small ball of restitution 1 bounces higher and higher.",
    made="Radius, pull, step and the height of the fall are those of the script in the thread.",
)
def _planck_223() -> Staged:
    """A ball of 6.6 cm falls two metres and a half on a box."""
    height = 6.133333333333334 - 0.266 - (3.3333333333333335 + 0.066)
    return _dropped(height_m=height, radius_m=0.066, gravity_m_s2=9.0, duration_s=10.0)


@never_bounces(
    thread="https://github.com/NVIDIAGameWorks/PhysX/issues/351",
    reported="The last bounces of a ball are missing: below a threshold, 2 m/s as shipped, it does not bounce at all.",
    made=f"The restitution is the mean of the thread's 1 and 1/2. {_OURS}",
)
def _physx_351() -> Staged:
    """A ball bounces five times on the ground, three times of these at less than 2 m/s."""
    return _dropped(height_m=0.5, restitution=0.75, radius_m=0.25, duration_s=1.75)


@complained(
    thread="https://github.com/godot-jolt/godot-jolt/issues/374",
    reported="The smaller a ball, the stranger it bounces: small ones gain height or do not bounce.",
    made=_OURS,
)
def _godot_jolt_374() -> Staged:
    """An elastic ball of 2 cm is dropped from a metre."""
    return _dropped(height_m=1.0, radius_m=0.02, duration_s=4.0)


@gains_energy(
    thread="https://github.com/chandlerprall/Physijs/issues/195",
    reported="A ball of restitution 1 bounces higher than it fell.",
    made="Radius and height are the thread's; the pull is ours.",
)
def _physijs_195() -> Staged:
    """A ball with a radius of 3 m, whose centre is 30 m above the ground, is dropped."""
    return _dropped(height_m=27.0, radius_m=3.0, duration_s=15.0)


@loses_energy(
    package="physicshub",
    thread="https://github.com/physicshub/physicshub.github.io/pull/303",
    reported="Balls lost energy on each bounce even with restitution 1: the pull was set to zero before the bounce "
    "could take account of it.",
    made=_OURS,
)
def _physicshub_303() -> Staged:
    """An elastic ball is dropped from 2 m."""
    return _dropped(height_m=2.0, radius_m=0.25, duration_s=6.0)


@never_bounces(
    thread="https://github.com/viblo/pymunk/issues/11",
    reported="An elasticity changed nothing: all impacts were inelastic until a number of elastic iterations was set.",
    made=_OURS,
)
def _pymunk_11() -> Staged:
    """A ball of restitution 4/5 is dropped from a metre."""
    return _dropped(height_m=1.0, radius_m=0.1, restitution=0.8, duration_s=1.5)
