"""Complaints about impacts of discs: tunnelling, lost restitution, and contact at the start."""

from __future__ import annotations

import math

from carom.catalogue.bug_report import Symptom, complained, loses_energy, misses, never_bounces
from carom.catalogue.closed_forms import after_impact, answered, disc, impact, meeting, scene_of, struck_row
from carom.catalogue.entry import KnownAnswer, Staged

_NEWTON = "Conservation of momentum and Newton's law of restitution, head-on"

_CONVENTION = "Touching discs collide at one instant; impacts are applied one pair at a time, as for vanishing gaps"


def _head_on(
    *,
    speeds: tuple[float, float],
    radius_m: tuple[float, float],
    gap_m: float,
    duration_s: float,
    rate_hz: float = 60.0,
    mass_kg: tuple[float, float] = (1.0, 1.0),
    restitution: float = 1.0,
) -> Staged:
    """Stage two discs that meet head-on; the first starts at the origin and moves to the right."""
    (v0, v1), (r0, r1), (m0, m1) = speeds, radius_m, mass_kg
    scene = scene_of(
        discs=[disc(0j, complex(v0, 0), r0, m0), disc(complex(r0 + r1 + gap_m, 0), complex(v1, 0), r1, m1)],
        restitution=restitution,
        duration_s=duration_s,
        frame_rate_hz=rate_hz,
    )
    after = after_impact(m0, complex(v0, 0), m1, complex(v1, 0), 1 + 0j, restitution)
    return answered(scene, [impact(gap_m / (v0 - v1), 0, 1, *after)], _NEWTON)


@misses(
    thread="https://github.com/google-deepmind/mujoco/issues/441",
    reported="Balls in a cup pass through its wall when the cup moves quickly; the advice is a thicker cup or a "
    "smaller step.",
    made="The cup's wall is an immovable disc of 1 cm; the step is MuJoCo's default. Sizes and speed are chosen here.",
)
def _mujoco_441() -> Staged:
    """A small ball moves towards a thin wall, at four times its own size per step."""
    return _head_on(
        speeds=(60.0, 0.0), radius_m=(0.02, 0.01), gap_m=0.97, mass_kg=(1.0, math.inf), duration_s=0.03, rate_hz=500.0
    )


@complained(
    thread="https://github.com/google-deepmind/mujoco/issues/2080",
    reported="No coefficient of restitution can be set; the answer points to the contact's spring and damper.",
    made="The thread has no scene; all sizes are chosen here.",
)
def _mujoco_2080() -> Staged:
    """Two discs meet with restitution 1/2."""
    return _head_on(speeds=(1.0, -1.0), radius_m=(0.1, 0.1), gap_m=0.41, restitution=0.5, duration_s=0.6, rate_hz=500.0)


@misses(
    thread="https://github.com/bulletphysics/bullet3/issues/2228",
    reported="A body pushed by an impulse of 500 passes a wall 10 units away at 60 steps a second, with continuous "
    "detection.",
    made="Impulse, distance and rate are from the thread; discs replace capsule and box.",
)
def _bullet3_2228() -> Staged:
    """A disc at 500 m/s meets an immovable one."""
    # An impulse of 500 N s on a kilogram.
    return _head_on(speeds=(500.0, 0.0), radius_m=(0.5, 0.5), gap_m=9.3, mass_kg=(1.0, math.inf), duration_s=0.1)


@misses(
    thread="https://github.com/dimforge/rapier/issues/984",
    reported="Two fast bodies, both with continuous detection, pass through each other.",
    made="The thread shows a picture without numbers; all sizes are chosen here.",
)
def _rapier_984() -> Staged:
    """Two small discs meet at 180 m/s."""
    return _head_on(speeds=(90.0, -90.0), radius_m=(0.1, 0.1), gap_m=4.1, duration_s=0.1)


@never_bounces(
    thread="https://github.com/jrouwe/JoltPhysics/issues/1403",
    reported="With restitution 1, a moving sphere and one at rest stick together at half the speed instead of "
    "exchanging velocities.",
    made="Speeds are from the thread; radius and gap are chosen here.",
)
def _jolt_1403() -> Staged:
    """A disc at 1 m/s meets an equal one at rest."""
    return _head_on(speeds=(1.0, 0.0), radius_m=(0.5, 0.5), gap_m=0.37, duration_s=1.0)


@never_bounces(
    thread="https://github.com/DanielChappuis/reactphysics3d/issues/96",
    reported="With bounciness 1, spheres collide inelastically at 1 m/s because of a velocity threshold of 1 m/s.",
    made="Positions, radii, masses and speeds are from the thread.",
)
def _reactphysics3d_96() -> Staged:
    """A disc at exactly 1 m/s meets an equal one at rest."""
    # From 2.8 and 4.0 with radius .5: a gap of .2.
    return _head_on(speeds=(1.0, 0.0), radius_m=(0.5, 0.5), gap_m=0.2, mass_kg=(10.0, 10.0), duration_s=1.0)


@complained(
    thread="https://github.com/JuliaDynamics/HardSphereDynamics.jl/issues/8",
    reported="The impact law divides infinity by infinity for a ball of infinite mass.",
    symptom=Symptom.NOT_FINITE,
    made="The thread has only the formula; all sizes are chosen here.",
)
def _hardspheredynamics_8() -> Staged:
    """A disc meets a disc of infinite mass."""
    return _head_on(speeds=(1.5, 0.0), radius_m=(0.2, 0.3), gap_m=0.4, mass_kg=(1.0, math.inf), duration_s=1.0)


@loses_energy(
    package="Newton (MuJoCo Warp)",
    thread="https://github.com/newton-physics/newton/issues/3233",
    reported="Three spheres in line lose about half their kinetic energy when two contacts are solved in one step "
    "instead of one after the other.",
    at_least=0.25,
    made="Three equal spheres and 2 m/s are from the thread. The radius is a power of two here, so that they "
    "touch exactly.",
)
def _newton_3233() -> Staged:
    """A disc strikes the first of two touching discs."""
    return struck_row([0.5, 0.0], _CONVENTION, radius_m=0.0625, speed=2.0, duration_s=0.5, frame_rate_hz=240.0)


@complained(
    thread="https://github.com/ekiefl/pooltool/pull/257",
    reported="Nearly touching and overlapping balls, and a Newton's cradle of them, were resolved wrongly "
    "before this change.",
    at_least=0.1,
    made="The cradle is from the thread; gaps and speed are chosen here.",
)
def _pooltool_257() -> Staged:
    """A row of four discs, a nanometre apart, is struck at one end."""
    return struck_row([0.3] + [2.0**-30] * 3, radius_m=0.03125, speed=1.5, duration_s=0.5, frame_rate_hz=240.0)


@complained(
    thread="https://github.com/erincatto/box2d/pull/1094",
    reported="Restitution is computed from the approach velocity of the step before.",
    made="The thread has only code. In this scene the approach velocity changes within a step.",
)
def _box2d_1094() -> Staged:
    """A disc is struck, and strikes the next one within the same step."""
    return struck_row([0.613, 0.02], radius_m=0.25, speed=3.0, duration_s=0.5, frame_rate_hz=60.0)


@complained(
    thread="https://github.com/ekiefl/pooltool/pull/354",
    reported="If the equation for the instant loses degrees, touching balls that do not approach get a "
    "collision at once.",
    symptom=Symptom.INVENTS,
    made="Both cases are from the thread; sizes are chosen here.",
)
def _pooltool_354() -> Staged:
    """Two pairs of discs touch: one pair moves together, the other moves apart, and there is no impact."""
    radius = 0.25
    scene = scene_of(
        discs=[
            disc(0j, 1 + 0.5j, radius),
            disc(0.5 + 0j, 1 + 0.5j, radius),
            disc(0 - 3j, -1 + 0j, radius),
            disc(0.5 - 3j, 0.5 + 0j, radius),
        ],
        duration_s=1.0,
    )
    return answered(scene, [], "Bodies that touch but do not approach exchange no impulse")


@complained(
    thread="https://github.com/adm78/visualchemeng-js/issues/10",
    reported="Particles that overlap at the start cause events in the past; time runs backwards and particles "
    "leave the box.",
    symptom=Symptom.ESCAPES,
    made="Carom refuses overlaps at the start, except for rounding. The overlap is the deepest that Carom accepts.",
)
def _visualchemeng_10() -> Staged:
    """Two discs begin in contact, overlap by one rounding error, and approach each other."""
    # In floats, .3 - .1 is a little less than .2, so the two bodies overlap by one rounding.
    scene = scene_of(
        discs=[disc(0.1 + 0j, 1 + 0j, 0.1), disc(0.3 + 0j, -1 + 0j, 0.1), disc(0.3 + 0.5j, 0 + 0j, 0.1)],
        duration_s=0.5,
    )
    impacts = [impact(0.0, 0, 1, -1 + 0j, 1 + 0j)]
    return answered(scene, impacts, "Equal masses exchange velocities, at once")


@complained(
    thread="https://github.com/dynamomd/DynamO/issues/57",
    reported="An event-driven run of inelastic spheres does not continue after inelastic collapse.",
    symptom=Symptom.NEVER_ENDS,
    made="The thread has no scene; this is the smallest one that collapses.",
)
def _dynamo_57() -> Staged:
    """Three discs in a line with restitution 1/16 have infinitely many impacts in a finite time."""
    radius = 0.25
    scene = scene_of(
        discs=[disc(-0.75 + 0j, 1 + 0j, radius), disc(0j, 0j, radius), disc(0.75 + 0j, -1 + 0j, radius)],
        restitution=0.0625,
        duration_s=2.0,
    )
    source = (
        "Below a restitution of 7 - 4 sqrt(3), three equal discs in a line collide infinitely often and stay "
        "together, with their centre of mass at rest (S. McNamara and W. R. Young, Phys. Fluids A 4, 496, 1992)"
    )
    convention = "The outer discs arrive at one instant. In the limit all discs are at rest, whatever the order"
    return Staged(scene, KnownAnswer(source, final_velocity_m_s=((0.0, 0.0),) * 3, convention=convention))


@complained(
    thread="https://github.com/liabru/matter-js/issues/361",
    reported="Even with restitution 1 a slow circle does not pass on all of its momentum: both circles move on.",
    at_least=0.1,
    made="The thread has no scene; all sizes are chosen here.",
)
def _matter_361() -> Staged:
    """A slow disc strikes an equal one at rest, head-on."""
    return _head_on(speeds=(0.5, 0.0), radius_m=(0.2, 0.2), gap_m=0.3, duration_s=1.5)


@loses_energy(
    thread="https://github.com/schteppe/cannon.js/issues/359",
    reported="Colliding spheres lose energy although their contact has restitution 1 and no friction.",
    made="The thread gives neither positions nor speeds; all sizes are chosen here.",
)
def _cannon_359() -> Staged:
    """Two balls fly at each other off centre, without friction, and lose no energy."""
    return meeting((3 + 0j, -2 + 0.5j), (0.5, 0.5), offset=0.4, time_s=0.51, duration_s=1.25)


@never_bounces(
    thread="https://github.com/viblo/pymunk/issues/13",
    reported="Collisions are never elastic: the number of elastic iterations could not be set from Python.",
    made="The thread has no scene; all sizes are chosen here.",
)
def _pymunk_13() -> Staged:
    """A light and a heavy disc meet head-on, elastically."""
    return _head_on(speeds=(2.0, -1.0), radius_m=(0.25, 0.5), mass_kg=(1.0, 4.0), gap_m=1.53, duration_s=1.25)


@never_bounces(
    package="Defold",
    thread="https://github.com/defold/defold/issues/3775",
    reported="A body that moves at 1 m/s or less sticks to the body that it meets, and both move on as one.",
    made="Speeds up to 1 m/s are from the thread; the sizes are chosen here.",
)
def _defold_3775() -> Staged:
    """A disc at 0.9 m/s meets one at rest."""
    return _head_on(speeds=(0.9, 0.0), radius_m=(0.25, 0.25), gap_m=0.45, duration_s=1.25)


@never_bounces(
    thread="https://github.com/newton-physics/newton/issues/1131",
    reported="One of the solvers had no restitution for rigid bodies that collide; the thread requests it.",
    made="The thread has no scene; all sizes are chosen here.",
)
def _newton_1131() -> Staged:
    """Two balls meet head-on with restitution 1/2."""
    return _head_on(speeds=(2.0, -2.0), radius_m=(0.1, 0.1), gap_m=1.01, restitution=0.5, duration_s=0.5)


@complained(
    thread="https://github.com/newton-physics/newton/pull/4103",
    reported="Restitution used velocities of the wrong instant: impacts with restitution 0 rebounded, and separating "
    "bodies were held.",
    at_least=0.1,
    made="The thread has no scene; all sizes are chosen here.",
)
def _newton_4103() -> Staged:
    """A ball runs into a slower one with restitution 0, and both move on at one speed."""
    return _head_on(speeds=(3.0, 1.0), radius_m=(0.1, 0.1), gap_m=1.01, restitution=0.0, duration_s=1.0)


@misses(
    thread="https://github.com/Terri00/vrc8ball/issues/52",
    reported="A ball that is hit hard passes through the ball that it was aimed at, and balls merge at the break.",
    made="Balls have the usual size; speed and distance are chosen here.",
)
def _vrc8ball_52() -> Staged:
    """A cue ball at 10 m/s meets a ball a metre away."""
    return _head_on(speeds=(10.0, 0.0), radius_m=(0.03, 0.03), gap_m=1.01, duration_s=0.25)


@complained(
    thread="https://github.com/Terri00/vrc8ball/issues/85",
    reported="A ball that is hit at high speed and off centre is missed, or leaves as if it had been hit nearer to the "
    "centre, or on the other side.",
    at_least=0.1,
    made="Balls have the usual size; speed and offset are chosen here.",
)
def _vrc8ball_85() -> Staged:
    """A fast cue ball strikes an object ball, off centre by nine tenths of the contact distance."""
    return meeting((8 + 0j, 0j), (0.03, 0.03), offset=0.9, time_s=0.103, duration_s=0.25)
