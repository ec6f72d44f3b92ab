"""What a diff must say of two cross-checks: what was planted between them, where and how large, and nothing else."""

import json
from collections.abc import Callable
from dataclasses import replace
from importlib import resources
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
from tests.cases import each, release_after
from tests.command import carom_command, told
from tests.planted.faults import DT, ROW, SPEED, replayed
from tests.scene_builders import sure
from tests.unit.report.test_terminal import printed

from carom import solve_pic, solve_pit
from carom.catalogue import find_scenes
from carom.comparator import Grade, compare
from carom.comparator.compare import Score
from carom.errors import InputError
from carom.execution.environment import Environment
from carom.execution.job import Job, Method, Status
from carom.execution.results import Results, Row
from carom.model.trace import Trace
from carom.report.outcome_marks import Mark
from carom.report.render.html import render_html
from carom.report.render.markdown import render_markdown
from carom.report.results_file.json_lines import build_records_schema
from carom.report.results_file.records import format_records
from carom.studies.diff.compare_records import Diff, Kind, compare_records
from carom.studies.diff.document import MOST_ROWS, build_diff_document

Engines = dict[str, Trace | Status]
Write = Callable[..., Path]

SAMPLE = Path(__file__).resolve().parents[4] / "reports" / "sample" / "results.jsonl"
REFERENCE = solve_pic(ROW)
PIT = solve_pit(ROW, frame_rate_hz=1 / DT)


def sideways(size: float, *, bits: int = 64, **settings: float) -> Trace:
    """The right run, except that the last disc leaves its impact with a transverse velocity, relative to the speed.

    By hand: that velocity, and the final one, are off by `size`, the energy by its square, and the instants by nothing.
    The place after the 0.75 s to the end, over the radius of 0.5 m, is off by 0.75 * 4 / 0.5 = 6 times as much.
    """
    impacts = REFERENCE.impacts.copy()
    impacts["velocity_second_after"][-1, 1] += size * SPEED
    return replace(replayed(REFERENCE, impacts), float_bits=bits, settings=settings)


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


def test_results_with_the_earlier_names_of_pics_forms_are_compared(write: Write, tmp_path: Path) -> None:
    """A file that calls PIC's event-driven form `tuned` has the same cells as one that calls it by its name."""
    new = write("new", {"pic": REFERENCE, "pit": PIT})
    assert '"profile":"event-driven"' in new.read_text()
    old = tmp_path / "results.jsonl"
    old.write_text(new.read_text().replace("event-driven", "tuned"))
    found = compare_records(old, new)
    assert (found.unchanged, found.changes) == (2, ())
    assert carom_command("report", old).output == carom_command("report", new).output


def only(found: Diff) -> Any:
    (change,) = found.changes
    return change


def numbers(found: Diff) -> dict[str, tuple[float, float]]:
    """Before and after by the name of the number."""
    return {measure.name: (measure.old, measure.new) for measure in only(found).measures}


def test_a_regression_of_a_thousandth_in_one_engines_velocities_is_found_and_named(write: Write) -> None:
    """It is the one change, with scene, engine and the numbers that follow by hand; the command ends with 1."""
    old = write("old", {"mine": sideways(0.0), "other": sideways(0.0)})
    new = write("new", {"mine": sideways(1e-3), "other": sideways(0.0)})
    found = compare_records(old, new)
    change = only(found)
    assert (change.kind, change.scene, change.method, change.dt_s) == (Kind.WORSE, "row", "mine tuned", DT)
    assert found.unchanged == 1
    shown = numbers(found)
    for name, size in (("velocity error", 1e-3), ("final velocity", 1e-3), ("final position", 6e-3)):
        assert list(shown[name]) == pytest.approx([0.0, size], rel=1e-9, abs=1e-12), name
    assert list(shown["energy error"]) == pytest.approx([0.0, 1e-6], rel=1e-6, abs=1e-12)
    assert "time error" not in shown
    assert "direction error" not in shown  # 0.06 degrees
    assert any(cause.startswith("velocities after an impact are wrong (by up to 0.001 ") for cause in change.causes)
    done = carom_command("diff", str(old), str(new))
    assert done.exit_code == 1, done.output
    for words in ("1 worse; 1 cell unchanged.", "Worst: row on mine tuned at 1/60 s, exact → ", "0.001"):
        assert words in told(done)


def test_the_same_regression_is_found_between_runs_that_had_errors_before(write: Write) -> None:
    """From 0.02 to 0.021 the grade stays, the number tells, and both numbers are written apart."""
    found = compare_records(write("old", {"mine": sideways(0.02)}), write("new", {"mine": sideways(0.021)}))
    change = only(found)
    assert change.kind is Kind.WORSE
    assert change.old is change.new
    assert "velocity error 0.02 → 0.021" in [str(measure) for measure in change.measures]
    assert change.is_regression_to(Grade[change.new.name])
    assert not change.is_regression_to(Grade.WRONG)


def broken() -> Trace:
    """The right run, but that its last velocity is no number."""
    impacts = REFERENCE.impacts.copy()
    impacts["velocity_second_after"][-1] = np.nan
    return replace(REFERENCE, impacts=impacts)


MISSING = replayed(REFERENCE, REFERENCE.impacts[:-1].copy())


@each(
    "old, new, kind, number",
    [
        pytest.param(sideways(1e-3), sideways(0.0), Kind.BETTER, "", id="better than a little off"),
        pytest.param(sideways(0.021), sideways(0.02), Kind.BETTER, "", id="better than further off"),
        pytest.param(sideways(0.0), sideways(1e-13), None, "", id="rounding of 64 bits"),
        pytest.param(sideways(0.0), sideways(1e-10), Kind.WORSE, "", id="no rounding of 64 bits"),
        pytest.param(sideways(0.0, bits=32), sideways(1e-6, bits=32), None, "", id="rounding of 32 bits"),
        pytest.param(sideways(0.0, bits=32), sideways(1e-4, bits=32), Kind.WORSE, "", id="no rounding of 32 bits"),
        pytest.param(sideways(0.0), sideways(1e-7, bits=32), Kind.WORSE, "", id="compared at the 64 bits that it had"),
        pytest.param(sideways(0.02), MISSING, Kind.WORSE, "impacts missed 0 → 1", id="missed, which is worse than off"),
        pytest.param(MISSING, sideways(0.5), Kind.BETTER, "", id="far off, which is better than missed"),
        pytest.param(sideways(0.02), broken(), Kind.WORSE, "a number is NaN or infinite: new", id="not finite"),
    ],
)
def test_a_change_is_of_a_kind(write: Write, old: Trace, new: Trace, kind: Kind | None, number: str) -> None:
    """A change beyond the rounding of the declared floats is better or worse; a better result is no violation."""
    paths = write("old", {"mine": old}), write("new", {"mine": new})
    found = compare_records(*paths)
    if kind is None:
        assert found.changes == ()
        return
    assert only(found).kind is kind
    assert number in "; ".join(str(measure) for measure in only(found).measures)
    if kind is Kind.BETTER:
        done = carom_command("diff", *map(str, paths), "--fail-on", "close")
        assert done.exit_code == 0, done.output


def test_a_spin_that_is_worse_is_worse(write: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    """If two inaccurate runs turn a disc wrongly, the one with the larger error is worse."""
    scene = find_scenes(["spin/slide"])[0].scene
    right, pit = solve_pic(scene), solve_pit(scene, frame_rate_hz=1 / DT)

    def turned(by: float) -> Trace:
        spins = sure(right.spins).copy()
        spins["first_after"][-1] += by
        return replace(right, spins=spins, final_spin_rad_s=sure(right.final_spin_rad_s) + by, dt_s=DT)

    monkeypatch.setattr(f"{__name__}.REFERENCE", right)
    monkeypatch.setattr(f"{__name__}.PIT", pit)
    monkeypatch.setattr(f"{__name__}.ROW", scene)
    change = only(compare_records(write("old", {"mine": turned(0.1)}), write("new", {"mine": turned(0.5)})))
    assert (change.kind, change.old, change.new) == (Kind.WORSE, Mark.INACCURATE, Mark.INACCURATE)
    assert {"spin error", "final spin"} <= {measure.name for measure in change.measures}
    assert compare_records(write("a", {"mine": turned(0.1)}), write("b", {"mine": turned(0.1)})).changes == ()


def test_a_run_against_itself_has_no_change(results: Results, tmp_path: Path) -> None:
    """Every cell of a whole cross-check is as it was: that is said, and nothing else."""
    path = tmp_path / "results.jsonl"
    path.write_text(format_records(results), encoding="utf-8")
    found = compare_records(tmp_path, path)
    assert (found.changes, found.around) == ((), ())
    done = carom_command("diff", str(tmp_path), str(path))
    assert done.exit_code == 0
    assert done.output.startswith("No change: ")
    assert len(done.output.splitlines()) == 1


def test_an_error_that_falls_while_another_grows_is_mixed_and_violates(write: Write) -> None:
    """Off across the path in one run and in time in the other, it got better and worse at once; the exit code is 1."""
    late = REFERENCE.impacts.copy()
    late["time_s"][-1] += 3 * DT  # later than checking once per step is: inaccurate, as the other
    old, new = write("old", {"mine": sideways(1e-2)}), write("new", {"mine": replayed(REFERENCE, late)})
    change = only(compare_records(old, new))
    assert change.kind is Kind.MIXED
    signs = {measure.growth > 0 for measure in change.measures if measure.growth}
    assert signs == {True, False}
    assert carom_command("diff", str(old), str(new)).exit_code == 1


def test_a_terminal_has_the_answer_in_25_lines_of_80_columns_and_more_is_asked_for(write: Write) -> None:
    """Forty engines that got worse are grouped, the settings that changed are said once; -v has a row a cell."""
    right, worse = sideways(0.0, depth=1.0), [sideways(1e-3 * (1 + k), depth=2.0) for k in range(7)]
    old = write("old", {f"engine-{k}": right for k in range(40)})
    new = write("new", {f"engine-{k}": worse[k % 7] for k in range(40)})
    lines = carom_command("diff", str(old), str(new), columns=80).output.splitlines()
    assert lines[0].startswith("40 worse")
    assert len(lines) <= 25
    assert sum("depth" in line for line in lines) == 1
    full = carom_command("diff", str(old), str(new), "-v", columns=80).output
    assert all(f"engine-{k} " in full for k in range(40))


@pytest.mark.long
@pytest.mark.skipif(not SAMPLE.exists(), reason="a source distribution has no reports")
@each(
    "old, new",
    release_after(
        1,
        [
            ("mujoco/default", "mujoco/tuned"),
            ("mujoco/tuned", "mujoco/default"),
            ("pymunk/default", "mujoco/tuned"),
            ("box2d/default", "pybullet/tuned"),
        ],
    ),
)
def test_profiles_of_the_sample_compared_fit_25_lines_on_a_terminal(old: str, new: str) -> None:
    """For whole suites, too, 80 columns show the answer in 25 lines, and a row shows the number behind the change."""
    found = compare_records(SAMPLE, SAMPLE, [(old, new)])
    lines = printed(build_diff_document(found, "old", "new"), 80)
    assert len(lines) <= 25, "\n".join(lines)
    assert max(map(len, lines)) <= 80
    for change in found.changes:
        way = -1.0 if change.kind is Kind.BETTER else 1.0
        if any(way * one.growth > 0 for one in change.measures):
            assert way * sure(change.telling).growth > 0, str(sure(change.telling))


def test_several_pairs_of_engines_are_compared_at_once(write: Write) -> None:
    """Each -e is a pair of its own, and what is in none is left out."""
    old = write("old", {"a": sideways(0.0), "b": sideways(0.0), "c": sideways(0.0)})
    new = write("new", {"d": sideways(0.0), "e": sideways(1e-3), "f": sideways(1e-3)})
    found = compare_records(old, new, [("a", "d"), ("b", "e")])
    assert only(found).method == "b tuned → e tuned"
    assert found.unchanged == 1
    done = carom_command("diff", str(old), str(new), "-e", "a=d", "-e", "b=e")
    assert (done.exit_code, "1 worse; 1 cell unchanged." in done.output) == (1, True), done.output


def test_what_vanishes_appears_crashes_and_recovers_is_told(write: Write) -> None:
    """A cell without an answer any more is worse, and violates; one that was not there is neither better nor worse."""
    right = sideways(0.0)
    old = write("old", {"a": right, "b": right, "c": Status.CRASHED, "e": Status.UNSUPPORTED, "f": right})
    new = write("new", {"a": right, "b": Status.CRASHED, "c": right, "d": right, "e": Status.UNSUPPORTED})
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


def test_causes_name_settings_and_versions(write: Write) -> None:
    """A changed setting, and a changed version of the engine, are next to their possible effects."""
    old = write("old", {"mine": sideways(0.0, iterations=10.0)}, versions={"Mine": "1.0", "numpy": "2.0"})
    new = write("new", {"mine": sideways(1e-3, iterations=20.0)}, versions={"Mine": "1.1", "numpy": "2.1"})
    found = compare_records(old, new)
    assert "settings: iterations 10.0 → 20.0" in only(found).causes
    assert "version: Mine 1.0 → 1.1" in only(found).causes
    assert found.around == ("Mine 1.0 → 1.1", "numpy 2.0 → 2.1")


def test_engines_of_other_names_are_matched(write: Write) -> None:
    """If both runs have one method these are compared with each other, otherwise those that are named."""
    right, wrong = sideways(0.0), sideways(1e-3)
    assert only(compare_records(write("old", {"a": right}), write("new", {"b": wrong}))).method == "a tuned → b tuned"
    old, new = write("old", {"a": right, "x": right}), write("new", {"b": wrong, "x": wrong})
    assert only(compare_records(old, new, [("a", "b")])).method == "a tuned → b tuned"
    assert only(compare_records(old, new, [("x/tuned", "b/tuned")])).method == "x tuned → b tuned"
    with pytest.raises(InputError, match="has no engine or method 'c'; it has a/tuned and x/tuned"):
        compare_records(old, new, [("c", "b")])


def test_runs_without_a_common_cell_are_refused(write: Write) -> None:
    """Two runs that have no cell in common, as where an engine is not installed, must not pass for no change."""
    right = sideways(0.0)
    with pytest.raises(InputError, match="have no run in common"):
        compare_records(write("old", {"a": right, "b": right}), write("new", {"c": right, "d": right}))
    with pytest.raises(InputError, match="or an engine was not available"):
        compare_records(write("old", {"a": right}), write("new", {"a": Status.UNAVAILABLE}))


@pytest.mark.long
def test_every_medium_shows_the_change_and_escapes_names(write: Write) -> None:
    """Markdown and page begin with the sum; a name is text in both; what is too much for one is on the other."""
    engines: Engines = {f"<b>{k}|": sideways(0.0) for k in range(MOST_ROWS + 2)}
    found = compare_records(write("old", engines), write("new", {name: sideways(1e-3) for name in engines}))
    document = build_diff_document(found, "old", "new")
    text, page = render_markdown(document), render_html(document)
    assert text.startswith(f"# Carom diff: old → new\n\n{MOST_ROWS + 2} worse; 0 cells unchanged.")
    assert "2 more are not shown" in text
    assert "<b>" not in text.replace("\\<", "")
    assert page.count("&lt;b&gt;") >= MOST_ROWS + 2
    assert "<b>0" not in page


def test_the_published_schema_is_the_one_of_the_code() -> None:
    """The file that is published equals what the code generates, and is a valid schema in strict JSON."""
    published = resources.files("carom").joinpath("results.schema.json").read_text(encoding="utf-8")
    assert published == json.dumps(build_records_schema(), indent=2, sort_keys=True, allow_nan=False) + "\n"
    jsonschema.Draft202012Validator.check_schema(build_records_schema())


@pytest.mark.long
def test_the_schema_holds_for_what_is_written_and_for_no_less(results: Results) -> None:
    """Each line of a cross-check keeps to the schema; one without a field, or of another format, does not."""
    check = jsonschema.Draft202012Validator(build_records_schema())
    lines = [json.loads(line) for line in format_records(results).splitlines()]
    for line in lines:
        check.validate(line)
        for name in line:
            assert not check.is_valid({key: value for key, value in line.items() if key != name}), name
    head, row = lines[0], next(line for line in lines[1:] if line["total"])
    assert not check.is_valid({**head, "format": head["format"] + 1})
    assert not check.is_valid({**row, "dt_s": None})
    assert not check.is_valid({**row, "total": {**row["total"], "velocity": "NaN"}})
    assert not check.is_valid({**row, "grade": "good"})


def test_the_schema_knows_every_field_that_is_written(results: Results) -> None:
    """No line has a field that the schema does not name."""
    parts = build_records_schema()["$defs"]
    for k, line in enumerate(map(json.loads, format_records(results).splitlines())):
        assert set(line) == set(parts["RowLine" if k else "Summary"]["properties"])
