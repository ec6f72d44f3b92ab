"""Documents are within their limits of words, they and sources follow the style guide; generated tables are current."""

import re
from pathlib import Path

import pytest
from docs import prose, prose_sources
from docs.figures import reference, scoring_tables, stages
from tests.cases import each
from tests.documents.code_blocks import ROOT

TEXTS = prose.pages()


def test_documents_follow_the_style_rules() -> None:
    """`python -m docs.prose` reports nothing for the documents: words, sentence and page lengths, word order."""
    texts = TEXTS | {"CHANGELOG.md": (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")}
    assert [*prose.over_limit(texts), *(one for name, text in texts.items() for one in prose.faults(name, text))] == []


@pytest.mark.long
def test_sources_follow_the_style_rules() -> None:
    """`python -m docs.prose` reports nothing for docstrings, comments and messages of the checked files."""
    assert list(prose.source_faults(prose_sources.source_paths())) == []


def test_every_page_is_easy_to_read() -> None:
    """The median Flesch reading ease of each page is at least 45."""
    low = {name: ease for name, text in TEXTS.items() if (ease := prose.page_ease(name, text) or 100.0) < 45}
    assert low == {}


@each(
    "text, fault",
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
def test_style_faults_are_found_in_prose_only(text: str, fault: str) -> None:
    """Words, inversions and long sentences are faults; in code, links and generated blocks nothing is."""
    found = "\n".join(prose.faults("page.md", text))
    assert fault in found
    assert bool(fault) == bool(found)


@each(
    "source, found",
    [
        ('"""What it is.\n\nMore.\n"""', [(1, "What it is.\n\nMore.")]),
        ('"""It.\n\nArgs:\n    one (str): One.\n    two: The\n        other.\n"""', [(1, "It. One. The other.")]),
        ('"""It adds.\n\n>>> add(1, 2)\n3\n\nThat is all::\n\n    told\n"""', [(1, "It adds. That is all.")]),
        ("x = 1  # a number\ny = 2  # another", [(1, "a number"), (2, "another")]),
        ("#: This is\n#: one.\n\n# Another.  \nimport x  # noqa: F401", [(1, "This is one."), (4, "Another.")]),
        ('f(f"{name} is not one, {other!r} is")', [(1, "Code is not one, Code is")]),
        ('f("it is " "one message")', [(1, "it is one message")]),
        ('f("two words", "x = one + two + three;")', []),
    ],
)
def test_prose_of_a_python_file_is_extracted(source: str, found: list[tuple[int, str]]) -> None:
    """Docstrings, comments and messages are extracted with their lines; code, short strings and names are not."""
    passages = prose_sources.passages("x.py", source)
    assert [(line, " ".join(text.split())) for line, text in passages] == [(n, " ".join(t.split())) for n, t in found]


def test_word_count_excludes_generated_text() -> None:
    """Generated blocks and pages count no words, code and tables do; pages above their limits are reported."""
    assert prose.count_words("page.md", "one `two`\n<!-- made by x.py: y -->\nthree\n<!-- end -->\n| 4 |") == 5
    assert prose.count_words("docs/results/hazards.md", "one") == 0
    assert list(prose.over_limit({"README.md": "word " * 701})) == ["README.md: 701 words, at most 700"]
    pages = {f"docs/{n}.md": "word " * 2999 for n in range(14)}
    assert list(prose.over_limit(pages)) == ["all pages: 41,986 words, at most 40,000"]


def test_scoring_tables_are_up_to_date() -> None:
    """`python docs/figures/scoring_tables.py` would not change the page with its two tables."""
    page = scoring_tables.PAGE.read_text(encoding="utf-8")
    assert scoring_tables.filled(page) == page
    assert page.count("made by docs/figures/scoring_tables.py") == 2


@pytest.mark.long
def test_stages_diagram_is_up_to_date() -> None:
    """`python docs/figures/stages.py` would change nothing, and the diagram has the five stages."""
    page = stages.PAGE.read_text(encoding="utf-8")
    assert stages.filled(page) == page
    results = "ComparedRun AlignedRun MeasuredRun JudgedRun Score"
    assert [result for _, _, result in stages.stages()] == results.split()
    assert stages.diagram() in page


def test_generated_reference_lists_commands_and_fields() -> None:
    """The command page has sections with options, and the scene page has the fields of the objects."""
    commands, scene = reference.commands_page(), reference.scene_page()
    assert all(f"## carom {name}\n" in commands for name in ("run", "advise", "import"))
    assert "| `-o, --out PATH` |" in commands
    assert "| `wall_rolling_resistance` | number | `0.0` | Coefficient" in scene
    assert "| `discs` | list of Disc | `required` |" in scene


def list_anchors(page: Path) -> set[str]:
    """Return the anchors of a page's headings."""
    headings = re.findall(r"^#+ (.+)", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.long
def test_cited_pages_and_headings_exist() -> None:
    """Each page and heading of the documents that sources, tests or settings cite exists."""
    files = [ROOT / "Makefile", ROOT / "action.yml", ROOT / "pyproject.toml"]
    suffixes = {".py", ".pyx", ".h", ".c", ".toml", ".mjs"}
    for folder in ("src", "adapters", "tests", "benchmarks", "docs"):
        files += [path for path in (ROOT / folder).rglob("*") if path.suffix in suffixes]
    found, lost = 0, []
    for path in (one for one in files if one.is_file() and "node_modules" not in one.parts):
        text = path.read_text(encoding="utf-8", errors="ignore")
        for page, anchor in re.findall(r"\b(docs/[\w/-]+\.md)(?:#([\w-]+))?", text):
            found += 1
            if path != Path(__file__) and not (ROOT / page).is_file():
                lost.append((path.name, page))
            elif anchor and anchor not in list_anchors(ROOT / page):
                lost.append((path.name, f"{page}#{anchor}"))
    assert found > 50
    assert lost == []
