"""Hand-written documents are within their limits of words and follow the style guide; generated tables are current."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from docs import prose
from docs.figures import reference, scoring_tables, stages
from tests.documents.blocks import ROOT

TEXTS = prose.pages()


def test_the_documents_have_no_fault() -> None:
    """`python -m docs.prose` finds nothing: words, lengths of sentences and of pages, word order."""
    texts = TEXTS | {"CHANGELOG.md": (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")}
    assert [*prose.over_limit(texts), *(one for name, text in texts.items() for one in prose.faults(name, text))] == []


def test_every_page_reads_easily() -> None:
    """The median Flesch reading ease of each page is at least the target."""
    low = {name: ease for name, text in TEXTS.items() if (ease := prose.page_ease(name, text) or 100.0) < 45}
    assert low == {}


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("It is told twice.", "'told', write 'reported'"),
        ("It comes to nothing.", "'comes to'"),
        ("Of engines, two fail.", "the subject comes first"),
        ("Not so is the other.", ""),
        ("So is the other.", "the subject comes first"),
        ("A ball comes to rest.", ""),
        ("Of course it runs.", ""),
        ("`told` is a name. [A link](told.md) is one.", ""),
        ("<!-- made by x.py: y -->\nIt is told.\n<!-- end -->", ""),
        ("```sh\ntold\n```", ""),
        ("| a | It is told |\n| --- | --- |", "'told'"),
        (" ".join(["word"] * 41) + ".", "41 words"),
        (" ".join(["word"] * 40) + ".", ""),
    ],
)
def test_a_fault_is_found_where_it_is(text: str, fault: str) -> None:
    """Words, inversions and lengths of hand-written sentences are faults; code, names and generated blocks are not."""
    found = "\n".join(prose.faults("page.md", text))
    assert fault in found
    assert bool(fault) == bool(found)


def test_words_outside_generated_blocks_are_counted() -> None:
    """A generated block and a generated page have no words; code and tables have."""
    assert prose.count_words("page.md", "one `two`\n<!-- made by x.py: y -->\nthree\n<!-- end -->\n| 4 |") == 5
    assert prose.count_words("docs/results/hazards.md", "one") == 0
    assert list(prose.over_limit({"README.md": "word " * 701})) == ["README.md: 701 words, at most 700"]
    assert list(prose.over_limit({f"docs/{n}.md": "word " * 2999 for n in range(14)})) == [
        "all pages: 41,986 words, at most 40,000"
    ]


def test_short_words_in_short_sentences_read_more_easily() -> None:
    """Reading ease falls with the length of sentences and with syllables."""
    easy = prose.reading_ease("The disc hits the wall. It turns back.")
    assert easy > prose.reading_ease("The disc hits the wall and then it turns back on its own way.") > 60
    assert prose.reading_ease("Simultaneity necessitates conventional disambiguation.") < 0


def test_the_tables_of_verdicts_and_grades_are_generated() -> None:
    """`python docs/figures/scoring_tables.py` would change nothing."""
    page = scoring_tables.PAGE.read_text(encoding="utf-8")
    assert scoring_tables.filled(page) == page
    assert page.count("made by docs/figures/scoring_tables.py") == 2


def test_the_diagram_of_the_stages_is_generated() -> None:
    """`python docs/figures/stages.py` would change nothing, and the diagram has the five stages."""
    page = stages.PAGE.read_text(encoding="utf-8")
    assert stages.filled(page) == page
    assert [result for _, _, result in stages.stages()] == [
        "ComparedRun",
        "AlignedRun",
        "MeasuredRun",
        "JudgedRun",
        "GradedRun",
    ]
    assert stages.diagram() in page


def test_the_generated_reference_has_every_command_and_field() -> None:
    """A section for each command with its options, and one for each object of a scene file with its fields."""
    commands, scene = reference.commands_page(), reference.scene_page()
    assert all(f"## carom {name}\n" in commands for name in ("run", "advise", "import"))
    assert "| `-o, --out PATH` |" in commands
    assert "| `wall_rolling_resistance` | number | `0.0` | Coefficient" in scene
    assert "| `discs` | list of Disc | `required` |" in scene


def slugs(page: Path) -> set[str]:
    """Return the anchors of a page's headings."""
    headings = re.findall(r"^#+ (.+)", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings}


def test_citations_lead_to_pages() -> None:
    """Each page and heading of the documents that sources, tests or settings name exists."""
    files = [ROOT / "Makefile", ROOT / "action.yml", ROOT / "pyproject.toml"]
    for folder in ("src", "adapters", "tests", "benchmarks", "docs"):
        files += [
            path for path in (ROOT / folder).rglob("*") if path.suffix in {".py", ".pyx", ".h", ".c", ".toml", ".mjs"}
        ]
    found, lost = 0, []
    for path in (one for one in files if one.is_file() and "node_modules" not in one.parts):
        text = path.read_text(encoding="utf-8", errors="ignore")
        for page, anchor in re.findall(r"\b(docs/[\w/-]+\.md)(?:#([\w-]+))?", text):
            found += 1
            if path != Path(__file__) and not (ROOT / page).is_file():
                lost.append((path.name, page))
            elif anchor and anchor not in slugs(ROOT / page):
                lost.append((path.name, f"{page}#{anchor}"))
    assert found > 50
    assert lost == []
