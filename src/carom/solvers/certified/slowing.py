"""Deceleration of discs in certified runs, by damping or by a table.

A scene with damping is run without damping, and times are converted afterwards: see `carom.model.damping`. On a table,
each disc has the same constant deceleration until it stops.
"""

from __future__ import annotations

from flint import arb

from carom.solvers.certified.ball_arithmetic import ZERO, float_above, float_below
from carom.solvers.certified.disc_states import BallBodies
from carom.solvers.certified.meeting import Meeting
from carom.solvers.certified.result import Degeneracy, Degenerate, Undecided


def undamped_time_of(damping_per_s: float, time: arb) -> arb:
    """Return the time in which an undamped disc moves as far as a damped disc moves in `time`."""
    if not damping_per_s:
        return time
    return (ZERO - (ZERO - damping_per_s * time).expm1()) / damping_per_s


def damped_time(damping_per_s: float, undamped_time: arb) -> arb:
    """Return the time in which a damped disc moves as far as an undamped disc moves in `undamped_time`."""
    if not damping_per_s:
        return undamped_time
    return ZERO - (ZERO - damping_per_s * undamped_time).log1p() / damping_per_s


def speed_fraction(damping_per_s: float, undamped_time: arb) -> arb:
    """Return the fraction of a speed that damping leaves at a time of the run without damping."""
    return 1 - damping_per_s * undamped_time


def start_deceleration(bodies: BallBodies, i: int, time: arb, instant_s: float) -> None:
    """Let the table decelerate disc `i`, whose velocity has just changed at `time`.

    Raises:
        Undecided: With this precision it is unknown whether the disc moves.
    """
    vx, vy = bodies.velocity(i, time, instant_s)
    if vx.is_zero() and vy.is_zero():
        return
    speed, wait = (vx * vx + vy * vy).sqrt(), time - arb(instant_s)
    if not speed > 0:
        bounds_s = max(0.0, float_below(time)), float_above(time)
        raise Undecided(Degeneracy(Degenerate.MODE, (i,), *bounds_s, proven=False, bits=bodies.state_bits(i)))
    deceleration = arb(bodies.scene.table_deceleration_m_s2)
    ax, ay = ZERO - deceleration * vx / speed, ZERO - deceleration * vy / speed
    x, y = bodies.centre_at(i, time)
    bodies.acceleration[i] = (ax, ay)
    bodies.contacts.stops[i] = time + speed / deceleration
    bodies.x[i], bodies.y[i] = x - wait * (vx - ax * wait / 2), y - wait * (vy - ay * wait / 2)
    bodies.vx[i], bodies.vy[i], bodies.time[i] = vx - ax * wait, vy - ay * wait, instant_s


def stop_disc(bodies: BallBodies, meeting: Meeting) -> None:
    """Set the velocity and acceleration of a disc to 0, because the table has stopped it."""
    i = meeting.first
    bodies.x[i], bodies.y[i] = bodies.centre_at(i, meeting.time)
    bodies.vx[i] = bodies.vy[i] = ZERO
    bodies.contacts.clear(i)
    bodies.acceleration[i] = None
    bodies.record_impact(i, i, meeting.at, meeting.time, meeting.latest)
