"""Reports that are rebuilt from results.jsonl."""

from pathlib import Path

import pytest
from tests.command import carom_command

from carom.execution.results import Results
from carom.report.document import Document, Media, Table
from carom.report.results_file.results_jsonl import format_records, read_records
from carom.studies.cross_check.document import cross_check_document, rebuild_document
from carom.studies.cross_check.grid import build_grid
from carom.studies.cross_check.sections import runs, scenes


@pytest.fixture
def folder(results: Results, tmp_path: Path) -> Path:
    """A folder with nothing but the records."""
    (tmp_path / "results.jsonl").write_text(format_records(results), encoding="utf-8")
    return tmp_path


def list_tables(document: Document) -> dict[str, list[list[list[str]]]]:
    """Return the lines of all tables of a page by the heading of their section, without the step in it."""
    return {
        section.heading.partition(", a")[0]: [
            [[cell.line for cell in row] for row in block.select_for(Media.PAGE)[1]]
            for block in section.select_for(Media.PAGE)
            if isinstance(block, Table)
        ]
        for section in document.select_for(Media.PAGE)
    }


def test_tables_from_records_equal_those_of_the_run(results: Results, folder: Path) -> None:
    """Each table that is rebuilt from results.jsonl, except the settings, equals that of the run."""
    run, rebuilt = cross_check_document(results), rebuild_document(*read_records(folder / "results.jsonl"))
    again = {heading: found for heading, found in list_tables(rebuilt).items() if found and heading != "Settings used"}
    assert again == {heading: list_tables(run)[heading] for heading in again}
    assert {"Every method against PIC", "Run time", "Error against step size", "All cells at all steps"} <= set(again)


def test_report_command_rebuilds_report_from_records(folder: Path) -> None:
    """`carom report` prints and writes the report from the records alone, and overwrites no file."""
    page = folder / "again.html"
    done = carom_command("report", folder, "--page", page, "--markdown", "-", columns=120)
    assert done.exit_code == 0
    assert done.output.startswith("# Carom cross-check, from its records")
    assert "rebuilt from results.jsonl, without states" in done.output
    assert "Every scene" in page.read_text(encoding="utf-8")
    again = carom_command("report", folder, "--page", page)
    assert again.exit_code == 2
    assert "already exists" in again.output
    assert "Every method" in carom_command("report", folder).output


def test_large_report_lists_only_the_worst_scenes_and_runs(results: Results, monkeypatch: pytest.MonkeyPatch) -> None:
    """Beyond a limit, the tables list only the scenes and runs with the worst grades, and the text reports this."""
    whole = build_grid(results)
    monkeypatch.setattr(runs, "MOST_CELLS", 2)
    monkeypatch.setattr(scenes, "MOST_SCENES", 1)
    few = list_tables(document := cross_check_document(results))
    ranks = [-1 if cell.rank is None else cell.rank for cell in whole.runs]
    second = sorted(ranks)[-2]
    (listed,) = few["All cells at all steps"]
    assert len(listed) == 2
    worst = [(cell.scene, cell.method.heading) for cell, rank in zip(whole.runs, ranks, strict=True) if rank >= second]
    assert {(row[0], row[1]) for row in listed} <= set(worst)
    assert [len(rows) for rows in few["Every scene on every engine"]] == [1]
    notes = {block.note for section in document.sections for block in section.blocks if isinstance(block, Table)}
    for shown, count in ((2, len(whole.runs)), (1, len(whole.rows))):
        assert f"{shown} of {count} rows are shown, those with the worst grades; results.jsonl has all." in notes
