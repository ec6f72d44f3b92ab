"""Limit of impacts at one instant, and notes for users about runs that ended early."""

from __future__ import annotations

from carom.model.trace import body_name


def standstill_impacts(bodies: int) -> int:
    """Return the number of impacts at one instant that ends a run at a standstill.

    The limit must allow all finite sequences. n equal discs that touch in a line have at most n(n-1)/2 impacts at one
    instant. Two discs with masses 1:100 in front of a wall have 31 impacts, with masses 1:10,000 314. For few bodies
    the limit is a hundred times the square of their number, which takes milliseconds. For many bodies the limit is ten
    million more impacts than a line has, which takes seconds.
    """
    return min(100 * bodies**2, 10_000_000 + bodies**2 // 2)


def gliding_note(disc: int, wall: int, time_s: float) -> str:
    """Return the note of a run that ends because a disc glides along a wall."""
    return f"disc {disc} glides along wall {wall} from {time_s:.17g} s on"


def crushing_note(disc: int, between: tuple[int, int], time_s: float) -> str:
    """Return the note of a run that ends because a disc is crushed between two bodies."""
    one, other = map(body_name, between)
    return f"disc {disc} is crushed between {one} and {other} at {time_s:.17g} s"
