"""Damping in certified runs: as `carom.damping`, the undamped run in the time of clocks, in balls."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flint import arb

if TYPE_CHECKING:
    from carom.solvers.certified.impacts import BallImpact

_ZERO = arb(0)


def undamped(damping_per_s: float, time: arb) -> arb:
    """Return in what time an undamped disc would get as far as a damped one does in a time."""
    return time if not damping_per_s else (_ZERO - (_ZERO - damping_per_s * time).expm1()) / damping_per_s


def kept(damping_per_s: float, undamped_time: arb) -> arb:
    """Return what is left of a speed then, over the speed."""
    return 1 - damping_per_s * undamped_time


def damped(damping_per_s: float, impact: BallImpact) -> BallImpact:
    """Return an impact of the undamped run as it is with damping."""
    if not damping_per_s:
        return impact
    left = kept(damping_per_s, impact.time)
    before, spins = impact.before, impact.spins_before
    return impact._replace(
        time=_ZERO - (_ZERO - damping_per_s * impact.time).log1p() / damping_per_s,
        after=_times(impact.after, left),
        before=None if before is None else _times(before, left),
        spins_after=(impact.spins_after[0] * left, impact.spins_after[1] * left),
        spins_before=None if spins is None else (spins[0] * left, spins[1] * left),
    )


def _times(parts: tuple[arb, arb, arb, arb], left: arb) -> tuple[arb, arb, arb, arb]:
    a, b, c, d = (part * left for part in parts)
    return a, b, c, d
