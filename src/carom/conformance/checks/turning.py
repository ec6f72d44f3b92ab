"""Checks of spin and friction: coefficients and inertia factors act correctly, and impulses explain spin changes."""

from __future__ import annotations

import math

import numpy as np

from carom.conformance.adapter_under_test import Subject, find_greatest_speed, list_masses
from carom.conformance.checks.common import end_like_pic, require_declared, require_supported
from carom.conformance.checks.contacts import list_acting_contacts, require_explained, watch_steps
from carom.conformance.suite_scenes import DT_S, build_rubbing, build_rubbing_crowd, build_spinning_disc
from carom.conformance.violation import NotApplicable, Setup, require
from carom.engines.api import Capabilities, Contact, Observation
from carom.model.scene import Scene
from carom.model.trace import wall_index
from carom.solvers.pic import solve_pic
from carom.support.formatting import format_number
from carom.support.limits import LARGEST

#: Tested coefficients of friction: both ends of the declared range, and a small coefficient with which discs slide
#: during the whole impact.
FRICTIONS = ("least", "sliding", "greatest")

#: Tested inertia factors I / (m r^2): those of a sphere and of a hoop, and infinity for a disc that can't turn. The
#: first value, 0, means the smallest factor that the adapter declares.
INERTIAS = {"least": 0.0, "sphere": 0.4, "hoop": 1.0, "unturnable": math.inf}

#: Inertia factor and spin that are tested for an engine that declares no limits: more extreme than in any catalogue
#: scene.
SMALL_INERTIA = 1e-6
FAST_RAD_S = 1e5


def check_friction(subject: Subject, share: str, wall_share: str) -> None:
    """Velocities and spins after an impact are correct for all frictions of discs and walls in the declared range."""
    capabilities = _require_friction(subject)
    if not capabilities.walls and wall_share != share:
        raise NotApplicable("walls are not declared, so there is no second coefficient")
    friction, wall_friction = _choose_friction(capabilities, share), _choose_friction(capabilities, wall_share)
    scene = build_rubbing(capabilities, friction, wall_friction, restitution=capabilities.restitution[1])
    _end_by_the_law(subject, scene, f"friction {friction:g}, walls {wall_friction:g}")


def check_inertia(subject: Subject, inertia: str) -> None:
    """Spins after an impact are correct for all declared inertia factors, and for a disc that can't turn."""
    capabilities = _require_friction(subject)
    factor = INERTIAS[inertia] or capabilities.min_inertia_factor or SMALL_INERTIA
    if not capabilities.spin and math.isfinite(factor):
        raise NotApplicable("spin is declared to be False, so no disc can turn")
    friction = _choose_friction(capabilities, "greatest")
    scene = build_rubbing(capabilities, friction, friction, factor, restitution=capabilities.restitution[1])
    _end_by_the_law(subject, scene, f"inertia factor {factor:g}")


def check_greatest_spin(subject: Subject) -> None:
    """The spin of a free disc stays constant, even at the greatest declared spin or rotation per step."""
    capabilities = require_declared(subject, "spin")
    spin = min(capabilities.max_spin_rad_s, capabilities.max_turn_rad / DT_S, FAST_RAD_S)
    setup = Setup(build_spinning_disc(spin))
    for step, observation in enumerate(subject.watch(setup).states):
        found = _read_spins(observation, setup)
        problem = f"the spin of a free disc changes in step {step}"
        is_unchanged = abs(found[0] - spin) <= subject.rounding * spin  # false for NaN
        expected, found_text = (f"{format_number(number, 10)} rad/s" for number in (spin, found[0]))
        require(is_unchanged, problem, expected, found_text, setup)


def check_rubbing(subject: Subject, profile: str) -> None:
    """Friction is at most the coefficient times the normal impulse, and impulses explain all changes of motion.

    Friction may act at a disc's rim, or nearer to its centre by at most the overlap of the bodies.
    """
    capabilities = _require_friction(subject, profile)
    friction = _choose_friction(capabilities, "sliding")
    low, high = capabilities.restitution
    scene = build_rubbing_crowd(capabilities, friction, min(max(low, 0.9), high))
    setup = require_supported(subject, scene, profile)
    allowed = subject.rounding * find_greatest_speed(scene)
    reports = 0
    for step, before, after in watch_steps(subject, setup):
        acting, touched = list_acting_contacts(after)
        _require_cone(setup, acting, friction, allowed, step)
        spins = zip(_read_spins(before, setup), _read_spins(after, setup), strict=True)
        for body, (previous, current) in enumerate(spins):
            change = f"changes by {format_number(current - previous, 3)} rad/s in step {step}"
            problem = f"the spin of disc {body} {change}, but no contact is reported"
            is_unchanged = abs(current - previous) <= allowed * max(1.0, abs(previous))
            require(is_unchanged or body in touched, problem, "a contact with an impulse", acting, setup)
        if all(contact.impulse_n_s is not None and contact.tangential_impulse_n_s is not None for contact in acting):
            reports += len(acting)
            require_explained(setup, after.velocity_m_s - before.velocity_m_s, acting, allowed, step)
            _require_spin_explained(setup, before, after, acting, allowed, step)
    if not reports:
        raise NotApplicable("tangential impulses are not reported")


def _require_friction(subject: Subject, profile: str = "tuned") -> Capabilities:
    capabilities = subject.capabilities(profile)
    if capabilities.friction[1] == 0:
        raise NotApplicable("only the friction 0 is declared")
    return capabilities


def _choose_friction(capabilities: Capabilities, share: str) -> float:
    low, high = capabilities.friction
    # A scene's friction is at most `LARGEST`.
    return {"least": low, "sliding": min(max(low, 0.1), high), "greatest": min(high, LARGEST)}[share]


def _read_spins(observation: Observation, setup: Setup) -> list[float]:
    if observation.spin_rad_s is None:
        expected = "spin_rad_s of a scene that turns"
        require(not setup.scene.arrays.spins.any(), "no spins are reported", expected, None, setup)
        return [0.0] * len(setup.scene.discs)
    return [float(spin) for spin in observation.spin_rad_s]


def _end_by_the_law(subject: Subject, scene: Scene, label: str) -> None:
    """Run a scene of `build_rubbing`, and compare the final state with PIC's."""
    setup, end, spins = Setup(scene), end_like_pic(subject, scene, label), solve_pic(scene).final_spin_rad_s
    exact_spins = scene.arrays.spins if spins is None else spins
    fastest = max(abs(disc.spin_rad_s) for disc in scene.discs)
    promise = subject.adapter.profiles[setup.profile].accuracy.velocity
    allowed = (subject.rounding + promise) * max(fastest, find_greatest_speed(scene) / scene.discs[0].radius_m)
    for i, (spin, found) in enumerate(zip(exact_spins.tolist(), _read_spins(end, setup), strict=True)):
        found_text = f"{format_number(found, 10)} rad/s, off by {format_number(abs(found - spin), 3)}"
        wrong = f"{label}: disc {i} ends with a wrong spin"
        expected = f"{format_number(spin, 10)} rad/s to within {format_number(allowed)}"
        require(abs(found - spin) <= allowed, wrong, expected, found_text, setup)


def _require_cone(setup: Setup, acting: list[Contact], friction: float, allowed: float, step: int) -> None:
    for contact in acting:
        if contact.impulse_n_s is None or contact.tangential_impulse_n_s is None:
            continue
        tangential, limit = abs(contact.tangential_impulse_n_s), friction * contact.impulse_n_s
        problem = f"friction between bodies {contact.first} and {contact.second} in step {step} is too large"
        is_within = tangential <= limit * (1 + allowed) + allowed
        expected = f"at most {friction:g} times the normal impulse, {format_number(limit, 6)} N s"
        require(is_within, problem, expected, f"{format_number(tangential, 6)} N s", setup)


def _require_spin_explained(
    setup: Setup, before: Observation, after: Observation, acting: list[Contact], allowed: float, step: int
) -> None:
    """Check that the reported tangential impulses explain all changes of spin in a step."""
    discs, mass = setup.scene.discs, list_masses(setup.scene)
    explained, arm_short = np.zeros(len(discs)), np.full(len(discs), allowed)
    for contact in acting:
        across = contact.tangential_impulse_n_s or 0.0
        overlap = max(_compute_overlap(setup.scene, contact, state) for state in (before, after))
        for body in (contact.first, contact.second):
            if body >= 0 and mass[body]:
                change = across / (discs[body].inertia_factor * mass[body] * discs[body].radius_m)
                explained[body] -= change
                arm_short[body] += abs(change) * overlap / discs[body].radius_m
    spun = np.array(_read_spins(after, setup)) - np.array(_read_spins(before, setup))
    for body, (spin_change, found, allowed_error) in enumerate(zip(spun, explained, arm_short, strict=True)):
        problem = f"the tangential impulses of step {step} do not explain the spin change of disc {body}"
        expected = f"{format_number(spin_change, 6)} rad/s to within {format_number(allowed_error)}"
        worth = f"impulses for {format_number(found, 6)} rad/s"
        require(abs(spin_change - found) <= allowed_error, problem, expected, worth, setup)


def _compute_overlap(scene: Scene, contact: Contact, state: Observation) -> float:
    """Return the overlap of the two bodies of a contact, in metres; 0 if they do not overlap."""
    first, centre = scene.discs[contact.first], state.position_m[contact.first]
    if contact.second < 0:
        wall = scene.half_planes()[wall_index(contact.second)]
        gap = float((centre - np.array(wall.point_m)) @ np.array(wall.normal)) - first.radius_m
    else:
        distance = math.dist(centre.tolist(), state.position_m[contact.second].tolist())
        gap = distance - first.radius_m - scene.discs[contact.second].radius_m
    return max(0.0, -gap)
