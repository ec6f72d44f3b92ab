"""Capability honesty: what an adapter declares, it does; what it does not declare, it refuses."""

from __future__ import annotations

import math

from carom.conformance.checks.common import numbers, own_setup, require_supported, require_velocities
from carom.conformance.probe import Raised
from carom.conformance.scenes import (
    DT_S,
    alone,
    approach,
    bounce_and_pair,
    bullet,
    fall,
    far_pair,
    post,
    posts,
    walled_box,
)
from carom.conformance.subject import Subject
from carom.conformance.violation import NotApplicable, Violation
from carom.scene import Scene

__all__ = [
    "REFUSALS",
    "detects_continuously",
    "falls_as_declared",
    "far_as_declared",
    "fast_as_declared",
    "immovable_stays",
    "large_as_declared",
    "moves_as_declared",
    "posts_stand_still",
    "refuses",
    "restitution_as_declared",
    "slow_as_declared",
    "small_as_declared",
]

#: An engine without a declared limit is tried this far out and this fast: three orders of magnitude beyond any scene
#: of the catalogue, and still with a relative rounding of coordinates that a float64 engine does not feel.
FAR_M = 1e5
FAST_M_S = 1e5

#: As far below any scene of the catalogue.
SMALL_M = 1e-5
SLOW_M_S = 1e-4

#: Phases of the step in which the fast disc is sent; without continuous detection most of them miss.
PHASES = 8


def restitution_as_declared(subject: Subject, share: float, wall_share: float) -> None:
    """Within the declared range discs and walls each get their own coefficient, in any combination of the two."""
    can = subject.capabilities()
    low, high = can.restitution
    e, wall_e = low + share * (high - low), low + wall_share * (high - low)
    if low == high and (share, wall_share) != (1.0, 1.0):
        raise NotApplicable(f"restitution is declared to be {low:g} only")
    if not can.walls and wall_share != share:
        raise NotApplicable("walls are not declared, so there is no second coefficient")
    setup = own_setup(bounce_and_pair(e, wall_e, wall=can.walls), "tuned")
    end = subject.watch(setup).seen[-1]
    # Momentum 1 * 1 - 2 * 2 = -3 is kept by 3 kg, and the closing speed of 3 m/s becomes e times itself.
    expected = [(-1 - 2 * e, 0.0), (-1 + e, 0.0), (0.0, -3 * wall_e)]
    require_velocities(subject, setup, end, expected[: len(setup.scene.discs)], f"restitution {e:g}, walls {wall_e:g}")


def immovable_stays(subject: Subject, order: str) -> None:
    """A disc comes back from an immovable one with its velocity reversed, whichever is written first."""
    setup = own_setup(post(first=order == "first"), "tuned")
    require_supported(subject, setup)
    end = subject.watch(setup).seen[-1]
    expected = [(-3.0, 0.0), (0.0, 0.0)]
    require_velocities(subject, setup, end, expected[::-1] if order == "first" else expected, "an immovable disc")
    fixed = 0 if order == "first" else 1
    position = tuple(end.position_m[fixed].tolist())
    wanted = setup.scene.discs[fixed].position_m
    if math.dist(position, wanted) > subject.rounding:
        raise Violation("an immovable disc is moved", expected=wanted, found=position, setup=setup)


def posts_stand_still(subject: Subject) -> None:
    """Immovable discs alone, in each other, are a scene in which nothing ever happens."""
    setup = own_setup(posts(), "tuned")
    require_supported(subject, setup)
    end = subject.watch(setup).seen[-1]
    moved = end.velocity_m_s.any() or end.position_m.tolist() != [list(d.position_m) for d in setup.scene.discs]
    if moved or any(contact.impulse_n_s != 0 for contact in end.contacts):
        found = f"positions {end.position_m.tolist()}, {len(end.contacts)} contacts"
        raise Violation("immovable discs do not stand still", expected="nothing to happen", found=found, setup=setup)


def falls_as_declared(subject: Subject) -> None:
    """A disc that falls has the velocity g t."""
    setup = own_setup(fall(), "tuned")
    require_supported(subject, setup)
    end = subject.watch(setup).seen[-1]
    require_velocities(subject, setup, end, [(1.0, -8.0 * setup.scene.duration_s)], "gravity")


def fast_as_declared(subject: Subject) -> None:
    """At the greatest declared speed a disc hands its velocity over as at any other; steps shrink with the scene."""
    speed = min(subject.capabilities().max_speed_m_s, FAST_M_S)
    setup = own_setup(approach(speed_m_s=speed), "tuned", DT_S * 3.0 / speed)
    end = subject.watch(setup).seen[-1]
    require_velocities(subject, setup, end, [(0.0, 0.0), (speed, 0.0)], f"at {speed:g} m/s")


def far_as_declared(subject: Subject) -> None:
    """At the greatest declared coordinate a disc hands its velocity over as anywhere else."""
    can = subject.capabilities()
    # Beyond this a coordinate is rounded by more than a thousandth of the disc's radius, whatever the engine.
    finest = 0.5e-3 / (2.0**-52 if can.float_bits == 64 else 2.0**-23)
    coordinate = min(can.max_coordinate_m, FAR_M, finest)
    setup = own_setup(far_pair(coordinate), "tuned")
    end = subject.watch(setup).seen[-1]
    require_velocities(subject, setup, end, [(0.0, 0.0), (3.0, 0.0)], f"{coordinate:g} m from the origin")


def moves_as_declared(subject: Subject) -> None:
    """A disc moves as far in one step as is declared, and is where its velocity takes it."""
    can = subject.capabilities()
    speed = min(can.max_move_m / DT_S, can.max_speed_m_s, FAST_M_S)
    setup = own_setup(alone(speed_m_s=speed), "tuned")
    end = subject.watch(setup).seen[-1]
    require_velocities(subject, setup, end, [(speed, 0.0)], f"at {speed * DT_S:g} m a step")
    wanted, found = speed * setup.scene.duration_s, float(end.position_m[0][0])
    if not abs(found - wanted) <= subject.rounding * wanted:
        what = f"a disc does not get as far as its {speed * DT_S:g} m a step take it"
        raise Violation(what, expected=f"{wanted:.10g} m", found=f"{found:.10g} m", setup=setup)


def small_as_declared(subject: Subject) -> None:
    """At the least declared radius a disc hands its velocity over as at any other."""
    radius = subject.capabilities().min_radius_m or SMALL_M
    # Lengths shrink by 2 r, times and speeds by its root: as the same scene is seen on another scale under gravity.
    root = math.sqrt(2 * radius)
    speed = 3.0 * root
    scene = approach(speed_m_s=speed, gap_m=2.02 * radius, radius_m=radius)
    setup = own_setup(scene, "tuned", DT_S * root)
    end = subject.watch(setup).seen[-1]
    require_velocities(subject, setup, end, [(0.0, 0.0), (speed, 0.0)], f"radius {radius:g} m")


def large_as_declared(subject: Subject) -> None:
    """At the greatest declared radius a disc hands its velocity over as at any other."""
    can = subject.capabilities()
    radius = min(can.max_radius_m, FAR_M, can.max_coordinate_m / 4)
    setup = own_setup(approach(radius_m=radius), "tuned")
    end = subject.watch(setup).seen[-1]
    require_velocities(subject, setup, end, [(0.0, 0.0), (3.0, 0.0)], f"radius {radius:g} m")


def slow_as_declared(subject: Subject) -> None:
    """Discs that close at twice the speed up to which contacts are declared inelastic hand their velocity over."""
    speed = 2 * subject.capabilities().restitution_threshold_m_s or SLOW_M_S
    setup = own_setup(approach(speed_m_s=speed), "tuned", DT_S * 3.0 / speed)
    end = subject.watch(setup).seen[-1]
    require_velocities(subject, setup, end, [(0.0, 0.0), (speed, 0.0)], f"at {speed:g} m/s")


def detects_continuously(subject: Subject) -> None:
    """A disc that would pass another whole in one step hits it, in whatever phase of its step it comes."""
    if not subject.capabilities().continuous_detection:
        raise NotApplicable("continuous_detection is declared to be False")
    for k in range(PHASES):
        setup = own_setup(bullet(k / PHASES), "tuned", 1 / 60)
        end = subject.watch(setup).seen[-1]
        struck = float(end.velocity_m_s[1][0])
        if not struck > 0:
            what = "a fast disc passes through another, and continuous detection is declared"
            expected = "an impact that drives disc 1 forward, 50 m/s by conservation of momentum and energy"
            raise Violation(what, expected=expected, found=f"{struck:.6g} m/s", setup=setup)


def _beyond_speed(subject: Subject) -> Scene | None:
    limit = subject.capabilities().max_speed_m_s
    return None if 2 * limit > 1e150 else alone(speed_m_s=2 * limit)  # a speed beyond 1e150 m/s squares to infinity


def _beyond_coordinate(subject: Subject) -> Scene | None:
    limit = subject.capabilities().max_coordinate_m
    return None if 2 * limit > 1e150 else alone(x_m=2 * limit)


def _beyond_move(subject: Subject) -> Scene | None:
    speed = 2 * subject.capabilities().max_move_m / DT_S
    return None if speed > subject.capabilities().max_speed_m_s or math.isinf(speed) else alone(speed_m_s=speed)


def _too_small(subject: Subject) -> Scene | None:
    limit = subject.capabilities().min_radius_m
    return None if limit == 0 else alone(radius_m=limit / 2)


def _too_large(subject: Subject) -> Scene | None:
    limit = subject.capabilities().max_radius_m
    return None if 2 * limit > 1e150 else alone(radius_m=2 * limit)


def _too_light(subject: Subject) -> Scene | None:
    limit = subject.capabilities().min_mass_kg
    return None if limit == 0 else alone(mass_kg=limit / 2)


def _too_heavy(subject: Subject) -> Scene | None:
    limit = subject.capabilities().max_mass_kg
    return None if 2 * limit > 1e150 else alone(mass_kg=2 * limit)


def _restitution(subject: Subject, *, above: bool) -> Scene | None:
    low, high = subject.capabilities().restitution
    if above:
        return None if high == 1 else bounce_and_pair((1 + high) / 2, (1 + high) / 2, wall=False)
    return None if low == 0 else bounce_and_pair(low / 2, low / 2, wall=False)


#: What may be missing from the declaration: the scene that needs it (None where it is declared), and what is declared.
REFUSALS = {
    "walls": lambda subject: None if subject.capabilities().walls else walled_box(),
    "immovable discs": lambda subject: None if subject.capabilities().immovable_discs else post(),
    "gravity": lambda subject: None if subject.capabilities().gravity else fall(),
    "restitution below the range": lambda subject: _restitution(subject, above=False),
    "restitution above the range": lambda subject: _restitution(subject, above=True),
    "speed": _beyond_speed,
    "coordinate": _beyond_coordinate,
    "move": _beyond_move,
    "small radius": _too_small,
    "large radius": _too_large,
    "light mass": _too_light,
    "heavy mass": _too_heavy,
}


def refuses(subject: Subject, what: str) -> None:
    """A scene that needs what is not declared is refused by `prepare` with an AdapterError, never silently wrong."""
    scene = REFUSALS[what](subject)
    if scene is None:
        raise NotApplicable(f"{_declared(subject, what)} is declared: there is nothing to refuse")
    setup = own_setup(scene, "tuned")
    expected = f"prepare() to raise an AdapterError, since the adapter declares {_declared(subject, what)}"
    answer = subject.try_to_watch(setup)
    if not isinstance(answer, Raised):
        ends = " ".join(numbers(velocity) for velocity in answer.seen[-1].velocity_m_s.tolist()[:3])
        found = f"a run to the end of the scene, with the velocities {ends} m/s"
        raise Violation(f"a scene beyond what is declared ({what}) is run", expected=expected, found=found, setup=setup)
    if answer.where != "prepare" or not answer.deliberate:
        found = f"{answer.where}() raised {answer.kind}: {answer.message}"
        raise Violation(
            f"a scene beyond what is declared ({what}) is no clear error", expected=expected, found=found, setup=setup
        )


def _declared(subject: Subject, what: str) -> str:
    can = subject.capabilities()
    if what.startswith("restitution"):
        return f"restitution = {can.restitution}"
    values = {
        "walls": f"walls = {can.walls}",
        "immovable discs": f"immovable_discs = {can.immovable_discs}",
        "gravity": f"gravity = {can.gravity}",
        "speed": f"max_speed_m_s = {can.max_speed_m_s:g}",
        "coordinate": f"max_coordinate_m = {can.max_coordinate_m:g}",
        "move": f"max_move_m = {can.max_move_m:g}",
        "small radius": f"min_radius_m = {can.min_radius_m:g}",
        "large radius": f"max_radius_m = {can.max_radius_m:g}",
        "light mass": f"min_mass_kg = {can.min_mass_kg:g}",
        "heavy mass": f"max_mass_kg = {can.max_mass_kg:g}",
    }
    return values[what]
