"""Recorded impacts of Carom's own methods as contacts."""

from __future__ import annotations

from typing import TYPE_CHECKING

from carom.engines.api import Contact

if TYPE_CHECKING:
    from carom.solvers.run import RunImpacts


def contacts_since(log: RunImpacts, seen: int) -> tuple[Contact, ...]:
    """Return the impacts after the first `seen` ones, with the velocities around each: a step may have several."""
    if len(log) == seen:  # as after most steps
        return ()
    impacts, turned = log.array()[seen:].tolist(), log.spins()
    spins = [None] * len(impacts) if turned is None else turned[seen:].tolist()
    return tuple(
        Contact(first, second, time_s, (nx, ny), None, ((a, b), (c, d), (e, f), (g, h)), spins_rad_s=spin)
        for (time_s, first, second, (nx, ny), (a, b), (c, d), (e, f), (g, h)), spin in zip(impacts, spins, strict=True)
    )
