"""`carom diff` as a user types it: where it writes, what it refuses, and how it ends."""

import json
import re
from pathlib import Path
from typing import Any

import pytest
from tests.cases import each
from tests.command import carom_command

ROOT = Path(__file__).resolve().parents[3]
SAMPLE = ROOT / "reports" / "sample" / "results.jsonl"

pytestmark = pytest.mark.skipif(not SAMPLE.exists(), reason="a source distribution has no reports")


@pytest.fixture(scope="module")
def sample(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Every thirtieth row of the sample report."""
    head, *rows = SAMPLE.read_text(encoding="utf-8").splitlines()
    kept = rows[::30]
    path = tmp_path_factory.mktemp("sample") / "results.jsonl"
    lines = (json.dumps({**json.loads(head), "rows": len(kept)}), *kept)
    path.write_text("".join(f"{line}\n" for line in lines), encoding="utf-8")
    return path


@pytest.fixture
def worse(sample: Path, tmp_path: Path) -> Path:
    """The same rows, of which one that was sampled is off by a thousandth more of the speed."""
    head, *rows = (json.loads(line) for line in sample.read_text(encoding="utf-8").splitlines())
    row: dict[str, Any] = next(row for row in rows if row["grade"] == "sampled" and row["total"]["velocity"])
    row["total"]["velocity"] += 1e-3
    path = tmp_path / "results.jsonl"
    path.write_text("".join(f"{json.dumps(line)}\n" for line in (head, *rows)), encoding="utf-8")
    return path


@pytest.mark.long
def test_a_grade_that_stays_good_enough_does_not_fail(sample: Path, worse: Path) -> None:
    """What got worse and is sampled still fails on *sampled*, and neither by default nor on *never*."""
    assert carom_command("diff", sample, worse).exit_code == 0
    assert carom_command("diff", sample.parent, worse.parent, "--fail-on", "sampled").exit_code == 1
    assert carom_command("diff", sample, worse, "--fail-on", "never").exit_code == 0
    assert carom_command("diff", worse, sample, "--fail-on", "sampled").exit_code == 0


def test_a_crash_is_worse_even_where_nothing_was_graded(worse: Path) -> None:
    """A cell that was not graded and now crashes got worse, though it has no place among the grades."""
    head, *rows = worse.read_text(encoding="utf-8").splitlines()
    ungraded = next(json.loads(row) for row in rows if json.loads(row)["grade"] == "ungraded")
    nothing = dict.fromkeys(("grade", "float_bits", "total", "missed", "spurious", "settings"))
    crashed = {**ungraded, **nothing, "status": "crashed", "reason": "ended by signal 11", "verdicts": []}
    first = json.dumps({**json.loads(head), "rows": 1})
    paths = worse.with_name("old.jsonl"), worse.with_name("new.jsonl")
    for path, row in zip(paths, (ungraded, crashed), strict=True):
        path.write_text(f"{first}\n{json.dumps(row)}\n", encoding="utf-8")
    done = carom_command("diff", *paths, "--markdown", "-")
    assert done.exit_code == 1, done.output
    assert "| worse not graded → crashed |  | ended by signal 11" in done.output
    assert carom_command("diff", *reversed(paths)).exit_code == 0


def test_markdown_and_page_are_written(sample: Path, worse: Path, tmp_path: Path) -> None:
    """Both files hold the sentence that sums it up, which the terminal shows as well."""
    files = tmp_path / "new" / "diff.md", tmp_path / "new" / "diff.html"
    done = carom_command("diff", sample, worse, "--markdown", files[0], "--page", files[1])
    for text in (done.output, *(file.read_text(encoding="utf-8") for file in files)):
        assert "1 worse; " in text


def test_markdown_to_a_pipe_is_that_alone(sample: Path, worse: Path) -> None:
    """With - the Markdown is all that is printed, so that it can be piped into a comment."""
    done = carom_command("diff", sample, worse, "--markdown", "-")
    assert done.output.startswith("# Carom diff: ")
    assert done.output.count("1 worse; ") == 1


def test_a_row_without_a_field_is_refused_by_its_line(sample: Path, worse: Path) -> None:
    """The line of the row is named, and the field that it lacks."""
    lines = worse.read_text(encoding="utf-8").splitlines()
    row = json.loads(lines[4])
    del row["missed"]
    worse.write_text("\n".join([*lines[:4], json.dumps(row), *lines[5:]]) + "\n", encoding="utf-8")
    done = carom_command("diff", sample, worse)
    assert done.exit_code == 2
    assert f"{worse}, line 5: " in done.output
    assert "'missed'" in done.output


def test_the_jobs_in_the_docs_are_at_most_ten_lines_that_call_carom() -> None:
    """The documented jobs run both commands; `tests/documents` holds that they are YAML with options that exist."""
    text = (ROOT / "docs" / "reference" / "diff.md").read_text(encoding="utf-8")
    blocks = re.findall(r"```yaml\n(.*?)```", text, re.DOTALL)
    assert [len(block.partition("    steps:\n")[2].splitlines()) <= 10 for block in blocks] == [True, True]
    assert set(re.findall(r"- run: carom (run|diff)\b", "".join(blocks))) == {"run", "diff"}


@each("option", ["--page", "--markdown"])
def test_what_is_no_comparison_is_not_replaced(sample: Path, tmp_path: Path, option: str) -> None:
    """A file of somebody's, and the very results, are refused and left as they are; an own one is replaced."""
    results, own = sample / "results.jsonl" if sample.is_dir() else sample, tmp_path / "own"
    other = tmp_path / "scene.toml"
    other.write_text("name = 'mine'")
    for path in (other, results):
        before = path.read_bytes()
        done = carom_command("diff", sample, sample, option, path)
        assert done.exit_code == 2
        assert option in done.output
        assert path.read_bytes() == before
    for _ in range(2):
        assert carom_command("diff", sample, sample, option, own).exit_code == 0, option
