"""Checks of walls other than plain half-planes, and of driven bodies."""

from __future__ import annotations

from collections.abc import Sequence

from carom.conformance import suite_scenes as scenes
from carom.conformance.adapter_under_test import Subject
from carom.conformance.checks.common import end_with_velocities, require_declared, require_supported
from carom.conformance.violation import NotApplicable
from carom.engines.api.checks import COMBINE_RULES
from carom.model.scene import Scene


def _end_with(subject: Subject, scene: Scene, expected: Sequence[tuple[float, float]], label: str) -> None:
    end_with_velocities(subject, require_supported(subject, scene), expected, label)


def edges_as_declared(subject: Subject) -> None:
    """A disc bounces off a single edge from either side."""
    scene = scenes.build_two_sided_edge(require_declared(subject, "segments"))
    speed = 3 * scene.wall_restitution
    _end_with(subject, scene, [(-speed, 0.0), (speed, 0.0)], "an edge")


def circles_as_declared(subject: Subject) -> None:
    """A disc bounces off a circle from inside and from outside."""
    scene = scenes.build_two_sided_circle(require_declared(subject, "arcs"))
    speed = 3 * scene.wall_restitution
    _end_with(subject, scene, [(-speed, 0.0), (speed, 0.0)], "a circle")


def posts_as_declared(subject: Subject) -> None:
    """A disc bounces off a circle from outside."""
    capabilities = subject.capabilities()
    if not (capabilities.posts or capabilities.arcs):
        raise NotApplicable("neither posts nor arcs is declared")
    scene = scenes.build_outside_circle(capabilities)
    _end_with(subject, scene, [(3 * scene.wall_restitution, 0.0)], "a circle")


def paddles_as_declared(subject: Subject) -> None:
    """A disc separates from a driven wall at e times the closing speed."""
    capabilities = require_declared(subject, "driven_walls")
    for edge in (False, True) if capabilities.segments else (False,):
        scene = scenes.build_paddle(capabilities, edge=edge)
        _end_with(subject, scene, [(1 + 4 * scene.wall_restitution, 0.0)], f"a driven {'edge' if edge else 'wall'}")


def mallets_as_declared(subject: Subject) -> None:
    """A driven disc keeps its velocity in an impact, and separates from the other disc at e times the closing speed."""
    scene = scenes.build_mallet(require_declared(subject, "driven_discs"))
    _end_with(subject, scene, [(1.0, 0.0), (1 + 4 * scene.restitution, 0.0)], "a driven disc")


def legs_as_declared(subject: Subject) -> None:
    """A wall that starts to move during the run hits a disc with the wall's velocity at the time of the impact."""
    scene = scenes.build_starting_paddle(require_declared(subject, "legs"))
    _end_with(subject, scene, [(1 + 4 * scene.wall_restitution, 0.0)], "a wall that starts")


def belts_as_declared(subject: Subject) -> None:
    """A disc that slips on a conveyor gains f (1 + e) times the closing speed (f: friction, e: restitution)."""
    scene = scenes.build_belt(require_declared(subject, "belts"))
    e = scene.wall_restitution
    _end_with(subject, scene, [(3 * e, 3 * (1 + e) * scene.wall_friction)], "a belt")


def edge_belts_as_declared(subject: Subject) -> None:
    """A disc that slips on a conveyor edge gains the same speed on either side, in opposite directions."""
    scene = scenes.build_edge_belt(require_declared(subject, "edge_belts"))
    e, up = scene.wall_restitution, 3 * (1 + scene.wall_restitution) * scene.wall_friction
    _end_with(subject, scene, [(-3 * e, -up), (3 * e, up)], "a conveyor edge")


def materials_as_declared(subject: Subject) -> None:
    """Impacts are correct in a scene with two walls, one with the least and one with the greatest restitution."""
    capabilities = require_declared(subject, "wall_materials")
    low, high = capabilities.restitution
    # Between discs, the restitution of the scene is 1.
    least, greatest = COMBINE_RULES[capabilities.restitution_combine](1.0, high)
    first, second = max(low, least), min(high, greatest)
    scene = scenes.build_two_walls(first, second)
    _end_with(subject, scene, [(3 * first, 0.0), (-3 * second, 0.0)], "walls with different restitutions")
