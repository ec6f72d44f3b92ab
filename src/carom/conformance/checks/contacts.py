"""Checks of reported contacts: fields are valid, times are within the step, and impulses explain velocity changes."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from carom.conformance.adapter_under_test import Subject, find_greatest_speed, list_masses
from carom.conformance.checks.common import format_vector
from carom.conformance.suite_scenes import build_mixed_contacts
from carom.conformance.violation import NotApplicable, Setup, require
from carom.engines.api import Contact, ContactTimes, Observation, Stamp
from carom.model.trace import wall_index
from carom.support.formatting import format_number

Array = NDArray[np.float64]


def _build_setup(subject: Subject, profile: str) -> Setup:
    capabilities = subject.capabilities(profile)
    low, high = capabilities.restitution
    # With a restitution well below 1, discs separate slowly and still overlap in the next steps.
    return Setup(build_mixed_contacts(wall=capabilities.walls, restitution=min(max(low, 0.4), high)), profile)


def watch_steps(subject: Subject, setup: Setup) -> Iterator[tuple[int, Observation, Observation]]:
    """Yield the number of each step, and the observations before and after the step.

    Raise a `Violation` if no contact is reported, or all impulses are 0.
    """
    observations = subject.watch_cached(setup).states
    acted = any(contact.impulse_n_s != 0 for observation in observations for contact in observation.contacts)
    require(acted, "no contact is reported", "impacts of the discs", "none", setup)
    for step, (before, after) in enumerate(pairwise(observations), start=1):
        yield step, before, after


def check_contacts(subject: Subject, profile: str) -> None:
    """Each contact is between a disc and a wall, or a disc and a disc of a higher number.

    The contact's normal has length 1 and points from the first body to the second. The contact's impulse is not
    negative.
    """
    setup = _build_setup(subject, profile)
    discs, walls = len(setup.scene.discs), len(setup.scene.walls)
    for step, before, after in watch_steps(subject, setup):
        for contact in after.contacts:
            first, second = contact.first, contact.second
            sound = 0 <= first < discs and (first < second < discs or -walls <= second < 0)
            problem = f"a contact in step {step} has impossible bodies"
            expected = f"first < second < {discs}" + (f", or a wall, {-walls} to -1" if walls else "")
            require(sound, problem, expected, (first, second), setup)
            length = math.hypot(*contact.normal)
            problem = f"the normal of a contact in step {step} is not a unit vector"
            require(abs(length - 1) <= subject.rounding, problem, 1, f"length {length!r}", setup)
            towards = _compute_direction(setup, before, contact)
            problem = f"the normal of a contact in step {step} does not point from its first body to its second"
            along = float(np.dot(towards, contact.normal)) > 0
            require(along, problem, f"along {format_vector(towards)}", format_vector(contact.normal), setup)
            sound = contact.impulse_n_s is None or contact.impulse_n_s >= 0
            problem = f"the impulse of a contact in step {step} is negative"
            require(sound, problem, "0 or more, or None", contact.impulse_n_s, setup)


def check_contact_times(subject: Subject, profile: str) -> None:
    """A contact's time is within the step that reports the contact, and is the step's start or end if declared so."""
    if subject.capabilities(profile).contact_times is ContactTimes.NONE:
        raise NotApplicable(f"contact times are declared to be {ContactTimes.NONE.value}")
    setup, stamp = _build_setup(subject, profile), subject.capabilities(profile).stamp
    rounding_s = subject.rounding * setup.scene.duration_s
    for step, _, after in watch_steps(subject, setup):
        for contact in after.contacts:
            begin, end = (step - 1) * setup.dt_s, step * setup.dt_s
            problem = f"a contact of disc {contact.first} in step {step} has a time outside that step"
            sound = begin - rounding_s <= contact.time_s <= end + rounding_s
            found = f"{format_number(contact.time_s, 9)} s"
            require(sound, problem, f"{format_number(begin, 9)} to {format_number(end, 9)} s", found, setup)
            declared = {Stamp.START: begin, Stamp.END: end}.get(stamp, contact.time_s)
            problem = f"the time of a contact of disc {contact.first} in step {step} is not {stamp.value}, as declared"
            sound = abs(contact.time_s - declared) <= rounding_s
            require(sound, problem, f"{format_number(declared, 9)} s", found, setup)


def check_impulses(subject: Subject, profile: str) -> None:
    """Velocities change only in contacts, and the reported impulses equal the changes of momentum."""
    setup = _build_setup(subject, profile)
    allowed = subject.rounding * find_greatest_speed(setup.scene)
    for step, before, after in watch_steps(subject, setup):
        change = after.velocity_m_s - before.velocity_m_s
        acting, touched = list_acting_contacts(after)
        for body, size in enumerate(np.hypot(*change.T).tolist()):
            change_text = f"changes by {format_number(size, 3)} m/s in step {step}"
            problem = f"the velocity of disc {body} {change_text}, but no contact is reported"
            require(size <= allowed or body in touched, problem, "a contact with an impulse", acting, setup)
        if all(contact.impulse_n_s is not None for contact in acting):
            # Without friction, only impulses along the normal may change a velocity.
            normal = [dataclasses.replace(contact, tangential_impulse_n_s=None) for contact in acting]
            require_explained(setup, change, normal, allowed, step)


def list_acting_contacts(observation: Observation) -> tuple[list[Contact], set[int]]:
    """Return the contacts of a step that have an impulse, and the bodies of these contacts."""
    acting = [contact for contact in observation.contacts if contact.impulse_n_s != 0]
    return acting, {body for contact in acting for body in (contact.first, contact.second)}


def require_explained(setup: Setup, change: Array, acting: list[Contact], allowed: float, step: int) -> None:
    """Check that the reported impulses explain all changes of velocity in a step."""
    mass, reported = list_masses(setup.scene), np.zeros_like(change)
    for contact in acting:
        along, across = contact.impulse_n_s or 0.0, contact.tangential_impulse_n_s or 0.0
        nx, ny = contact.normal
        impulse = np.array((along * nx - across * ny, along * ny + across * nx))
        for body, sign in ((contact.first, -1.0), (contact.second, 1.0)):
            if body >= 0 and mass[body]:
                reported[body] += sign * impulse / mass[body]
    for body, (expected_change, found) in enumerate(zip(change.tolist(), reported.tolist(), strict=True)):
        problem = f"the impulses of step {step} do not explain the velocity change of disc {body}"
        expected = f"{format_vector(expected_change)} m/s to within {format_number(allowed)}"
        worth = f"impulses for {format_vector(found)} m/s"
        require(math.dist(expected_change, found) <= allowed, problem, expected, worth, setup)


def _compute_direction(setup: Setup, before: Observation, contact: Contact) -> tuple[float, float]:
    """Return the unit vector from the first to the second body of a contact at the start of the step."""
    if contact.second < 0:
        x, y = setup.scene.half_planes()[wall_index(contact.second)].normal
        return (-x, -y)
    x, y = (before.position_m[contact.second] - before.position_m[contact.first]).tolist()
    return (x / math.hypot(x, y), y / math.hypot(x, y))
