"""Checks of walls other than plain half-planes, and of driven bodies."""

from __future__ import annotations

from carom.conformance import suite_scenes as scenes
from carom.conformance.adapter_under_test import Subject
from carom.conformance.checks.common import end_like_pic, require_declared
from carom.conformance.violation import NotApplicable
from carom.engines.api.checks import COMBINE_RULES


def check_edges(subject: Subject) -> None:
    """A disc bounces off a single edge from either side."""
    end_like_pic(subject, scenes.build_two_sided_edge(require_declared(subject, "segments")), "an edge")


def check_circles(subject: Subject) -> None:
    """A disc bounces off a circle from inside and from outside."""
    end_like_pic(subject, scenes.build_two_sided_circle(require_declared(subject, "arcs")), "a circle")


def check_posts(subject: Subject) -> None:
    """A disc bounces off a circle from outside."""
    capabilities = subject.capabilities()
    if not (capabilities.posts or capabilities.arcs):
        raise NotApplicable("neither posts nor arcs is declared")
    end_like_pic(subject, scenes.build_outside_circle(capabilities), "a circle")


def check_driven_walls(subject: Subject) -> None:
    """A disc separates from a driven wall at e times the closing speed."""
    capabilities = require_declared(subject, "driven_walls")
    for edge in (False, True) if capabilities.segments else (False,):
        end_like_pic(subject, scenes.build_paddle(capabilities, edge=edge), f"a driven {'edge' if edge else 'wall'}")


def check_driven_discs(subject: Subject) -> None:
    """A driven disc keeps its velocity in an impact, and separates from the other disc at e times the closing speed."""
    end_like_pic(subject, scenes.build_mallet(require_declared(subject, "driven_discs")), "a driven disc")


def check_legs(subject: Subject) -> None:
    """A wall that starts to move during the run hits a disc with the wall's velocity at the time of the impact."""
    end_like_pic(subject, scenes.build_starting_paddle(require_declared(subject, "legs")), "a wall that starts")


def check_belts(subject: Subject) -> None:
    """A disc that slips on a conveyor gains f (1 + e) times the closing speed (f: friction, e: restitution)."""
    end_like_pic(subject, scenes.build_belt(require_declared(subject, "belts")), "a belt")


def check_edge_belts(subject: Subject) -> None:
    """A disc that slips on a conveyor edge gains the same speed on either side, in opposite directions."""
    end_like_pic(subject, scenes.build_edge_belt(require_declared(subject, "edge_belts")), "a conveyor edge")


def check_wall_materials(subject: Subject) -> None:
    """Impacts are correct in a scene with two walls, one with the least and one with the greatest restitution."""
    capabilities = require_declared(subject, "wall_materials")
    low, high = capabilities.restitution
    # Between discs, the restitution of the scene is 1.
    least, greatest = COMBINE_RULES[capabilities.restitution_combine](1.0, high)
    scene = scenes.build_two_walls(max(low, least), min(high, greatest))
    end_like_pic(subject, scene, "walls with different restitutions")
