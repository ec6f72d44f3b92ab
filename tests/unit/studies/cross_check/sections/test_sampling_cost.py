"""Sampling costs: each engine has a line with its error divided by PIT's and its error not from sampling."""

from collections.abc import Callable
from dataclasses import replace

from tests.scene_builders import require_value

from carom.comparator import compare
from carom.execution.results import Results, Row
from carom.model.trace import Trace
from carom.report.document import Media, Section, Table
from carom.studies.cross_check.document import cross_check_document
from carom.studies.cross_check.grid import build_grid
from carom.studies.cross_check.sections.sampling_cost import (
    build_sampling_cost_section,
    measure_engine_costs,
)


def rescore_toy(results: Results, rescore: Callable[[Row], Trace]) -> Results:
    """Return the results with another trace of the toy engine in each row that has a score."""
    pit = {(row.job.scene, row.job.dt_s): row.trace for row in results.rows if row.job.engine == "pit"}

    def change(row: Row) -> Row:
        if row.job.engine != "toy" or row.score is None:
            return row
        trace = rescore(row)
        reference, sampling = results.references[row.job.scene.name], pit[row.job.scene, row.job.dt_s]
        return replace(row, trace=trace, score=compare(reference, trace, sampling=sampling))

    return replace(results, rows=tuple(map(change, results.rows)))


def speed_up(trace: Trace, factor: float) -> Trace:
    """Return a trace with the first velocity after each impact made faster."""
    impacts = trace.impacts.copy()
    impacts["velocity_first_after"] *= factor
    return replace(trace, impacts=impacts)


def get_table(section: Section) -> Table:
    """The one table of a section."""
    (table,) = (block for block in section.blocks if isinstance(block, Table))
    return table


def build_section(results: Results) -> Section:
    return build_sampling_cost_section(build_grid(results))


def get_toy_row(results: Results) -> dict[str, str]:
    """Return the toy engine's row in the table of sampling costs, by heading."""
    columns, rows = get_table(build_section(results)).select_for(Media.PAGE)
    (row,) = (row for row in rows if row[0].text == "toy tuned")
    return {column.head: cell.line for column, cell in zip(columns, row, strict=True)}


def test_engine_equal_to_pit_has_no_error_not_from_sampling(results: Results) -> None:
    """An engine that equals PIT in all 3 scenes has PIT's error, and an error not from sampling of 0."""
    (toy,) = measure_engine_costs(build_grid(results))
    assert (toy.method.engine, len(toy.cells), toy.scenes_unlike_pit) == ("toy", 3, [])
    said = get_toy_row(results)
    own = said["velocity error not from sampling, median"]
    assert (said["equals PIT"], own, said["worse than PIT"]) == ("3 of 3", "0", "0 of 3")
    assert said["error / PIT's, median"].startswith("1 (")
    assert build_section(results).heading in {section.heading for section in cross_check_document(results).sections}


def test_added_velocity_error_is_the_engines_own(results: Results) -> None:
    """Velocities 10 % too fast in a scene give an error not from sampling above 0.01; the engine differs from PIT."""
    late = "paper/late"
    worse = rescore_toy(
        results, lambda row: speed_up(require_value(row.trace), 1.1 if row.job.scene.name == late else 1.0)
    )
    (toy,) = measure_engine_costs(build_grid(worse))
    (line,) = (require_value(cell.line) for cell in toy.cells if cell.scene == late)
    velocities = (require_value(line.against_pit).velocity, require_value(line.total).velocity)
    assert line.own_velocity == min(velocities) > 0.01
    assert toy.scenes_unlike_pit == [late]
    assert get_toy_row(worse)["equals PIT"] == "2 of 3"
