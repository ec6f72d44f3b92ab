"""Search for falls: times at which a polynomial with interval coefficients changes from positive to negative.

The time axis is repeatedly divided into halves, until the sign of the polynomial or of its slope is certain on each
piece. The signs on a piece are found by a Taylor expansion about the middle of the piece. A fall is certain if the
polynomial is positive, then has negative slope, and then is negative. If the polynomial comes too close to zero for the
precision, the fall is uncertain.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from flint import arb, arb_poly, ctx

from carom.solvers.certified.ball_arithmetic import ZERO

#: Number of halvings before the search: the searched time T is first divided into pieces that end at T, T / 2, T / 4,
#: and so on.
_FIRST = 8
#: A piece stays undecided after _HALVINGS + p / 2 halvings, where p is the precision in bits. This many halvings
#: suffice to find a double zero. A piece also stays undecided if the polynomial changes on it by at most _BLUR times
#: the uncertainty of its coefficients.
_HALVINGS, _BLUR = 60, 4
_INFINITY = float("inf")


class Fall(NamedTuple):
    """A sign change from positive to negative: an interval that contains its time, and whether it certainly happens."""

    time: arb
    certain: bool


class _Piece(NamedTuple):
    low: arb
    high: arb
    slope: int  # sign of the slope; 0 if undecided


def build_squared_gap_powers(
    place: tuple[arb, arb], velocity: tuple[arb, arb], pull: tuple[arb, arb], reach2: arb, *, inside: bool = False
) -> list[arb]:
    """Return the squared distance from the origin minus `reach2`, as coefficients of powers of time, lowest first.

    The arguments `place`, `velocity` and `pull` (the acceleration) are values at time 0. With `inside`, the polynomial
    is negated.
    """
    (x, y), (u, v), (a, b) = place, velocity, pull
    powers = [x * x + y * y - reach2, 2 * (x * u + y * v), u * u + v * v + x * a + y * b, u * a + v * b]
    powers.append((a * a + b * b) / 4)
    return [arb(0) - power for power in powers] if inside else powers


def find_falls(powers: Sequence[arb], until: float | arb = _INFINITY) -> Iterator[Fall]:
    """Yield the times from 0 to `until` at which a polynomial changes from positive to negative, in order.

    Coefficients are given lowest power first. If the first coefficients are exactly zero, the next coefficient
    determines the sign just after time 0.
    """
    left = list(powers)
    while left and left[-1].is_zero():
        left.pop()
    touches = bool(left) and left[0].is_zero()
    while left and left[0].is_zero():
        del left[0]
    if touches and left and not left[0] > 0:
        yield Fall(arb(0), certain=False)
    if len(left) < 2:
        return
    if len(left) <= 3 and (found := _find_parabola_falls(*left)) is not None:
        yield from (fall for fall in found if not fall.time > until)
        return
    polynomial = arb_poly(left)
    sign = _sign(left[0], ZERO)
    pending: list[_Piece] = []
    for piece, at_end in _split_time(polynomial, _bound_zeros(left, until)):
        if piece is not None:
            pending.append(piece)
        if at_end == 0:
            continue
        fall = _find_fall(polynomial, sign, pending, at_end)
        if fall is not None:
            yield fall
        sign, pending = at_end, []
    if any(piece.slope <= 0 for piece in pending) and sign >= 0:
        yield Fall(pending[0].low.union(pending[-1].high), certain=False)


def _find_parabola_falls(c: arb, b: arb, a: arb = ZERO) -> tuple[Fall, ...] | None:
    """Return the sign changes of ``c + b t + a t^2`` from positive to negative (falls) after time 0.

    Return None if undecided, or if c is not above 0.
    """
    d = b * b - 4 * a * c
    if not c > 0:
        return None
    if d < 0 or (a >= 0 and b >= 0):
        return ()
    if d > 0 and b < 0:
        return (Fall(2 * c / (d.sqrt() - b), certain=True),)
    return (Fall((ZERO - b - d.sqrt()) / (2 * a), certain=True),) if d > 0 and b >= 0 and a < 0 else None


def _find_fall(polynomial: arb_poly, sign: int, pending: list[_Piece], at_end: int) -> Fall | None:
    """Return the sign change from positive to negative (fall) on consecutive pieces; None if there is none.

    The polynomial has the sign `sign` before the pieces, and `at_end` after them.
    """
    slopes = {piece.slope for piece in pending}
    if slopes <= {1} or (at_end > 0 and 0 not in slopes) or (sign < 0 and 0 not in slopes):
        return None
    low, high = pending[0].low, pending[-1].high
    if slopes == {-1}:
        return Fall(_refine_zero(polynomial, low, high), certain=True)
    return Fall(low.union(high), certain=False)


def _split_time(polynomial: arb_poly, horizon: arb) -> Iterator[tuple[_Piece | None, int]]:
    """Yield pieces of the time up to `horizon` in order, with the polynomial's signs at their ends (0 if undecided).

    A piece that certainly has no zero is yielded as None.
    """
    edges = [arb(0), *((horizon * arb((1, k - _FIRST))).mid() for k in range(_FIRST)), horizon]
    max_depth = int(ctx.prec) // 2 + _HALVINGS
    stack = [(edges[k], edges[k + 1], 0) for k in reversed(range(len(edges) - 1))]
    while stack:
        low, high, depth = stack.pop()
        middle, half = ((low + high) / 2).mid(), ((high - low) / 2).upper()
        expansion = _expand_about(polynomial, middle)
        change = _bound_change(expansion, half)
        if (found := _sign(expansion[0], change)) != 0:
            yield None, found
            continue
        steep = expansion[1] if len(expansion) > 1 else arb(0)
        slope = _sign(steep, _bound_change([k * expansion[k] for k in range(1, len(expansion))], half))
        if slope == 0 and depth < max_depth and change > _BLUR * expansion[0].rad():
            stack += [(middle, high, depth + 1), (low, middle, depth + 1)]
            continue
        yield _Piece(low, high, slope), _sign(polynomial(high), arb(0))


def _expand_about(polynomial: arb_poly, middle: arb) -> list[arb]:
    shifted = polynomial(arb_poly([middle, 1]))
    return [shifted[k] for k in range(polynomial.degree() + 1)]


def _bound_change(powers: Sequence[arb], half: arb) -> arb:
    """Return a bound of a polynomial without its constant term, for arguments from ``-half`` to `half`."""
    total, power = arb(0), arb(1)
    for coefficient in powers[1:]:
        power = power * half
        total = total + coefficient.abs_upper() * power
    return total


def _sign(value: arb, spread: arb) -> int:
    if value > spread:
        return 1
    return -1 if arb(0) - value > spread else 0


def _bound_zeros(powers: Sequence[arb], until: float | arb) -> arb:
    """Return a time, at most `until`, after which a polynomial has no zero (Fujiwara's bound)."""
    degree, last = len(powers) - 1, powers[-1].abs_lower()
    end = arb(until)
    if not last > 0:
        return end
    sizes = [(power.abs_upper() / last, degree - k) for k, power in enumerate(powers[:-1])]
    roots = [
        size.root(order) for size, order in sizes if not size.is_zero()
    ]  # in python-flint 0.9, arb(0).root(3) is NaN
    bound = arb(0)
    for root in roots:
        bound = bound.max(root)
    return (4 * bound + arb((1, -1000))).upper().min(end)


def _refine_zero(polynomial: arb_poly, low: arb, high: arb) -> arb:
    """Return the zero between two times as an interval that is as narrow as possible.

    The polynomial must decrease between the times. The times are two numbers and not one interval, because an interval
    would be slightly wider, and might contain another zero.
    """
    while True:
        middle, half = ((low + high) / 2).mid(), ((high - low) / 2).upper()
        expansion = _expand_about(polynomial, middle)
        first, last = middle if expansion[0] > 0 else low, middle if expansion[0] < 0 else high
        slope_change = _bound_change([k * expansion[k] for k in range(1, len(expansion))], half)
        slope = expansion[1] + (arb(0) - slope_change).union(slope_change)
        if slope < 0:
            zero = middle - expansion[0] / slope  # a very wide interval if the slope is nearly 0 at one end
            first, last = first.max(zero.lower()), last.min(zero.upper())
        if not first <= last:
            return low.union(high)
        if not 4 * (last - first) < 3 * (high - low):
            return first.union(last)
        low, high = first, last
