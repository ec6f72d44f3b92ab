"""Checks of walls other than plain half-planes, and of driven bodies."""

from __future__ import annotations

from collections.abc import Sequence

from carom.conformance import suite_scenes as scenes
from carom.conformance.adapter_under_test import Subject
from carom.conformance.checks.common import end_with_velocities, require_declared, require_supported
from carom.conformance.violation import NotApplicable
from carom.engines.api.checks import COMBINE_RULES
from carom.model.scene import Scene


def _end_with(subject: Subject, scene: Scene, expected: Sequence[tuple[float, float]], what: str) -> None:
    end_with_velocities(subject, require_supported(subject, scene), expected, what)


def edges_as_declared(subject: Subject) -> None:
    """A disc bounces off a single edge from either side."""
    e = require_declared(subject, "segments").restitution[1]
    _end_with(subject, scenes.build_two_sided_edge(e), [(-3 * e, 0.0), (3 * e, 0.0)], "an edge")


def circles_as_declared(subject: Subject) -> None:
    """A disc bounces off a circle from inside and from outside."""
    e = require_declared(subject, "arcs").restitution[1]
    _end_with(subject, scenes.build_two_sided_circle(e), [(-3 * e, 0.0), (3 * e, 0.0)], "a circle")


def posts_as_declared(subject: Subject) -> None:
    """A disc bounces off a circle from outside."""
    can, e = subject.capabilities(), subject.capabilities().restitution[1]
    if not (can.posts or can.arcs):
        raise NotApplicable("neither posts nor arcs is declared")
    _end_with(subject, scenes.build_outside_circle(e), [(3 * e, 0.0)], "a circle")


def paddles_as_declared(subject: Subject) -> None:
    """A disc leaves a driven wall with the wall's velocity plus e times the closing speed."""
    can = require_declared(subject, "driven_walls")
    e = can.restitution[1]
    for edge in (False, True) if can.segments else (False,):
        _end_with(
            subject, scenes.build_paddle(e, edge=edge), [(1 + 4 * e, 0.0)], f"a driven {'edge' if edge else 'wall'}"
        )


def mallets_as_declared(subject: Subject) -> None:
    """A disc leaves a driven disc as fast as it leaves a driven wall, and the driven disc keeps its velocity."""
    e = require_declared(subject, "driven_discs").restitution[1]
    _end_with(subject, scenes.build_mallet(e), [(1.0, 0.0), (1 + 4 * e, 0.0)], "a driven disc")


def legs_as_declared(subject: Subject) -> None:
    """A wall that starts to move later strikes a disc with its later velocity."""
    e = require_declared(subject, "legs").restitution[1]
    _end_with(subject, scenes.build_starting_paddle(e), [(1 + 4 * e, 0.0)], "a wall that starts")


def belts_as_declared(subject: Subject) -> None:
    """A disc that slips on a belt gains f (1 + e) times its impact speed along the belt."""
    can = require_declared(subject, "belts")
    e, friction = can.restitution[1], min(0.25, can.friction[1])
    _end_with(subject, scenes.build_belt(friction, e), [(3 * e, 3 * (1 + e) * friction)], "a belt")


def edge_belts_as_declared(subject: Subject) -> None:
    """On both sides of a conveyor edge, a slipping disc gains the same speed along the edge, in opposite directions."""
    can = require_declared(subject, "edge_belts")
    e, friction = can.restitution[1], min(0.25, can.friction[1])
    up = 3 * (1 + e) * friction
    _end_with(subject, scenes.build_edge_belt(friction, e), [(-3 * e, -up), (3 * e, up)], "a conveyor edge")


def materials_as_declared(subject: Subject) -> None:
    """Two walls of a scene have different restitutions: the least and the greatest possible one."""
    can = require_declared(subject, "wall_materials")
    low, high = can.restitution
    # The scene's restitution between discs is 1.
    least, greatest = COMBINE_RULES[can.restitution_combine](1.0, high)
    first, second = max(low, least), min(high, greatest)
    scene = scenes.build_two_walls(first, second)
    _end_with(subject, scene, [(3 * first, 0.0), (-3 * second, 0.0)], "walls with different restitutions")
