"""Starts of the legs of engines' driven bodies."""

from __future__ import annotations

from carom import Disc
from carom.model.walls import Leg
from carom_adapters.shared.legs import Legs


def test_steps_are_taken_together_once_no_leg_is_to_come() -> None:
    """One step at a time while a leg may begin, the rest in one stretch, and all of them without legs."""
    legs = Legs[str]()
    assert [*legs.step_counts(5)] == [5]
    path = (Leg(from_s=0.0, velocity_m_s=(1.0, 0.0)), Leg(from_s=2.0, velocity_m_s=(0.0, 1.0)))
    legs.add("paddle", Disc(position_m=(0.0, 0.0), radius_m=1.0, mass_kg=float("inf"), driven=True, legs=path))
    told, taken, now_s = list[tuple[str, tuple[float, float]]](), list[int](), 0.0
    for count in legs.step_counts(5):
        told += legs.start_due(now_s)
        taken.append(count)
        now_s += count
    assert (taken, told) == ([1, 1, 1, 2], [("paddle", (0.0, 1.0))])
