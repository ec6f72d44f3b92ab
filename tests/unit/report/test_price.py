"""Of each engine one sentence, with numbers: how much of its error is the price of sampling."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from carom.comparator import compare
from carom.report.cross_check import cross_check_document
from carom.report.document import Medium
from carom.report.grid import build_grid
from carom.report.price import price_lines, prices
from carom.report.render import html, markdown, terminal
from carom.report.tables import spread_table
from carom.runs.phases import PhaseSpread
from carom.runs.results import Results, Row
from carom.trace import Trace


def with_toy(results: Results, change: dict[str, float]) -> Results:
    """The results with the toy engine's velocities after each impact made faster, by scene."""
    rows = []
    for row in results.rows:
        if row.job.engine == "toy" and row.trace is not None and row.score is not None:
            rows.append(rescored(results, row, change.get(row.job.scene.name, 1.0)))
        else:
            rows.append(row)
    return replace(results, rows=tuple(rows))


def rescored(results: Results, row: Row, factor: float) -> Row:
    assert row.trace is not None
    impacts = row.trace.impacts.copy()
    impacts["velocity_first_after"] *= factor
    trace: Trace = replace(row.trace, impacts=impacts)
    pit = next(
        other.trace
        for other in results.rows
        if other.job.engine == "pit" and other.job.scene == row.job.scene and other.job.dt_s == row.job.dt_s
    )
    score = compare(results.references[row.job.scene.name], trace, sampling=pit)
    return replace(row, trace=trace, score=score)


def test_an_engine_that_is_pit_is_said_to_be_all_sampling(results: Results) -> None:
    """An engine that equals PIT in every scene is told so in words, in every format."""
    (toy,) = prices(build_grid(results))
    assert toy.column.engine == "toy"
    assert toy.equal == toy.scenes > 0
    assert toy.share == 1.0
    assert toy.own == 0.0
    (line,) = price_lines([toy])
    assert "it equals PIT to rounding in all of" in line
    assert "all of its error is the price of sampling" in line
    assert line in list(terminal(cross_check_document(results)))
    assert line in html(cross_check_document(results))
    assert "all of its error is the price of sampling" in markdown(cross_check_document(results))


def test_what_an_engine_adds_of_its_own_is_its_own(results: Results) -> None:
    """One whose velocities are 10 % too fast in one scene owes its share there, as its own score has it."""
    late = "paper/late"
    worse = with_toy(results, {late: 1.1})
    (toy,) = prices(build_grid(worse))
    score = next(
        row.score
        for row in worse.rows
        if row.job.engine == "toy" and row.job.scene.name == late and row.job.refinement == 0
    )
    assert score is not None
    assert score.sampling is not None
    assert score.solver is not None
    assert score.solver.velocity > 0.01
    expected = score.sampling.velocity / (score.sampling.velocity + score.solver.velocity)
    assert score.sampling_share == pytest.approx(expected, rel=1e-15)
    assert toy.share == pytest.approx(expected, rel=1e-15)  # the other scenes have no velocity error
    assert toy.equal == toy.scenes - 1
    (line,) = price_lines([toy])
    assert " % of its velocity error is the price of sampling" in line


def test_the_spread_over_phases_is_shown(results: Results) -> None:
    """A cell that was run at many phases shows median, worst and miss share in both documents."""
    spread = PhaseSpread(12, 3, 3, 0.0123, 0.0456, 0.01, 0.02, 0.25)
    rows = tuple(replace(row, spread=spread) if row.job.engine == "toy" else row for row in results.rows)
    wide = replace(results, rows=rows, phases=12)
    view = cross_check_document(wide)
    assert {row[1].text for row in spread_table(wide, build_grid(wide)).shown(Medium.PAGE)[1]} == {"toy tuned"}
    for text in (html(view), markdown(view)):
        assert "0.012" in text
        assert "0.046" in text
        assert "25 %" in text
    assert "Spread over phases" not in markdown(cross_check_document(results))


def test_a_horizon_is_told_and_called_an_estimate(results: Results) -> None:
    """Where a reference is not believed to its end, the report says up to where, and that it is an estimate."""
    name = next(iter(results.references))
    short = replace(results, horizons={name: 0.5 * float(results.references[name].impacts["time_s"][0])})
    text = markdown(cross_check_document(short))
    assert "0 of 1 impacts" in text
    assert "a horizon is an estimate" in text


def test_no_velocity_error_is_no_share(results: Results) -> None:
    """Scenes in which every velocity is right have no share to be told."""
    grid = build_grid(results)
    scores = [cell.row.score for row in grid.rows for cell in row.cells if cell.row and cell.row.score]
    assert any(math.isnan(score.sampling_share) for score in scores)
