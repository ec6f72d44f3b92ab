"""docs/results/hazards.md: measured again, each figure of a run that is not chaotic is on the page."""

from pathlib import Path

import pytest
from tests.cases import each, release_after
from tests.hazards.measures import CHAOTIC, ENGINES, FINDINGS, measure_engines
from tests.hazards.page import SHOWN_TO, parse_ranges, render_lines
from tests.scene_builders import Named

from carom.execution.job import Method
from carom.support.formatting import format_percent

PAGE = Path(__file__).parents[2] / "docs" / "results" / "hazards.md"
NAMES = ("pit", "pymunk", "pybullet", "mujoco", "box2d")
#: Those that are no part of `all`, run with `-m engines`.
FURTHER = [pytest.param(name, marks=pytest.mark.engines) for name in ENGINES if name not in NAMES]


@each("name", [*release_after(0, NAMES), *FURTHER])
def test_hazards_page_has_the_measured_figures(name: str, named: Named) -> None:
    """The figures measured over 32 starts are lines of the hazards page."""
    named(name)
    assert_shown(name, "group", "bounces", "driven", "findings")


@pytest.mark.long
def test_hazards_page_has_the_measured_figures_of_pit() -> None:
    """The measured figures of PIT for the group `engines` and for bounces are lines of the hazards page."""
    assert_shown("pit", "group", "bounces")


def assert_shown(name: str, *tables: str) -> None:
    page = PAGE.read_text(encoding="utf-8").splitlines()
    figures = list(measure_engines((name,), tables, chaotic=False))
    assert figures
    assert [line for line in render_lines(figures) if line not in page] == []


@each("name", [*release_after(0, NAMES), *(row for row in FURTHER if row.values != ("drake",))])
def test_chaotic_medians_are_within_the_ranges_of_the_page(name: str, named: Named) -> None:
    """The median of each chaotic measurement is within the range that the hazards page gives for it."""
    named(name)
    text = PAGE.read_text(encoding="utf-8")
    gas, findings = parse_ranges(text, "A gas"), parse_ranges(text, "Findings")
    chaotic = {finding.engine for finding in FINDINGS if finding.says in CHAOTIC}
    for figure in measure_engines((name,), ("gas", "findings") if name in chaotic else ("gas",)):
        assert figure.spread is not None
        method = Method(figure.engine, figure.profile).label
        if figure.table == "gas":
            least, most = gas[method]
            assert most >= -1.0 or figure.spread.most < 0.0  # what loses there always loses
            median = float(format_percent(figure.spread.median).removesuffix(" %"))  # rounded as the page is
            assert least <= median <= most
        elif figure.of in CHAOTIC:
            least, most = findings[f"{method}: {figure.of}"]
            assert least - SHOWN_TO <= figure.spread.median <= most + SHOWN_TO
