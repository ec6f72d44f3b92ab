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
def sample_results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Every thirtieth row of the sample report."""
    head, *rows = SAMPLE.read_text(encoding="utf-8").splitlines()
    kept = rows[::30]
    path = tmp_path_factory.mktemp("sample") / "results.jsonl"
    lines = (json.dumps({**json.loads(head), "rows": len(kept)}), *kept)
    path.write_text("".join(f"{line}\n" for line in lines), encoding="utf-8")
    return path


@pytest.fixture
def worse_results(sample_results: Path, tmp_path: Path) -> Path:
    """The same rows, of which one that was sampled is off by a thousandth more of the speed."""
    head, *rows = (json.loads(line) for line in sample_results.read_text(encoding="utf-8").splitlines())
    row: dict[str, Any] = next(row for row in rows if row["grade"] == "sampled" and row["total"]["velocity"])
    row["total"]["velocity"] += 1e-3
    path = tmp_path / "results.jsonl"
    path.write_text("".join(f"{json.dumps(line)}\n" for line in (head, *rows)), encoding="utf-8")
    return path


def test_crash_of_an_ungraded_cell_is_worse(worse_results: Path) -> None:
    """A cell that was not graded and now crashes is worse and gives exit code 1; the reverse gives 0."""
    head, *rows = worse_results.read_text(encoding="utf-8").splitlines()
    ungraded = next(json.loads(row) for row in rows if json.loads(row)["grade"] == "ungraded")
    nothing = dict.fromkeys(("grade", "float_bits", "total", "missed", "spurious", "settings"))
    crashed = {**ungraded, **nothing, "status": "crashed", "reason": "ended by signal 11", "verdicts": []}
    first = json.dumps({**json.loads(head), "rows": 1})
    paths = worse_results.with_name("old.jsonl"), worse_results.with_name("new.jsonl")
    for path, row in zip(paths, (ungraded, crashed), strict=True):
        path.write_text(f"{first}\n{json.dumps(row)}\n", encoding="utf-8")
    done = carom_command("diff", *paths, "--markdown", "-")
    assert done.exit_code == 1, done.output
    assert "| worse not graded → crashed |  | ended by signal 11" in done.output
    assert carom_command("diff", *reversed(paths)).exit_code == 0


def test_diff_writes_markdown_and_page(sample_results: Path, worse_results: Path, tmp_path: Path) -> None:
    """`--markdown` and `--page` write the summary into files of a new folder; `--markdown -` prints only Markdown."""
    files = tmp_path / "new" / "diff.md", tmp_path / "new" / "diff.html"
    done = carom_command("diff", sample_results, worse_results, "--markdown", files[0], "--page", files[1])
    for text in (done.output, *(file.read_text(encoding="utf-8") for file in files)):
        assert "1 worse; " in text
    printed = carom_command("diff", sample_results, worse_results, "--markdown", "-").output
    assert printed == files[0].read_text(encoding="utf-8")


def test_row_without_a_field_is_refused_with_its_line(sample_results: Path, worse_results: Path) -> None:
    """The error message names the file, the line of the row and the missing field."""
    lines = worse_results.read_text(encoding="utf-8").splitlines()
    row = json.loads(lines[4])
    del row["missed"]
    worse_results.write_text("\n".join([*lines[:4], json.dumps(row), *lines[5:]]) + "\n", encoding="utf-8")
    done = carom_command("diff", sample_results, worse_results)
    assert done.exit_code == 2
    assert f"{worse_results}, line 5: " in done.output
    assert "'missed'" in done.output


@each("option", ["--page", "--markdown"])
def test_diff_does_not_overwrite_other_files(sample_results: Path, tmp_path: Path, option: str) -> None:
    """`--page` and `--markdown` overwrite no compared results and foreign files, but Carom's own comparisons."""
    results, own = sample_results / "results.jsonl" if sample_results.is_dir() else sample_results, tmp_path / "own"
    other = tmp_path / "scene.toml"
    other.write_text("name = 'mine'")
    for path in (other, results):
        before = path.read_bytes()
        done = carom_command("diff", sample_results, sample_results, option, path)
        assert done.exit_code == 2
        assert option in done.output
        assert path.read_bytes() == before
    for _ in range(2):
        assert carom_command("diff", sample_results, sample_results, option, own).exit_code == 0, option


def test_documented_job_uses_declared_inputs_of_the_action() -> None:
    """The job in docs/reference/diff.md uses Carom's action with inputs that action.yml declares."""
    text = (ROOT / "docs" / "reference" / "diff.md").read_text(encoding="utf-8")
    used = re.findall(r"(\w+): ", text.partition("- uses: ./.github/actions/carom\n")[2].partition("```")[0])
    declared = re.findall(r"^  (\w+):$", (ROOT / "action.yml").read_text(encoding="utf-8"), re.MULTILINE)
    assert {"engine", "releases", "records"} <= set(used) & set(declared)
