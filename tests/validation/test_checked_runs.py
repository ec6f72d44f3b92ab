"""PIC under the eyes of a checker that keeps books of its own: no impact is invented, none is missed.

The gases are those of the campaign (``python -m tests.campaign``), which has gone over hundreds of millions of impacts;
its figures are in ``docs/pic.md``.
"""

from __future__ import annotations

import pytest
from tests.campaign.gases import Gas, Kind, draw
from tests.campaign.run import checked
from tests.lengths import each, long_after


def assert_right(gas: Gas, impacts: int) -> None:
    report = checked(gas, impacts)
    assert [str(violation) for violation in report.violations[:5]] == []
    assert 0 < report.impacts <= impacts


@pytest.mark.parametrize(("number", "impacts"), long_after(1, [(0, 400), (0, 12_500), (1, 12_500)]))
@each("kind", list(Kind))
def test_every_impact_of_a_gas_can_have_happened_and_none_is_missed(kind: Kind, number: int, impacts: int) -> None:
    """At each impact each rule of the checker holds: contact, approach, history, law, order, no overlap."""
    assert_right(draw(number, kind, most_discs=1000), impacts)


@pytest.mark.long
@pytest.mark.parametrize("number", range(20))
def test_two_million_more_impacts_are_right(number: int) -> None:
    """Over some two million impacts of gases of up to 10,000 discs each rule of the checker holds."""
    assert_right(draw(1000 + number), 100_000)
