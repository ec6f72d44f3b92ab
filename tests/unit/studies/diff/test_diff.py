"""Comparison of two cross-checks: planted changes are reported with place and size, and nothing else."""

import json
from collections.abc import Callable
from dataclasses import replace
from importlib import resources
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
from tests.cases import each
from tests.command import carom_command, printed_text
from tests.planted.faults import DT, ROW, SPEED, replay_impacts
from tests.scene_builders import alter_impact

from carom import solve_pic, solve_pit
from carom.comparator import Grade, Score, compare
from carom.engines.registry import load_adapter
from carom.errors import InputError
from carom.execution.environment import Environment
from carom.execution.job import Job, Method, Status
from carom.execution.observation.engine_run import observe_run
from carom.execution.results import Results, Row
from carom.model.trace import Trace
from carom.report.render.markdown import render_markdown
from carom.report.results_file.line_codec import build_records_schema
from carom.report.results_file.results_jsonl import format_records
from carom.studies.diff.compare_records import Diff, Kind, compare_records
from carom.studies.diff.document import MOST_ROWS, build_diff_document

Engines = dict[str, Trace | Status]
Write = Callable[..., Path]

SAMPLE = Path(__file__).resolve().parents[4] / "reports" / "sample" / "results.jsonl"
REFERENCE = solve_pic(ROW)
PIT = solve_pit(ROW, frame_rate_hz=1 / DT)


def build_error(size: float, *, bits: int = 64, **settings: float) -> Trace:
    """The right run, except that the last disc leaves its impact with a transverse velocity, relative to the speed.

    By hand: that velocity, and the final one, are off by `size`, the energy by its square, and the instants by nothing.
    The place after the 0.75 s to the end, over the radius of 0.5 m, is off by 0.75 * 4 / 0.5 = 6 times as much.
    """
    impacts = REFERENCE.impacts.copy()
    impacts["velocity_second_after"][-1, 1] += size * SPEED
    return replace(replay_impacts(REFERENCE, impacts), float_bits=bits, settings=settings)


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Writes the records of a cross-check of one scene by engines, each a trace or why it was not run."""

    def write(name: str, engines: Engines, *, versions: dict[str, str] | None = None) -> Path:
        rows, scores = [], dict[int, Score]()
        for engine, ran in engines.items():
            job = Job(ROW, Method(engine, "tuned"), DT)
            if isinstance(ran, Status):
                rows.append(Row(job, ran, f"{engine} gave no answer"))
            else:
                if id(ran) not in scores:
                    scores[id(ran)] = compare(REFERENCE, ran, sampling=PIT)
                rows.append(Row(job, Status.RAN, trace=ran, score=scores[id(ran)]))
        here = Environment("2026-01-02T03:04:05+00:00", "0.1.0", "CPython 3.11", "Linux", "CPU", 2, versions or {})
        path = tmp_path / f"{name}.jsonl"
        results = Results(tuple(rows), {ROW.name: REFERENCE}, {}, (), here, "carom run", 1.0)
        path.write_text(format_records(results), encoding="utf-8")
        return path

    return write


def test_records_with_earlier_profile_names_of_pic_are_compared(write: Write, tmp_path: Path) -> None:
    """A file with the earlier name `tuned` of PIC's event-driven profile has the same cells and report."""
    new = write("new", {"pic": REFERENCE, "pit": PIT})
    assert '"profile":"event-driven"' in new.read_text()
    old = tmp_path / "results.jsonl"
    old.write_text(new.read_text().replace("event-driven", "tuned"))
    found = compare_records(old, new)
    assert (found.unchanged, found.changes) == (2, ())
    assert carom_command("report", old).output == carom_command("report", new).output


def get_only_change(found: Diff) -> Any:
    (change,) = found.changes
    return change


RIGHT, WRONG = build_error(0.0), build_error(1e-3)


def test_velocity_regression_of_one_engine_is_reported(write: Write) -> None:
    """An error of 0.1 % in one engine's velocity is the only change, with the numbers computed by hand."""
    old, new = write("old", {"mine": RIGHT, "other": RIGHT}), write("new", {"mine": WRONG, "other": RIGHT})
    found = compare_records(old, new)
    change = get_only_change(found)
    assert (change.kind, change.scene, change.method, change.dt_s) == (Kind.WORSE, "row", "mine tuned", DT)
    assert found.unchanged == 1
    shown = {measure.name: (measure.old, measure.new) for measure in change.measures}
    for name, size in (("velocity error", 1e-3), ("final velocity", 1e-3), ("final position", 6e-3)):
        assert list(shown[name]) == pytest.approx([0.0, size], rel=1e-9, abs=1e-12), name
    assert list(shown["energy error"]) == pytest.approx([0.0, 1e-6], rel=1e-6, abs=1e-12)
    assert "time error" not in shown
    assert "direction error" not in shown  # 0.06 degrees
    assert any(cause.startswith("velocities after an impact are wrong (by up to 0.001 ") for cause in change.causes)
    done = carom_command("diff", str(old), str(new))
    assert done.exit_code == 1, done.output
    for words in ("1 worse; 1 cell unchanged.", "Worst: row on mine tuned at 1/60 s, exact → ", "0.001"):
        assert words in printed_text(done)
    for grade in ("wrong", "never"):
        assert carom_command("diff", str(old), str(new), "--fail-on", grade).exit_code == 0


MISSING = replay_impacts(REFERENCE, REFERENCE.impacts[:-1].copy())
NAN = alter_impact(REFERENCE, -1, velocity_second_after=np.nan)


@each(
    "old, new, kind, number",
    [
        (WRONG, RIGHT, Kind.BETTER, ""),
        (build_error(0.021), build_error(0.02), Kind.BETTER, ""),
        (build_error(0.02), build_error(0.021), Kind.WORSE, "velocity error 0.02 → 0.021"),
        (RIGHT, build_error(1e-13), None, ""),  # rounding of 64 bits
        (RIGHT, build_error(1e-10), Kind.WORSE, ""),  # more than that
        (build_error(0.0, bits=32), build_error(1e-6, bits=32), None, ""),  # rounding of 32 bits
        (build_error(0.0, bits=32), build_error(1e-4, bits=32), Kind.WORSE, ""),  # more than that
        (RIGHT, build_error(1e-7, bits=32), Kind.WORSE, ""),  # compared at the 64 bits that it had
        (build_error(0.02), MISSING, Kind.WORSE, "impacts missed 0 → 1"),  # missed, which is worse than off
        (MISSING, build_error(0.5), Kind.BETTER, ""),  # far off, which is better than missed
        (build_error(0.02), NAN, Kind.WORSE, "a number is NaN or infinite: new"),
    ],
)
def test_changes_beyond_rounding_are_better_or_worse(
    write: Write, old: Trace, new: Trace, kind: Kind | None, number: str
) -> None:
    """Only a change beyond the rounding of the declared floats is better or worse; a miss is worse than any error."""
    paths = write("old", {"mine": old}), write("new", {"mine": new})
    found = compare_records(*paths)
    if kind is None:
        assert found.changes == ()
        return
    assert get_only_change(found).kind is kind
    assert number in "; ".join(str(measure) for measure in get_only_change(found).measures)
    if kind is Kind.BETTER:
        done = carom_command("diff", *map(str, paths), "--fail-on", "close")
        assert done.exit_code == 0, done.output


def test_change_with_better_and_worse_errors_is_mixed(write: Write) -> None:
    """If one error falls and another grows, the change is mixed, and `carom diff` exits with 1."""
    late = REFERENCE.impacts.copy()
    late["time_s"][-1] += 3 * DT  # later than checking once per step is: inaccurate, as the other
    old = write("old", {"mine": build_error(1e-2)})
    new = write("new", {"mine": replay_impacts(REFERENCE, late)})
    change = get_only_change(compare_records(old, new))
    assert change.kind is Kind.MIXED
    assert {measure.growth > 0 for measure in change.measures if measure.growth} == {True, False}
    assert carom_command("diff", str(old), str(new)).exit_code == 1


def test_diff_of_40_engines_fits_25_terminal_lines(write: Write) -> None:
    """Forty regressions take at most 25 lines, with a common setting once; `-v` prints a row for each engine."""
    worse = [build_error(1e-3 * (1 + k), depth=2.0) for k in range(7)]
    old = write("old", dict.fromkeys([f"engine-{k}" for k in range(40)], build_error(0.0, depth=1.0)))
    new = write("new", {f"engine-{k}": worse[k % 7] for k in range(40)})
    lines = carom_command("diff", str(old), str(new), columns=80).output.splitlines()
    assert lines[0].startswith("40 worse")
    assert len(lines) <= 25
    assert sum("depth" in line for line in lines) == 1
    full = carom_command("diff", str(old), str(new), "-v", columns=80).output
    assert all(f"engine-{k} " in full for k in range(40))


def test_vanished_new_crashed_and_recovered_cells_are_reported(write: Write) -> None:
    """Cells that crash, vanish, appear or recover are reported worst first; only the crash is a regression."""
    old = write("old", {"a": RIGHT, "b": RIGHT, "c": Status.CRASHED, "e": Status.UNSUPPORTED, "f": RIGHT})
    new = write("new", {"a": RIGHT, "b": Status.CRASHED, "c": RIGHT, "d": RIGHT, "e": Status.UNSUPPORTED})
    found = compare_records(old, new)
    kinds = {change.method: change.kind for change in found.changes}
    assert list(kinds.items()) == [  # the worst first
        ("b tuned", Kind.WORSE),
        ("f tuned", Kind.VANISHED),
        ("d tuned", Kind.APPEARED),
        ("c tuned", Kind.BETTER),
    ]
    assert [change.method for change in found.changes if change.is_regression_to(Grade.WRONG)] == ["b tuned"]
    assert "b gave no answer" in found.changes[0].causes


def test_causes_include_changed_settings_and_versions(write: Write) -> None:
    """The causes include changed settings and the engine's version; other versions are listed separately."""
    old = write("old", {"mine": build_error(0.0, iterations=10.0)}, versions={"Mine": "1.0", "numpy": "2.0"})
    new = write("new", {"mine": build_error(1e-3, iterations=20.0)}, versions={"Mine": "1.1", "numpy": "2.1"})
    found = compare_records(old, new)
    assert {"settings: iterations 10.0 → 20.0", "version: Mine 1.0 → 1.1"} <= {*get_only_change(found).causes}
    assert found.environment_changes == ("Mine 1.0 → 1.1", "numpy 2.0 → 2.1")


def test_engines_with_different_names_can_be_compared(write: Write) -> None:
    """Two files of one method each are compared directly; otherwise a known pair has to be named."""
    one, other = write("one", {"a": RIGHT}), write("other", {"b": WRONG})
    old, new = write("old", {"a": RIGHT, "x": RIGHT}), write("new", {"b": WRONG, "x": WRONG})
    old_again = write("again", {"a": RIGHT, "b": WRONG, "c": WRONG})
    for found, method in (
        (compare_records(one, other), "a tuned → b tuned"),
        (compare_records(old, new, [("a", "b")]), "a tuned → b tuned"),
        (compare_records(old, new, [("x/tuned", "b/tuned")]), "x tuned → b tuned"),
        (compare_records(old, old_again, [("a", "a"), ("x", "b")]), "x tuned → b tuned"),
    ):
        assert get_only_change(found).method == method
    with pytest.raises(InputError, match="has no engine or method 'c'; it has a/tuned and x/tuned"):
        compare_records(old, new, [("c", "b")])


def test_diff_without_common_cells_is_refused(write: Write) -> None:
    """Two files without a common run are refused instead of reported as unchanged."""
    with pytest.raises(InputError, match="have no run in common"):
        compare_records(write("old", {"a": RIGHT, "b": RIGHT}), write("new", {"c": RIGHT, "d": RIGHT}))
    with pytest.raises(InputError, match="or an engine was not available"):
        compare_records(write("old", {"a": RIGHT}), write("new", {"a": Status.UNAVAILABLE}))


@pytest.mark.long
def test_markdown_of_a_diff_states_omissions(write: Write) -> None:
    """Markdown states the number of omitted rows."""
    names = [f"engine-{k}" for k in range(MOST_ROWS + 2)]
    found = compare_records(write("old", dict.fromkeys(names, RIGHT)), write("new", dict.fromkeys(names, WRONG)))
    assert "2 more changes are not shown" in render_markdown(build_diff_document(found, "old", "new"))


def test_published_records_schema_is_generated_from_code() -> None:
    """The published JSON schema equals the one that the code generates, and is valid."""
    published = resources.files("carom").joinpath("results.schema.json").read_text(encoding="utf-8")
    assert published == json.dumps(build_records_schema(), indent=2, sort_keys=True, allow_nan=False) + "\n"
    jsonschema.Draft202012Validator.check_schema(build_records_schema())


def test_schema_names_exactly_the_written_fields(results: Results) -> None:
    """The first line and each row of results.jsonl have exactly the fields of the schema."""
    parts = build_records_schema()["$defs"]
    for k, line in enumerate(map(json.loads, format_records(results).splitlines())):
        assert set(line) == set(parts["RowLine" if k else "Summary"]["properties"])


def test_crash_of_an_ungraded_cell_is_worse(write: Write) -> None:
    """A cell that was not graded and now crashes is worse and gives exit code 1; the reverse gives 0."""
    old, new = write("old", {"a": RIGHT}), write("new", {"a": Status.CRASHED})
    old.write_text(old.read_text().replace('"grade":"exact"', '"grade":"ungraded"'))
    done = carom_command("diff", old, new, "--markdown", "-")
    assert done.exit_code == 1, done.output
    assert "| worse not graded → crashed |  | a gave no answer" in done.output
    assert carom_command("diff", new, old).exit_code == 0


def test_diff_writes_markdown_and_page(write: Write, tmp_path: Path) -> None:
    """`--markdown` and `--page` write the summary into files of a new folder; `--markdown -` prints only Markdown."""
    old, new = write("old", {"a": RIGHT}), write("new", {"a": WRONG})
    files = tmp_path / "folder" / "diff.md", tmp_path / "folder" / "diff.html"
    done = carom_command("diff", old, new, "--markdown", files[0], "--page", files[1])
    for text in (done.output, *(file.read_text(encoding="utf-8") for file in files)):
        assert "1 worse; " in text
    assert carom_command("diff", old, new, "--markdown", "-").output == files[0].read_text(encoding="utf-8")


@each("option", ["--page", "--markdown"])
def test_diff_does_not_overwrite_other_files(write: Write, tmp_path: Path, option: str) -> None:
    """`--page` and `--markdown` overwrite no compared results and foreign files, but Carom's own comparisons."""
    results, other = write("results", {"a": RIGHT}), tmp_path / "scene.toml"
    other.write_text("name = 'mine'")
    for path in (other, results):
        before = path.read_bytes()
        done = carom_command("diff", results, results, option, path)
        assert (done.exit_code, option in done.output) == (2, True)
        assert path.read_bytes() == before
    for _ in range(2):
        assert carom_command("diff", results, results, option, tmp_path / "own").exit_code == 0, option


def test_row_without_a_field_is_refused_with_its_line(write: Write) -> None:
    """The error message names the file, the line of the row and the missing field."""
    path = write("results", {"a": RIGHT, "b": RIGHT})
    path.write_text('"lacked":'.join(path.read_text().rsplit('"missed":', 1)))
    done = carom_command("diff", path, path)
    assert done.exit_code == 2
    assert f"{path}, line 3: " in done.output
    assert "'missed'" in done.output


def edit_row(path: Path, **fields: Any) -> Path:
    """Replace fields of a file's only row. A dictionary replaces only some of a field's items."""
    head, line = path.read_text().splitlines()
    row = json.loads(line)
    for name, value in fields.items():
        row[name] = {**row[name], **value} if isinstance(value, dict) else value
    path.write_text(f"{head}\n{json.dumps(row)}\n")
    return path


COMPARED = ("time_s", "velocity", "spin", "direction_rad", "energy", "final_position", "final_velocity", "final_spin")


@each("metric", COMPARED)
def test_larger_error_of_each_metric_is_worse(write: Write, metric: str) -> None:
    """A run is worse if only one of its errors is larger, for example that of a spin."""
    old, new = (edit_row(write(f"{size}", {"mine": WRONG}), total={metric: size}) for size in (0.1, 0.5))
    change = get_only_change(compare_records(old, new))
    assert (change.kind, len(change.measures)) == (Kind.WORSE, 1)


def test_diverged_runs_are_compared_by_single_steps(write: Write) -> None:
    """After a trajectory has diverged, a diff compares the missed impacts of single steps."""
    trace = observe_run(load_adapter("pit"), ROW, "tuned", DT)
    old, new = (
        edit_row(write(f"{missed}", {"pit": trace}), diverged_s=0.25, local_truth={"missed": missed})
        for missed in (1, 3)
    )
    assert "impacts missed 1 → 3" in [str(measure) for measure in get_only_change(compare_records(old, new)).measures]
