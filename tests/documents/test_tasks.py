"""How-to pages, navigation, notebook, changelog and README."""

import base64
import hashlib
import json
import re
import shutil
from html import unescape
from pathlib import Path
from typing import Any

import pytest
import yaml
from docs.figures import readme
from docs.figures.changelog import assemble
from tests.cases import each
from tests.documents.code_blocks import PAGES, ROOT

import carom

TASKS = sorted(path.stem for path in (ROOT / "docs" / "how-to").glob("*.md"))


@each("task", TASKS)
def test_how_to_pages_are_short_and_start_with_a_command(task: str) -> None:
    """A how-to page has at most 400 words without code, and starts with a block of commands."""
    text = (ROOT / "docs" / "how-to" / f"{task}.md").read_text(encoding="utf-8")
    assert len(re.sub(r"(?s)```.*?```", "", text).split()) <= 400
    assert re.match(r"# .+\n\n(<!-- not run: .+ -->\n)?```sh\n", text)


def test_gallery_replays_scenes_where_pit_has_findings() -> None:
    """Each of at least five gallery replays is of a catalogue scene in which PIT differs from PIC."""
    text = (ROOT / "docs" / "gallery.md").read_text(encoding="utf-8")
    found = re.findall(r"<!-- replay: (\S+)(?: (\d+))? -->", text)
    assert len(found) == text.count("<!--") >= 5
    for name, rate in found:
        score = carom.compare(carom.solve_pic(name), carom.solve_pit(name, frame_rate_hz=float(rate) if rate else None))
        assert score.findings, name


def test_navigation_has_every_page_once() -> None:
    """Every page is in one part of the navigation; the contributors' part has exactly their pages."""
    # Tags of Python are for extensions; what is asked for here is the navigation.
    nav = yaml.safe_load("nav:" + (ROOT / "mkdocs.yml").read_text(encoding="utf-8").partition("\nnav:")[2])["nav"]
    parts = {name: part for one in nav for name, part in one.items()}

    def pages(part: object) -> list[str]:
        if isinstance(part, str):
            return [part]
        if isinstance(part, dict):
            return [page for one in part.values() for page in pages(one)]
        return [page for one in part for page in pages(one)] if isinstance(part, list) else []

    own = {"releasing.md", "reliability.md", "architecture.md", "decisions/README.md"}
    assert {"contributing.md", *(f"contributing/{page}" for page in own)} == set(pages(parts["Contributing"]))
    everything = [page for part in parts.values() for page in pages(part)]
    assert len(everything) == len(set(everything))
    texts = {path.relative_to(ROOT / "docs").as_posix() for path in PAGES if path.is_relative_to(ROOT / "docs")}
    assert {page for page in texts if not page.startswith("contributing/decisions/0")} <= set(everything)


NOTEBOOK = ROOT / "docs" / "tutorial.ipynb"
CELLS = json.loads(NOTEBOOK.read_text(encoding="utf-8"))["cells"]
CODE = [cell for cell in CELLS if cell["cell_type"] == "code"]


def list_replays(cell: Any) -> list[str]:
    """The frames that a cell shows, whole: a replay has nothing in it of the machine that made it."""
    shown = [output.get("data", {}).get("text/html", "") for output in cell.get("outputs", [])]
    return [html for html in shown if html.startswith("<iframe")]


@pytest.mark.long
def test_notebook_cells_reproduce_their_stored_output() -> None:
    """Run again in an empty folder, each notebook cell shows the same text, replay and kinds of output."""
    from docs.figures.tutorial import executed, read, texts

    for kept, run in zip(read().cells, executed().cells, strict=True):
        kinds = [[sorted(out.get("data", ())) for out in cell.get("outputs", [])] for cell in (kept, run)]
        assert kinds[0] == kinds[1], kept.source
        assert (texts(run), list_replays(run)) == (texts(kept), list_replays(kept)), kept.source


def test_stored_notebook_is_complete_and_free_of_local_paths() -> None:
    """All cells were run in order with their outputs, without errors and local paths, below 1 MB."""
    assert [cell["execution_count"] for cell in CODE] == list(range(1, len(CODE) + 1))
    kinds = {kind for cell in CODE for output in cell["outputs"] for kind in output.get("data", ())}
    assert {"text/plain", "text/html", "image/png"} <= kinds
    assert not [output for cell in CODE for output in cell["outputs"] if output["output_type"] == "error"]
    shown = json.dumps([cell["outputs"] for cell in CODE])
    assert "<iframe" in shown
    assert not re.search(r"/(home|root|tmp|work|Users)/", shown)
    assert NOTEBOOK.stat().st_size < 1_000_000


CHANGELOG = "# Changelog\n\n## 0.2.0 (unreleased)\n\n- Older.\n\n## 0.1.0\n\n- First.\n"


def test_changelog_fragments_are_inserted_and_deleted(tmp_path: Path) -> None:
    """Fragments are inserted by name above the newest section's text and deleted; a second run changes nothing."""
    log = tmp_path / "CHANGELOG.md"
    log.write_text(CHANGELOG)
    fragments = tmp_path / "fragments"
    fragments.mkdir()
    for name, text in (("b", "- Second\n  line.\n"), ("a", "- One.\n"), ("README", "no list\n")):
        (fragments / f"{name}.md").write_text(text)
    for _ in range(2):
        assemble(log, fragments)
        assert log.read_text() == CHANGELOG.replace("- Older.", "- One.\n- Second\n  line.\n- Older.")
        assert [path.name for path in fragments.iterdir()] == ["README.md"]


def test_current_changelog_fragments_can_be_assembled(tmp_path: Path) -> None:
    """The present fragments and an added one are assembled into the changelog."""
    fragments = shutil.copytree(ROOT / "changelog.d", tmp_path / "fragments")
    (fragments / "a-new-one.md").write_text("- A new one.\n")
    log = Path(shutil.copy(ROOT / "CHANGELOG.md", tmp_path))
    assemble(log, fragments)
    assert log.read_text().count("\n- A new one.\n") == 1


pytestmark = pytest.mark.skipif(not readme.SAMPLE.exists(), reason="a source distribution has no reports")

README = (ROOT / "README.md").read_text()


def test_readme_links_exist() -> None:
    """Every relative link of the README leads to an existing file."""
    links = [link for link in re.findall(r"\]\(([^)#]+)\)", README) if "://" not in link]
    assert links
    assert [link for link in links if not (ROOT / link).exists()] == []


def test_readme_has_at_most_135_lines() -> None:
    """The README has at most 135 lines and mentions the C compiler."""
    assert len(README.splitlines()) <= 135
    assert "C compiler" in README


def test_sample_report_is_small_and_its_policy_allows_its_script() -> None:
    """The sample report has at most 3 MB, and the hash in its content policy is that of its script."""
    text = readme.SAMPLE.with_name("index.html").read_text(encoding="utf-8")
    assert len(text) <= 3_000_000
    scripts = re.findall(r"<script>(.*?)</script>", text, re.DOTALL)
    hashes = [base64.b64encode(hashlib.sha256(script.encode()).digest()).decode() for script in scripts]
    assert hashes == re.findall(r"'sha256-([^']+)'", unescape(text))


def test_readme_blocks_match_the_committed_results() -> None:
    """The generated README blocks are those made from the committed results."""
    made = {found[2]: found[3] for found in readme.BLOCK.finditer(README)}
    assert made == readme.blocks()
    assert list(made) == ["bench", "stability", "accuracy"]
    for engine in ("PIC", "PIT", "pymunk", "PyBullet", "MuJoCo", "Box2D"):
        assert f"| {engine}" in made["accuracy"]


def test_readme_diagram_has_the_texts_of_the_committed_results() -> None:
    """The committed diagram of the README has the texts of the one drawn from the committed results."""
    for name, drawn in readme.bench_figures().items():
        texts = [re.findall(r"<text[^>]*>([^<]+)", one) for one in (drawn, (readme.FIGURES / name).read_text())]
        assert texts[0] == texts[1]  # lines and marks are matplotlib's, and differ from release to release
        assert "PIC" in texts[0]
