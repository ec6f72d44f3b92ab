"""docs/hazards.md is what the engines do: measured again, each figure that is not of a chaotic run is on the page."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.engines.staged import Named
from tests.hazards.measures import ENGINES, measured
from tests.hazards.page import lines_of, ranges

from carom.pages.wording import percent

PAGE = Path(__file__).parents[2] / "docs" / "hazards.md"
#: Those that tests/adapters measures.
THERE = {"pit", "pymunk", "pybullet", "mujoco", "box2d"}
NAMES = [name for name in ENGINES if name not in THERE]


@pytest.mark.parametrize("name", NAMES)
def test_figures_over_starts_are_those_of_the_page(name: str, named: Named) -> None:
    """Shares and ranges over 32 starts: the group `engines`, bounces, what is driven, and single findings."""
    named(name)
    page = PAGE.read_text(encoding="utf-8").splitlines()
    figures = list(measured((name,), ("group", "bounces", "driven", "findings")))
    assert figures
    assert [line for line in lines_of(figures) if line not in page] == []


@pytest.mark.parametrize("name", [name for name in NAMES if name != "drake"])  # whose gas takes minutes
def test_a_gas_is_within_the_range_of_the_page(name: str, named: Named) -> None:
    """The median over 16 starts lies in the range of the page, that of a chaotic run; what loses there always loses."""
    named(name)
    known = ranges(PAGE.read_text(encoding="utf-8"), "A gas")
    for figure in measured((name,), ("gas",)):
        assert figure.spread is not None
        least, most = known[f"{figure.engine} {figure.profile}"]
        assert most >= -1.0 or figure.spread.most < 0.0
        assert least <= float(percent(figure.spread.median).removesuffix(" %")) <= most  # rounded as the page is
