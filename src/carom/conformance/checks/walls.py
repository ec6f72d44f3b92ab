"""Checks of walls other than plain half-planes, and of driven bodies."""

from __future__ import annotations

from carom.conformance.adapter_under_test import Subject
from carom.conformance.checks.common import declared, end_with_velocities, supported
from carom.conformance.suite_scenes import (
    at_a_circle,
    belt,
    edge_belt,
    either_side,
    in_and_out,
    mallet,
    paddle,
    starting_paddle,
    two_walls,
)
from carom.conformance.violation import NotApplicable
from carom.engines.api.checks import COMBINE_RULES


def edges_as_declared(subject: Subject) -> None:
    """A disc bounces off a single edge from either side."""
    e = declared(subject, "segments").restitution[1]
    setup = supported(subject, either_side(e))
    end_with_velocities(subject, setup, [(-3 * e, 0.0), (3 * e, 0.0)], "an edge")


def circles_as_declared(subject: Subject) -> None:
    """A disc bounces off a circle from inside and from outside."""
    e = declared(subject, "arcs").restitution[1]
    setup = supported(subject, in_and_out(e))
    end_with_velocities(subject, setup, [(-3 * e, 0.0), (3 * e, 0.0)], "a circle")


def posts_as_declared(subject: Subject) -> None:
    """A disc bounces off a circle from outside."""
    can, e = subject.capabilities(), subject.capabilities().restitution[1]
    if not (can.posts or can.arcs):
        raise NotApplicable("neither posts nor arcs is declared")
    setup = supported(subject, at_a_circle(e))
    end_with_velocities(subject, setup, [(3 * e, 0.0)], "a circle")


def paddles_as_declared(subject: Subject) -> None:
    """A disc leaves a driven wall with the wall's velocity plus e times the closing speed."""
    can = declared(subject, "driven_walls")
    e = can.restitution[1]
    for edge in (False, True) if can.segments else (False,):
        setup = supported(subject, paddle(e, edge=edge))
        end_with_velocities(subject, setup, [(1 + 4 * e, 0.0)], f"a driven {'edge' if edge else 'wall'}")


def mallets_as_declared(subject: Subject) -> None:
    """A disc leaves a driven disc as it leaves a driven wall, and the driven disc keeps its velocity."""
    e = declared(subject, "driven_discs").restitution[1]
    setup = supported(subject, mallet(e))
    end_with_velocities(subject, setup, [(1.0, 0.0), (1 + 4 * e, 0.0)], "a driven disc")


def legs_as_declared(subject: Subject) -> None:
    """A wall that starts to move later strikes a disc with its later velocity."""
    e = declared(subject, "legs").restitution[1]
    setup = supported(subject, starting_paddle(e))
    end_with_velocities(subject, setup, [(1 + 4 * e, 0.0)], "a wall that starts")


def belts_as_declared(subject: Subject) -> None:
    """A disc that slips on a belt gains f (1 + e) times its impact speed along the belt."""
    can = declared(subject, "belts")
    e, friction = can.restitution[1], min(0.25, can.friction[1])
    setup = supported(subject, belt(friction, e))
    end_with_velocities(subject, setup, [(3 * e, 3 * (1 + e) * friction)], "a belt")


def edge_belts_as_declared(subject: Subject) -> None:
    """A disc that slips on a conveyor edge gains the same speed along it on either side, in opposite directions."""
    can = declared(subject, "edge_belts")
    e, friction = can.restitution[1], min(0.25, can.friction[1])
    setup, up = supported(subject, edge_belt(friction, e)), 3 * (1 + e) * friction
    end_with_velocities(subject, setup, [(-3 * e, -up), (3 * e, up)], "a conveyor edge")


def materials_as_declared(subject: Subject) -> None:
    """Two walls of a scene have different restitutions: the least and the greatest that are possible."""
    can = declared(subject, "wall_materials")
    low, high = can.restitution
    # The scene's restitution between discs is 1.
    least, greatest = COMBINE_RULES[can.restitution_combine](1.0, high)
    first, second = max(low, least), min(high, greatest)
    setup = supported(subject, two_walls(first, second))
    end_with_velocities(subject, setup, [(3 * first, 0.0), (-3 * second, 0.0)], "walls with different restitutions")
