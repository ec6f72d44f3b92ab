"""Early ends of a run: the limit of impacts at one instant, and the notes for users."""

from __future__ import annotations

from carom.model.trace import body_name


def standstill_impacts(bodies: int) -> int:
    """Return the number of impacts at one instant after which time counts as no longer advancing.

    Equal discs in a line make at most n(n-1)/2 impacts, all at one instant if they touch. In front of a wall, two discs
    with masses 1:100 make 31 impacts, and with masses 1:10,000 314. A limit of a hundred times the square of the number
    of bodies allows all of these. The limit ends a run at a standstill after milliseconds. For many bodies the limit is
    ten million impacts more than a line has, which take some seconds.
    """
    return min(100 * bodies**2, 10_000_000 + bodies**2 // 2)


def gliding_note(disc: int, wall: int, time_s: float) -> str:
    """Return the note of a run that ends because a disc glides along a wall."""
    return f"disc {disc} glides along wall {wall} from {time_s:.17g} s on"


def crushing_note(disc: int, between: tuple[int, int], time_s: float) -> str:
    """Return the note of a run that ends because a disc is crushed between two bodies."""
    one, other = map(body_name, between)
    return f"disc {disc} is crushed between {one} and {other} at {time_s:.17g} s"
