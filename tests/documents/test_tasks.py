"""The documents are found by words that people search, the tutorial shows what happens; a changelog is assembled."""

import json
import re
from functools import cache
from pathlib import Path
from typing import Any

import pytest
import yaml
from docs.figures import readme
from docs.figures.changelog import assemble
from docs.figures.tutorial import NOTEBOOK, executed, read, texts
from PIL import Image
from tests.cases import each
from tests.documents.code_blocks import PAGES, ROOT

import carom
from carom.web.page import GALLERY

#: Words that people search, and the page that is theirs.
SEARCHED = {
    "substeps": "docs/how-to/which-step.md",
    "tunnelling": "docs/how-to/tunnelling.md",
    "CCD": "docs/how-to/tunnelling.md",
    "bullet": "docs/how-to/tunnelling.md",
    "animation": "docs/how-to/lecture.md",
    "pass through": "docs/how-to/tunnelling.md",
    "glossary": "docs/reference/glossary.md",
    "licence": "README.md",
}
TASKS = sorted(path.stem for path in (ROOT / "docs" / "how-to").glob("*.md"))
#: A heading counts as much as this many words of text; the site's search prefers headings, too.
HEADING = 10


@cache
def weights(word: str) -> dict[str, float]:
    """How much of each page is this word: its share of the text, with a heading's words counted more."""
    pattern, found = re.compile(rf"\b{word}", re.IGNORECASE), {}
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        headings = "\n".join(re.findall(r"^#+ .*", text, re.MULTILINE))
        hits = len(pattern.findall(text)) + HEADING * len(pattern.findall(headings))
        found[page.relative_to(ROOT).as_posix()] = hits / len(text.split())
    return found


@each("word, page", SEARCHED.items())
def test_a_word_that_people_search_finds_its_page(word: str, page: str) -> None:
    """No other page speaks of it more."""
    assert weights(word)[page] > 0
    assert weights(word)[page] == max(weights(word).values())


@each("task", TASKS)
def test_a_page_of_a_task_is_short_and_has_a_command(task: str) -> None:
    """It is read in two minutes, and its first block is a command or a program."""
    text = (ROOT / "docs" / "how-to" / f"{task}.md").read_text(encoding="utf-8")
    assert len(re.sub(r"(?s)```.*?```", "", text).split()) <= 400
    assert re.match(r"# .+\n\n(<!-- not run: .+ -->\n)?```sh\n", text)


def test_the_glossary_has_twelve_words() -> None:
    """A paragraph a word."""
    text = (ROOT / "docs" / "reference" / "glossary.md").read_text(encoding="utf-8")
    assert len(re.findall(r"^\*\*.+?\*\*: \S", text, re.MULTILINE)) == 12


def test_the_gallery_plays_scenes_of_the_catalogue() -> None:
    """Each replay is of a scene that there is, and of PIT where it differs from PIC."""
    text = (ROOT / "docs" / "gallery.md").read_text(encoding="utf-8")
    found = re.findall(r"<!-- replay: (\S+)(?: (\d+))? -->", text)
    assert len(found) == text.count("<!--") >= 5
    for name, rate in found:
        score = carom.compare(carom.solve_pic(name), carom.solve_pit(name, frame_rate_hz=float(rate) if rate else None))
        assert score.findings, name


def test_contributors_have_a_part_of_their_own() -> None:
    """Pages for contributors are in no other part of the navigation, and every page is in one part."""
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


KEPT = read()
CODE = [cell for cell in KEPT.cells if cell.cell_type == "code"]


def replays(cell: Any) -> list[str]:
    """The frames that a cell shows, whole: a replay has nothing in it of the machine that made it."""
    shown = [output.get("data", {}).get("text/html", "") for output in cell.get("outputs", [])]
    return [html for html in shown if html.startswith("<iframe")]


@pytest.mark.long
def test_every_cell_shows_what_is_kept_of_it() -> None:
    """Run again in an empty folder, no cell fails; each shows the same text, replay and kinds of picture."""
    for kept, run in zip(KEPT.cells, executed().cells, strict=True):
        assert texts(run) == texts(kept), kept.source
        assert [sorted(out.get("data", ())) for out in run.get("outputs", [])] == [
            sorted(out.get("data", ())) for out in kept.get("outputs", [])
        ], kept.source
        assert replays(run) == replays(kept), kept.source


def test_it_reads_on_a_code_host() -> None:
    """Each cell was run in order; pictures, a replay and tables are kept, without data of the machine."""
    assert [cell.execution_count for cell in CODE] == list(range(1, len(CODE) + 1))
    kinds = {kind for cell in CODE for output in cell.outputs for kind in output.get("data", ())}
    assert {"text/plain", "text/html", "image/png"} <= kinds
    assert not [output for cell in CODE for output in cell.outputs if output.output_type == "error"]
    shown = json.dumps([cell.outputs for cell in CODE])
    assert "<iframe" in shown
    assert not re.search(r"/(home|root|tmp|work|Users)/", shown)
    assert NOTEBOOK.stat().st_size < 1_000_000


def test_each_exercise_has_an_answer() -> None:
    """The numbers of the exercises are those of the answers."""
    text = "\n".join(cell.source for cell in KEPT.cells if cell.cell_type == "markdown")
    exercises, answers = text.partition("## 9. Answers")[::2]
    asked = re.findall(r"^(\d)\. \*\*.+?\*\*", exercises.partition("## 8.")[2], re.MULTILINE)
    assert len(asked) == 5
    assert re.findall(r"^\*\*(\d)\.\*\*", answers, re.MULTILINE) == asked


CHANGELOG = "# Changelog\n\n## 0.2.0 (unreleased)\n\n- Older.\n\n## 0.1.0\n\n- First.\n"


def test_fragments_come_first_in_the_newest_section_and_are_gone(tmp_path: Path) -> None:
    """By their names, above the existing text; the note on fragments stays, and a second time nothing changes."""
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


def test_what_is_no_list_or_has_no_place_is_refused_and_kept(tmp_path: Path) -> None:
    """A fragment that begins as no list, and a changelog without a section, are errors; no file is changed."""
    log, fragments = tmp_path / "CHANGELOG.md", tmp_path / "fragments"
    fragments.mkdir()
    for changelog, fragment in ((CHANGELOG, "Words.\n"), ("# Changelog\n", "- Words.\n")):
        log.write_text(changelog)
        (fragments / "a.md").write_text(fragment)
        with pytest.raises(ValueError, match=r"a fragment is a list|no section"):
            assemble(log, fragments)
        assert (log.read_text(), (fragments / "a.md").read_text()) == (changelog, fragment)


def test_the_fragments_of_this_repository_can_be_assembled(tmp_path: Path) -> None:
    """The present fragments are lists, and the changelog has a section for them."""
    fragments = tmp_path / "fragments"
    fragments.mkdir()
    for path in (ROOT / "changelog.d").glob("*.md"):
        (fragments / path.name).write_text(path.read_text("utf-8"))
    log = tmp_path / "CHANGELOG.md"
    log.write_text((ROOT / "CHANGELOG.md").read_text("utf-8"))
    (fragments / "a-new-one.md").write_text("- A new one.\n")
    assemble(log, fragments)
    assert log.read_text().count("\n- A new one.\n") == 1


pytestmark = pytest.mark.skipif(not readme.SAMPLE.exists(), reason="a source distribution has no reports")

README = (Path(__file__).resolve().parents[2] / "README.md").read_text()


def test_every_file_that_the_readme_links_to_exists() -> None:
    """No link of the README leads nowhere."""
    root = Path(__file__).resolve().parents[2]
    links = [link for link in re.findall(r"\]\(([^)#]+)\)", README) if "://" not in link]
    assert links
    assert [link for link in links if not (root / link).exists()] == []


def test_the_readme_is_short() -> None:
    """At most 135 lines, and a C compiler among what a machine needs."""
    assert len(README.splitlines()) <= 135
    assert "C compiler" in README


def test_the_pictures_are_there_and_small() -> None:
    """A first screen, the discs that one throws, a replay that moves, in light and dark with words, and each scene."""
    root = Path(__file__).resolve().parents[2]
    shown = re.findall(
        r'<source media="\(prefers-color-scheme: dark\)" srcset="(\S+?\.webp)"><img alt="(.+?)" src="(.+?)">', README
    )
    small = re.findall(r'<img alt="(.+?)" title="carom play (.+?)" width="150" src="(.+?)">', README)
    assert [(words, named) for words, named, _ in small] == [(name, name) for name in GALLERY]
    assert (len(shown), README.count("<img")) == (3, 4 + len(small))  # one is the drawing of the bench
    assert all(len(words) > 50 for _, words, _ in shown)
    paths = [root / path for dark, _, light in shown for path in (dark, light)]
    assert sum(path.stat().st_size for path in [*paths, *(root / path for _, _, path in small)]) <= 500_000
    frames = []
    for path in paths:
        with Image.open(path) as picture:
            frames.append(getattr(picture, "n_frames", 1) > 1)
    assert frames == [False, False, False, False, True, True]


def test_the_page_of_the_whole_suite_is_small() -> None:
    """With every replay in it the sample's page has at most 3 MB."""
    assert readme.SAMPLE.with_name("index.html").stat().st_size <= 3_000_000


def test_the_blocks_are_those_of_committed_results() -> None:
    """Run time against error, stability, accuracy and the diagram are what the script makes of committed results."""
    made = {found[2]: found[3] for found in readme.BLOCK.finditer(README)}
    assert made == readme.blocks()
    assert list(made) == ["bench", "stability", "accuracy"]
    for engine in ("PIC", "PIT", "pymunk", "PyBullet", "MuJoCo", "Box2D"):
        assert f"| {engine}" in made["accuracy"]
    for name, drawn in readme.bench_figures().items():
        texts = [re.findall(r"<text[^>]*>([^<]+)", one) for one in (drawn, (readme.FIGURES / name).read_text())]
        assert texts[0] == texts[1]  # lines and marks are matplotlib's, and differ from release to release
        assert "PIC" in texts[0]
