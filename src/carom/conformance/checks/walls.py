"""Walls other than plain half-planes, and driven bodies: what an adapter declares of them, it does."""

from __future__ import annotations

from carom.adapter.checks import COMBINE_RULES
from carom.conformance.checks.common import end_with_velocities, require_supported
from carom.conformance.subject import Subject
from carom.conformance.suite_scenes import at_a_circle, either_side, in_and_out, mallet, paddle, two_walls
from carom.conformance.violation import NotApplicable, Setup

__all__ = [
    "circles_as_declared",
    "edges_as_declared",
    "mallets_as_declared",
    "materials_as_declared",
    "paddles_as_declared",
    "posts_as_declared",
]


def edges_as_declared(subject: Subject) -> None:
    """A disc comes back from an edge that stands on its own, whichever side it comes from."""
    can, e = subject.capabilities(), subject.capabilities().restitution[1]
    if not can.segments:
        raise NotApplicable("segments is declared to be False")
    setup = Setup(either_side(e))
    require_supported(subject, setup)
    end_with_velocities(subject, setup, [(-3 * e, 0.0), (3 * e, 0.0)], "an edge")


def circles_as_declared(subject: Subject) -> None:
    """A disc comes back from a circle, from inside and from outside."""
    can, e = subject.capabilities(), subject.capabilities().restitution[1]
    if not can.arcs:
        raise NotApplicable("arcs is declared to be False")
    setup = Setup(in_and_out(e))
    require_supported(subject, setup)
    end_with_velocities(subject, setup, [(-3 * e, 0.0), (3 * e, 0.0)], "a circle")


def posts_as_declared(subject: Subject) -> None:
    """A disc comes back from a circle that it meets from outside."""
    can, e = subject.capabilities(), subject.capabilities().restitution[1]
    if not (can.posts or can.arcs):
        raise NotApplicable("neither posts nor arcs is declared")
    setup = Setup(at_a_circle(e))
    require_supported(subject, setup)
    end_with_velocities(subject, setup, [(3 * e, 0.0)], "a circle")


def paddles_as_declared(subject: Subject) -> None:
    """A disc leaves a driven wall at the wall's velocity and its share of that at which they closed."""
    can, e = subject.capabilities(), subject.capabilities().restitution[1]
    if not can.driven_walls:
        raise NotApplicable("driven_walls is declared to be False")
    for edge in (False, True) if can.segments else (False,):
        setup = Setup(paddle(e, edge=edge))
        require_supported(subject, setup)
        end_with_velocities(subject, setup, [(1 + 4 * e, 0.0)], f"a driven {'edge' if edge else 'wall'}")


def mallets_as_declared(subject: Subject) -> None:
    """A disc leaves a driven disc as it leaves a driven wall, and that goes on as before."""
    can, e = subject.capabilities(), subject.capabilities().restitution[1]
    if not can.driven_discs:
        raise NotApplicable("driven_discs is declared to be False")
    setup = Setup(mallet(e))
    require_supported(subject, setup)
    end_with_velocities(subject, setup, [(1.0, 0.0), (1 + 4 * e, 0.0)], "a driven disc")


def materials_as_declared(subject: Subject) -> None:
    """Two walls of one scene each have their own restitution: the least and the greatest that can be beside discs'."""
    can = subject.capabilities()
    if not can.wall_materials:
        raise NotApplicable("wall_materials is declared to be False")
    low, high = can.restitution
    # The discs of the scene have restitution 1 between them.
    least, greatest = COMBINE_RULES[can.restitution_combine](1.0, high)
    first, second = max(low, least), min(high, greatest)
    setup = Setup(two_walls(first, second))
    require_supported(subject, setup)
    end_with_velocities(subject, setup, [(3 * first, 0.0), (-3 * second, 0.0)], "walls of their own")
