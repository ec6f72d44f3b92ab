"""Checks of capabilities: an adapter supports what it declares, and check_refuses everything else."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

from carom.conformance import suite_scenes as scenes
from carom.conformance.adapter_under_test import Subject
from carom.conformance.checks.common import end_like_pic, format_vector, require_declared, require_supported
from carom.conformance.probes import AdapterFailure
from carom.conformance.violation import NotApplicable, Setup, Violation, require
from carom.engines.api import Capabilities
from carom.engines.api.checks import COMBINE_RULES, MANTISSA_BITS
from carom.model.scene import Scene
from carom.support.formatting import format_number
from carom.support.limits import LARGEST

#: Largest tested coordinates and speeds for an engine that declares no limit: a thousand times those of any catalogue
#: scene. 64-bit floats still represent these numbers precisely enough.
FAR_M = 1e5
FAST_M_S = 1e5

#: Smallest tested radius: a thousandth of the smallest radius in the catalogue.
SMALL_M = 1e-5
SLOW_M_S = 1e-4

#: Number of runs with the fast disc, each shifted in time by another part of a step. Without continuous detection, an
#: engine misses the impact in most of these runs.
PHASES = 8


def check_restitution(subject: Subject, share: float, wall_share: float) -> None:
    """Speeds after an impact are correct for all restitutions of discs and of walls in the declared range."""
    capabilities = subject.capabilities()
    low, high = capabilities.restitution
    e, wall_e = low + share * (high - low), low + wall_share * (high - low)
    if low == high and (share, wall_share) != (1.0, 1.0):
        raise NotApplicable(f"only the restitution {low:g} is declared")
    if not capabilities.walls and wall_share != share:
        raise NotApplicable("walls are not declared, so there is no second coefficient")
    scene = scenes.build_bounce_and_pair(e, wall_e, wall=capabilities.walls)
    end_like_pic(subject, scene, f"restitution {e:g}, walls {wall_e:g}")


def check_immovable_disc(subject: Subject, order: str) -> None:
    """A disc that hits an immovable disc head-on bounces straight back, no matter which disc has the lower number."""
    fixed = 0 if order == "first" else 1
    scene = scenes.build_post(first=fixed == 0)
    end = end_like_pic(subject, scene, "an immovable disc")
    found, start = tuple(end.position_m[fixed].tolist()), scene.discs[fixed].position_m
    require(math.dist(found, start) <= subject.rounding, "an immovable disc is moved", start, found, Setup(scene))


def check_immovable_discs_alone(subject: Subject) -> None:
    """Overlapping immovable discs stay at rest, and their contacts have no effect."""
    setup = require_supported(subject, scenes.build_posts())
    end = subject.watch(setup).states[-1]
    has_moved = end.velocity_m_s.any() or end.position_m.tolist() != [list(d.position_m) for d in setup.scene.discs]
    is_at_rest = not has_moved and all(contact.impulse_n_s == 0 for contact in end.contacts)
    found = f"positions {end.position_m.tolist()}, {len(end.contacts)} contacts"
    require(is_at_rest, "immovable discs do not stand still", "nothing to happen", found, setup)


def check_gravity(subject: Subject) -> None:
    """A falling disc has the velocity g t."""
    end_like_pic(subject, scenes.build_fall(), "gravity")


def check_damping(subject: Subject) -> None:
    """Velocity and spin of a damped disc decrease as exp(-c t), within the error of a first-order integrator."""
    setup = require_supported(subject, scenes.build_damped_disc(spins=subject.capabilities().spin))
    scene, end = setup.scene, subject.watch(setup).states[-1]
    disc, steps = scene.discs[0], scene.step_count(setup.dt_s)
    step = scene.damping_per_s * setup.dt_s
    # First-order integrators replace exp(-c dt) by 1 - c dt, a lower bound, or by 1 / (1 + c dt), an upper bound.
    lower, upper = (1.0 - step) ** steps, (1.0 + step) ** -steps
    found = [(end.velocity_m_s[0] @ disc.velocity_m_s) / math.hypot(*disc.velocity_m_s) ** 2]
    if disc.spin_rad_s:
        found.append(math.nan if end.spin_rad_s is None else end.spin_rad_s[0] / disc.spin_rad_s)
    slowed = all(lower - subject.rounding <= fraction <= upper + subject.rounding for fraction in found)
    spin = " and its spin" * bool(disc.spin_rad_s)
    expected = f"{format_number(lower, 6)} to {format_number(upper, 6)} times its velocity{spin}"
    require(slowed, "a disc is not damped at the scene's rate", expected, format_vector(found), setup)


def check_rolling_resistance(subject: Subject) -> None:
    """A disc that rolls with rolling resistance c decelerates by c g/(1 + k), where k is its inertia factor."""
    setup = require_supported(subject, scenes.build_rolling_disc())
    scene, end = setup.scene, subject.watch(setup).states[-1]
    rate = scene.wall_rolling_resistance * math.hypot(*scene.gravity_m_s2) / (1.0 + scene.discs[0].inertia_factor)
    expected, found = 1.0 - rate * scene.duration_s, float(end.velocity_m_s[0, 0])
    promise = subject.adapter.profiles[setup.profile].accuracy.velocity
    right = abs(found - expected) <= rate * setup.dt_s + subject.rounding + promise
    wrong = "a rolling disc does not decelerate by c g/(1 + k) (c: rolling resistance, k: inertia factor)"
    expected_text = f"{format_number(expected, 6)} m/s to within {format_number(rate * setup.dt_s + promise)}"
    require(right, wrong, expected_text, f"{format_number(found, 6)} m/s", setup)


def check_table_friction(subject: Subject) -> None:
    """A disc on a table slows down at the table's deceleration.

    The error of the final speed may be as large as the loss of speed in one step.
    """
    scene = scenes.build_sliding_disc()
    end_like_pic(subject, scene, "a table", stepwise_m_s=scene.table_deceleration_m_s2 * scenes.DT_S)


def _require_transfer_at(subject: Subject, speed: float) -> None:
    scene = scenes.build_approach(speed_m_s=speed)
    end_like_pic(subject, scene, f"at {speed:g} m/s", dt_s=scenes.DT_S * 3.0 / speed)


def check_greatest_speed(subject: Subject) -> None:
    """An impact of two discs is correct at the greatest declared speed.

    The step size is inversely proportional to the speed, so a fast disc moves as far in a step as a slow disc.
    """
    _require_transfer_at(subject, min(subject.capabilities().max_speed_m_s, FAST_M_S))


def check_greatest_coordinate(subject: Subject) -> None:
    """An impact of two discs is correct at the greatest declared distance from the origin."""
    capabilities = subject.capabilities()
    # Beyond this coordinate, the rounding of positions exceeds a thousandth of the disc's radius.
    finest = 0.5e-3 * 2.0 ** MANTISSA_BITS[capabilities.float_bits]
    coordinate = min(capabilities.max_coordinate_m, FAR_M, finest)
    scene = scenes.build_approach(x_m=coordinate - 4.0)
    end_like_pic(subject, scene, f"{coordinate:g} m from the origin")


def check_greatest_move(subject: Subject) -> None:
    """A disc that moves by the greatest declared distance per step ends at the correct position."""
    capabilities = subject.capabilities()
    speed = min(capabilities.max_move_m / scenes.DT_S, capabilities.max_speed_m_s, FAST_M_S)
    scene = scenes.build_single_disc(speed_m_s=speed)
    end = end_like_pic(subject, scene, f"at {speed * scenes.DT_S:g} m per step")
    expected_m, found = speed * scene.duration_s, float(end.position_m[0][0])
    problem = f"a disc that moves {speed * scenes.DT_S:g} m per step ends at a wrong position"
    is_right = abs(found - expected_m) <= subject.rounding * expected_m
    require(is_right, problem, f"{format_number(expected_m, 10)} m", f"{format_number(found, 10)} m", Setup(scene))


def check_least_radius(subject: Subject) -> None:
    """An impact of two discs with the smallest declared radius is correct."""
    radius = subject.capabilities().min_radius_m or SMALL_M
    # Lengths are multiplied by 2 r, and times and speeds by the square root of 2 r, so accelerations stay the same.
    root = math.sqrt(2 * radius)
    scene = scenes.build_approach(speed_m_s=3.0 * root, gap_m=2.02 * radius, radius_m=radius)
    end_like_pic(subject, scene, f"radius {radius:g} m", dt_s=scenes.DT_S * root)


def check_greatest_radius(subject: Subject) -> None:
    """An impact of two discs with the greatest declared radius is correct."""
    capabilities = subject.capabilities()
    radius = min(capabilities.max_radius_m, FAR_M, capabilities.max_coordinate_m / 4)
    end_like_pic(subject, scenes.build_approach(radius_m=radius), f"radius {radius:g} m")


def check_slowest_bounce(subject: Subject) -> None:
    """An impact is elastic if its speed is twice the declared `restitution_threshold_m_s`."""
    _require_transfer_at(subject, 2 * subject.capabilities().restitution_threshold_m_s or SLOW_M_S)


def check_continuous_detection(subject: Subject) -> None:
    """A disc never passes through another disc, even if it moves farther in a step than the other's diameter."""
    require_declared(subject, "continuous_detection")
    for k in range(PHASES):
        setup = Setup(scenes.build_bullet(k / PHASES), dt_s=1 / 60)
        target_speed = float(subject.watch(setup).states[-1].velocity_m_s[1][0])
        problem = "a fast disc passes through another, although continuous detection is declared"
        expected = "an impact that accelerates disc 1 (to 50 m/s by conservation of momentum and energy)"
        require(target_speed > 0, problem, expected, f"{format_number(target_speed, 6)} m/s", setup)


def _build_disc_beyond(limit_field: str, disc_field: str, capabilities: Capabilities) -> Scene | None:
    """Return a scene with a disc that has twice a declared greatest value, or half of a declared smallest value.

    Return None if the result is 0, or so large that its square overflows.
    """
    limit = getattr(capabilities, limit_field)
    value = limit / 2 if limit_field.startswith("min") else 2 * limit
    return scenes.build_single_disc(**{disc_field: value}) if 0 < value <= 1e150 else None


def _build_fast_scene(capabilities: Capabilities) -> Scene | None:
    speed = 2 * capabilities.max_move_m / scenes.DT_S
    if speed > capabilities.max_speed_m_s or math.isinf(speed):
        return None
    return scenes.build_single_disc(speed_m_s=speed)


def _build_spinning_scene(field: str, capabilities: Capabilities) -> Scene | None:
    """Return a scene with a disc whose spin exceeds only one limit of the engine, `field`."""
    limits = {"max_spin_rad_s": capabilities.max_spin_rad_s, "max_turn_rad": capabilities.max_turn_rad / scenes.DT_S}
    spin, other = 2 * limits.pop(field), min(*limits.values(), LARGEST)
    return scenes.build_spinning_disc(spin) if capabilities.spin and spin < other else None


def _build_rubbing_scene(capabilities: Capabilities, friction: float, inertia_factor: float = 0.5) -> Scene | None:
    return scenes.build_rubbing(capabilities, friction, friction, inertia_factor) if 0 < friction <= LARGEST else None


def _build_easily_turned_scene(capabilities: Capabilities) -> Scene | None:
    factor = capabilities.min_inertia_factor / 2
    return _build_rubbing_scene(capabilities, min(0.1, capabilities.friction[1]), factor) if factor else None


def _build_sticking_scene(capabilities: Capabilities) -> Scene | None:
    scene = _build_rubbing_scene(capabilities, min(0.1, capabilities.friction[1]))
    return scene and scene.model_copy(update={"tangential_restitution": 0.5})


def _build_bounce(restitution: float) -> Scene:
    return scenes.build_bounce_and_pair(restitution, restitution, wall=False)


def _build_uncombined_scene(capabilities: Capabilities) -> Scene | None:
    """Return a scene with a wall restitution that the engine can't compute from the two restitutions of the bodies.

    Return None if there is no such restitution, or if the engine does not support walls.
    """
    low, high = capabilities.restitution
    least, greatest = COMBINE_RULES[capabilities.restitution_combine](pair := (low + high) / 2, high)
    beyond = next((wall for wall in (low, high) if not least <= wall <= greatest), None)
    return None if beyond is None or not capabilities.walls else scenes.build_bounce_and_pair(pair, beyond, wall=True)


#: For each capability: the name of its field, and a function. The function returns a scene that needs more than the
#: adapter declares, if there is such a scene. Capabilities that are True are not tested here.
REFUSALS: dict[str, tuple[str, Callable[[Capabilities], Scene | None]]] = {
    "walls": ("walls", lambda _: scenes.build_walled_box()),
    "segments": ("segments", scenes.build_two_sided_edge),
    "arcs": ("arcs", scenes.build_two_sided_circle),
    "circles from outside": ("posts", scenes.build_outside_circle),
    "wall materials": ("wall_materials", lambda _: scenes.build_two_walls(1.0, 0.5)),
    "immovable discs": ("immovable_discs", lambda _: scenes.build_post()),
    "driven walls": ("driven_walls", scenes.build_paddle),
    "driven discs": ("driven_discs", scenes.build_mallet),
    "legs": ("legs", scenes.build_starting_paddle),
    "belts": ("belts", scenes.build_belt),
    "belts of edges": ("edge_belts", scenes.build_edge_belt),
    "gravity": ("gravity", lambda _: scenes.build_fall()),
    "damping": ("damping", lambda _: scenes.build_damped_disc(spins=False)),
    "rolling resistance": ("rolling_resistance", lambda _: scenes.build_rolling_disc()),
    "table friction": ("table_friction", lambda _: scenes.build_sliding_disc()),
    "restitution below the range": ("restitution", lambda declared: _build_bounce(declared.restitution[0] / 2)),
    "restitution above the range": ("restitution", lambda declared: _build_bounce((1 + declared.restitution[1]) / 2)),
    "restitution of walls": ("restitution_combine", _build_uncombined_scene),
    "spin": ("spin", lambda _: scenes.build_spinning_disc(1.0)),
    "fast spin": ("max_spin_rad_s", partial(_build_spinning_scene, "max_spin_rad_s")),
    "turn": ("max_turn_rad", partial(_build_spinning_scene, "max_turn_rad")),
    "small inertia": ("min_inertia_factor", _build_easily_turned_scene),
    "friction": ("friction", lambda declared: scenes.build_rubbing(declared, 0.1, 0.1)),
    "friction below the range": ("friction", lambda declared: _build_rubbing_scene(declared, declared.friction[0] / 2)),
    "friction above the range": ("friction", lambda declared: _build_rubbing_scene(declared, 2 * declared.friction[1])),
    "tangential restitution": ("tangential_restitution", _build_sticking_scene),
    "speed": ("max_speed_m_s", partial(_build_disc_beyond, "max_speed_m_s", "speed_m_s")),
    "coordinate": ("max_coordinate_m", partial(_build_disc_beyond, "max_coordinate_m", "x_m")),
    "move": ("max_move_m", _build_fast_scene),
    "small radius": ("min_radius_m", partial(_build_disc_beyond, "min_radius_m", "radius_m")),
    "large radius": ("max_radius_m", partial(_build_disc_beyond, "max_radius_m", "radius_m")),
    "light mass": ("min_mass_kg", partial(_build_disc_beyond, "min_mass_kg", "mass_kg")),
    "heavy mass": ("max_mass_kg", partial(_build_disc_beyond, "max_mass_kg", "mass_kg")),
}


def check_refuses(subject: Subject, refusal: str) -> None:
    """`prepare` raises an AdapterError if a scene needs a capability that the adapter does not declare."""
    field, needing_more = REFUSALS[refusal]
    capabilities, value = subject.capabilities(), getattr(subject.capabilities(), field)
    scene = None if value is True else needing_more(capabilities)
    declared = f"{field} = {value if isinstance(value, bool | tuple | str) else format(value, 'g')}"
    if scene is None or not subject.find_unsupported_reason(Setup(scene)):
        raise NotApplicable(f"{declared} is declared, so there is no scene to refuse")
    setup, beyond = Setup(scene), f"a scene beyond the declared capabilities ({refusal})"
    expected = f"prepare() to raise an AdapterError, because the adapter declares {declared}"
    answer = subject.try_to_watch(setup)
    if not isinstance(answer, AdapterFailure):
        ends = " ".join(format_vector(velocity) for velocity in answer.states[-1].velocity_m_s.tolist()[:3])
        found = f"a run to the end of the scene, with velocities {ends} m/s"
        raise Violation(f"{beyond} is run", expected, found, setup)
    clear = answer.where == "prepare" and answer.is_carom_error
    require(clear, f"{beyond} does not raise a clear error", expected, answer, setup)
