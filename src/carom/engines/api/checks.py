"""Checks before a run: numbers must be finite, and the declared capabilities must include all that a scene needs."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence, Set
from dataclasses import replace
from heapq import nlargest
from itertools import chain

from carom.engines.api.declarations import Capabilities
from carom.errors import AdapterError
from carom.model.scene import Chain, Disc, Need, Ring, Scene, Wall
from carom.model.trace import Setting
from carom.support.formatting import format_number

#: Largest number of steps of a run, because engines count steps in a C int.
MAX_STEPS = 2**31 - 1

#: Number of stored mantissa bits of a float (IEEE 754, without the leading bit), by the declared width of the float in
#: bits. Adapters can't declare 16-bit floats, because their rounding errors would add up to a tenth of a value during a
#: run.
MANTISSA_BITS = {32: 23, 64: 52}

#: Rules by which an engine computes a pair's coefficient of restitution or friction from a coefficient of each body.
#: With most rules, the coefficient of two discs limits the coefficient of a disc and a wall. Each function takes the
#: coefficient of two discs and the largest allowed coefficient. The function returns the smallest and largest possible
#: coefficient of a disc and a wall. With the rule "pair", each pair has its own coefficient, so every value is
#: possible.
COMBINE_RULES: Mapping[str, Callable[[float, float], tuple[float, float]]] = {
    "pair": lambda _, most: (0.0, most),
    "one": lambda pair, _: (pair, pair),
    "product": lambda pair, most: (0.0, math.sqrt(pair) * most),
    "root": lambda pair, most: (0.0, math.sqrt(pair * most)),  # root of the product of both coefficients
    "average": lambda pair, most: (pair / 2, (pair + most) / 2),
    "minimum": lambda pair, _: (0.0, pair),
    "maximum": lambda pair, most: (pair, most),
}


#: Fields of a scene that must be at least 0.
_NON_NEGATIVE = ("friction", "wall_friction", "damping_per_s", "wall_rolling_resistance", "table_deceleration_m_s2")


def require_sound(
    engine: str,
    scene: Scene,
    settings: Mapping[str, Setting],
    known: Sequence[str],
    at_least: Mapping[str, float] | None = None,
    at_most: Mapping[str, float] | None = None,
    words: Mapping[str, Sequence[str]] | None = None,
) -> None:
    """Refuse scenes that contain invalid numbers, and settings that are unknown or invalid.

    A scene can be created without validation, and engines abort on invalid numbers or silently change the numbers. The
    limits of the engine are checked by `require_supported` and the adapter.

    Args:
        engine: Name of the engine in messages.
        scene: The scene.
        settings: The requested settings.
        known: Names of all settings that exist, except ``dt_s``.
        at_least: Smallest values of settings, including ``dt_s``.
        at_most: Largest values of settings, including ``dt_s``.
        words: Allowed values of settings that are strings, by the setting's name.

    Raises:
        AdapterError: A field or setting is invalid; the message contains its name and value.
    """
    at_least, at_most, words = at_least or {}, at_most or {}, words or {}
    for name, setting in settings.items():
        if name not in ("dt_s", *known):
            raise AdapterError(f"{engine}: no setting {name!r}; available: {', '.join(('dt_s', *known))}")
        if setting != setting:
            raise AdapterError(f"{engine}: {name} must be a number, got {setting}")
        if name in words and setting not in words[name]:
            raise AdapterError(f"{engine}: {name} must be one of {', '.join(words[name])}, got {setting!r}")
        if not isinstance(setting, str):
            if not setting >= at_least.get(name, -math.inf):
                raise AdapterError(f"{engine}: {name} must be at least {at_least[name]:g}, got {setting}")
            if not setting <= at_most.get(name, math.inf):
                raise AdapterError(f"{engine}: {name} must be at most {at_most[name]:g}, got {setting}")
    dt_s = settings["dt_s"]
    if isinstance(dt_s, str) or not 0 < dt_s < math.inf:
        raise AdapterError(f"{engine}: dt_s must be above 0 and finite, got {dt_s}")
    _require_sound_numbers(engine, scene)


def _require_sound_numbers(engine: str, scene: Scene) -> None:
    for i, disc in enumerate(scene.discs):
        for field, value, sound in (
            ("position_m", disc.position_m, all(map(math.isfinite, disc.position_m))),
            ("velocity_m_s", disc.velocity_m_s, all(map(math.isfinite, disc.velocity_m_s))),
            ("radius_m", disc.radius_m, 0 < disc.radius_m < math.inf),
            ("mass_kg", disc.mass_kg, disc.mass_kg > 0),
            ("spin_rad_s", disc.spin_rad_s, math.isfinite(disc.spin_rad_s)),
            ("inertia_factor", disc.inertia_factor, disc.inertia_factor > 0),
        ):
            if not sound:
                raise AdapterError(f"{engine}: discs[{i}].{field} is {value}, which is not possible for a disc")
    for field, value in (("restitution", scene.restitution), ("wall_restitution", scene.wall_restitution)):
        if not 0 <= value <= 1:
            raise AdapterError(f"{engine}: {field} must be from 0 to 1, got {value}")
    for field in _NON_NEGATIVE:
        if not 0 <= (value := getattr(scene, field)) < math.inf:
            raise AdapterError(f"{engine}: {field} must be a number, 0 or more, got {value}")
    if not all(map(math.isfinite, scene.gravity_m_s2)):
        raise AdapterError(f"{engine}: gravity_m_s2 must be finite, got {scene.gravity_m_s2}")


def unsupported_reason(scene: Scene, capabilities: Capabilities, dt_s: float, *, located: bool = False) -> str:
    """Return why a method with these capabilities can't run the scene; empty if the method can run it.

    Args:
        scene: The scene.
        capabilities: Declared capabilities.
        dt_s: Step size, in seconds.
        located: Whether Carom shortens steps so that they end at contacts.
    """
    needs = scene.needs
    problems = chain(
        _list_missing_features(needs, capabilities),
        _list_located_problems(scene, needs, dt_s) if located else (),
        _list_restitution_problems(scene, capabilities),
        _list_friction_problems(scene, needs, capabilities),
        _list_motion_problems(scene, needs, capabilities, dt_s),
        _list_size_problems(scene, capabilities),
        _list_step_problems(scene, dt_s),
    )
    return next(problems, "")


def _list_missing_features(needs: Set[Need], capabilities: Capabilities) -> Iterator[str]:
    for need in Need:
        if need in needs and not supports(capabilities, need):
            suffix = " yet: gravity_m_s2 must be [0, 0]" if need is Need.GRAVITY else ""
            yield f"the scene has {need.value}, which this method does not support{suffix}"


def _list_located_problems(scene: Scene, needs: Set[Need], dt_s: float) -> Iterator[str]:
    if Need.GRAVITY in needs and needs & {Need.WALLS, Need.IMMOVABLE}:
        # Engines integrate by Euler's method, which can change the speed at an impact by gravity times step size. If
        # steps are not shortened, the late detection of impacts cancels this error.
        gained_m_s = math.hypot(*scene.gravity_m_s2) * dt_s
        yield (
            "discs fall onto walls or immovable discs, and this profile ends steps at impacts. So the engine's error "
            "of g dt^2/2 in each step does not cancel, and each bounce gains or loses up to g dt "
            f"({format_number(gained_m_s, 3)} m/s)"
        )


def _list_coefficients(scene: Scene, law: str) -> list[tuple[str, float]]:
    """Return the different values of the restitution or friction in a scene, with their names."""
    of_discs = [(law, getattr(scene, law))] if len(scene.discs) > 1 else []
    of_walls = dict.fromkeys(getattr(material, law) for material in scene.arrays.materials)
    return of_discs + [(f"wall_{law}", coefficient) for coefficient in of_walls]


def _list_restitution_problems(scene: Scene, capabilities: Capabilities) -> Iterator[str]:
    low, high = capabilities.restitution
    coefficients = _list_coefficients(scene, "restitution")
    for name, value in coefficients:
        if not low <= value <= high:
            yield f"{name} is {value}, and this method simulates only {low:g} to {high:g} exactly"
    yield from _list_combination_problems(capabilities.restitution_combine, coefficients, high)


def _list_friction_problems(scene: Scene, needs: Set[Need], capabilities: Capabilities) -> Iterator[str]:
    if Need.FRICTION in needs and not capabilities.spin and any(_can_turn(disc) for disc in scene.discs):
        yield f"the scene has {Need.FRICTION.value} on discs that can turn, and this method does not turn discs"
    low, high = capabilities.friction
    coefficients = _list_coefficients(scene, "friction")
    for name, value in coefficients:
        if value != 0.0 and not low <= value <= high:
            yield f"{name} is {value:g}, and this method simulates only {low:g} to {high:g} exactly"
    yield from _list_combination_problems(capabilities.friction_combine, coefficients, high)


def _list_motion_problems(scene: Scene, needs: Set[Need], capabilities: Capabilities, dt_s: float) -> Iterator[str]:
    disc_speeds = [_compute_greatest_speed(disc) for disc in scene.discs]
    fastest = max(disc_speeds)
    if fastest > capabilities.max_speed_m_s:
        yield f"a disc moves at {fastest:g} m/s, and this method's limit is {capabilities.max_speed_m_s:g} m/s"
    spin = max(abs(disc.spin_rad_s) for disc in scene.discs)
    if spin > capabilities.max_spin_rad_s:
        yield f"a disc spins at {spin:g} rad/s, and this method's limit is {capabilities.max_spin_rad_s:g} rad/s"
    if spin * dt_s > capabilities.max_turn_rad:
        rotation_text = f"a disc at {spin:g} rad/s turns by {spin * dt_s:g} rad in a step of {dt_s:g} s"
        yield f"{rotation_text}, and this method turns discs by at most {capabilities.max_turn_rad:g} rad a step"
    for i, disc in enumerate(scene.discs if needs & {Need.SPIN, Need.FRICTION} else ()):
        if disc.inertia_factor < capabilities.min_inertia_factor:
            limits = f"{capabilities.min_inertia_factor:g} to 1, or a disc that does not turn"
            yield f"discs[{i}].inertia_factor is {disc.inertia_factor:g}, and this method simulates {limits}"
    wall_speeds = [_compute_greatest_speed(wall) for wall in scene.walls if wall.driven]
    closing, threshold = sum(nlargest(2, [*disc_speeds, *wall_speeds])), capabilities.restitution_threshold_m_s
    if 0 < closing <= threshold and any(value > 0 for _, value in _list_coefficients(scene, "restitution")):
        slow = f"no two bodies approach each other at more than {closing:g} m/s"
        yield f"{slow}, and this method makes contacts of up to {threshold:g} m/s inelastic"
    if fastest * dt_s > capabilities.max_move_m:
        motion_text = f"a disc at {fastest:g} m/s moves {fastest * dt_s:g} m in a step of {dt_s:g} s"
        yield f"{motion_text}, and this method moves discs by at most {capabilities.max_move_m:g} m a step"


def _list_size_problems(scene: Scene, capabilities: Capabilities) -> Iterator[str]:
    for i, disc in enumerate(scene.discs):
        if not capabilities.min_radius_m <= disc.radius_m <= capabilities.max_radius_m:
            limits = f"{capabilities.min_radius_m:g} to {capabilities.max_radius_m:g} m"
            yield f"discs[{i}].radius_m is {disc.radius_m:g}, and this method simulates {limits}"
    for i, disc in enumerate(scene.discs):
        if not (disc.immovable or capabilities.min_mass_kg <= disc.mass_kg <= capabilities.max_mass_kg):
            limits = f"{capabilities.min_mass_kg:g} to {capabilities.max_mass_kg:g} kg, or an immovable disc"
            yield f"discs[{i}].mass_kg is {disc.mass_kg:g}, and this method simulates {limits}"
    farthest = max(max(abs(c) for c in disc.position_m) + disc.radius_m for disc in scene.discs)
    if farthest > capabilities.max_coordinate_m:
        yield f"a disc reaches to {farthest:g} m, and this method's limit is {capabilities.max_coordinate_m:g} m"
    # Far from the origin, floats are so coarse that a position may be wrong by more than the disc's radius.
    rounding, smallest = farthest * 2.0 ** -MANTISSA_BITS[capabilities.float_bits], min(d.radius_m for d in scene.discs)
    if rounding > smallest:
        floats = f"{capabilities.float_bits}-bit floats"
        yield f"a disc reaches to {farthest:g} m, where {floats} round by more than the smallest radius, {smallest:g} m"


def _list_step_problems(scene: Scene, dt_s: float) -> Iterator[str]:
    if scene.duration_s / dt_s > MAX_STEPS:
        yield f"{scene.duration_s:g} s in steps of {dt_s:g} s are more steps than an engine can count"


def supports(capabilities: Capabilities, need: Need) -> bool:
    """Whether the capabilities include a feature that a scene needs."""
    match need:
        case Need.IMMOVABLE:
            return capabilities.immovable_discs
        case Need.POSTS:
            return capabilities.posts or capabilities.arcs
        case Need.FRICTION:
            return capabilities.friction[1] > 0.0
        case Need.RESTITUTION:  # restitution is declared as a range, which is checked separately
            return True
        case _:
            return bool(getattr(capabilities, need.name.lower()))


def _list_combination_problems(rule: str, coefficients: Sequence[tuple[str, float]], max_value: float) -> Iterator[str]:
    """Yield reasons why the engine's rule of combination can't produce these coefficients of discs and walls."""
    if len(coefficients) < 2 or coefficients[0][0].startswith("wall"):
        return
    (name, pair), *of_walls = coefficients
    least, greatest = COMBINE_RULES[rule](pair, max_value)
    for wall_name, wall in of_walls:
        if not least <= wall <= greatest:
            rule_text = f"this method combines coefficients by {rule!r}"
            required = f"{wall_name} must be {least:g} to {greatest:g}"
            yield f"{wall_name} is {wall:g} with a {name} of {pair:g}; {rule_text}, so {required}"


def _compute_greatest_speed(body: Disc | Wall | Chain | Ring) -> float:
    """Return the greatest prescribed or initial speed of a body, in metres per second."""
    return body.drive.fastest if body.legs else math.hypot(*body.velocity_m_s)


def _can_turn(disc: Disc) -> bool:
    return not disc.immovable and math.isfinite(disc.inertia_factor)


def require_supported(engine: str, scene: Scene, capabilities: Capabilities, dt_s: float) -> None:
    """Refuse a scene that the declared capabilities exclude.

    Carom makes the same check before a run. In addition, Carom checks `restitution_threshold_m_s`. This function
    ignores `restitution_threshold_m_s`, because its value depends on the profile, which `prepare` does not receive.

    Args:
        engine: Name of the engine in messages.
        scene: The scene, checked by `require_sound`.
        capabilities: Declared capabilities of the adapter.
        dt_s: Step size, in seconds.

    Raises:
        AdapterError: A capability excludes the scene; the message contains the reason.
    """
    if reason := unsupported_reason(scene, replace(capabilities, restitution_threshold_m_s=0.0), dt_s):
        raise AdapterError(f"{engine}: {reason}")
