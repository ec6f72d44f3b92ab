"""Files of a report: valid and complete, whatever names and messages contain."""

import base64
import hashlib
import json
import re
import sys
from collections import Counter
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote
from xml.etree import ElementTree as ET

import pytest
from docs.figures.raw_records import read_raw_records
from tests.cases import each

import carom
from carom.catalogue import find_scenes
from carom.comparator import Grade
from carom.errors import InputError, MissingExtraError
from carom.execution.job import Status
from carom.execution.results import Results, is_violation
from carom.report.junit import render_junit
from carom.report.results_file.results_jsonl import read_records
from carom.studies.cross_check.document import build_report
from carom.support.escaping import escape_controls
from carom.support.limits import MOST_BYTES, MOST_VALUES

ROOT = Path(__file__).resolve().parents[3]

VOID = {"meta", "br", "link", "img", "input", "hr", "use", "path"}


class _Page(HTMLParser):
    """Collects tags and text, and whether each element is closed in its turn."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.tags: Counter[str] = Counter()
        self.attributes: list[tuple[str, str, str]] = []
        self.faults: list[str] = []
        self.text: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags[tag] += 1
        self.attributes += [(tag, name, value or "") for name, value in attrs]
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        if tag in VOID:
            return
        if not self.open or self.open.pop() != tag:
            self.faults.append(f"</{tag}> at line {self.getpos()[0]}")

    def handle_data(self, data: str) -> None:
        self.text.append(data)


@pytest.fixture(scope="module")
def folder(results: Results, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build_report(results).write(tmp_path_factory.mktemp("report") / "new" / "folder").parent


@pytest.fixture(scope="module")
def source(folder: Path) -> str:
    return (folder / "index.html").read_text(encoding="utf-8")


def read_files(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.fixture(scope="module")
def page(source: str) -> _Page:
    page = _Page()
    page.feed(source)
    page.close()
    return page


def test_html_is_self_contained(page: _Page, source: str) -> None:
    """The page has no web address, style sheet or image, and every reference leads to a place in the page."""
    assert "http://" not in source
    assert "https://" not in source
    assert page.tags["link"] == page.tags["img"] == page.tags["iframe"] == 0
    scenes = [value for _, name, value in page.attributes if name == "data-scene"]
    ids = [value for _, name, value in page.attributes if name == "id"]
    assert len(ids) == len(set(ids))
    targets = [value for _, name, value in page.attributes if name in {"href", "src", "xlink:href"}]
    targets += [f"#{name}" for name in re.findall(r"url\(#?([^)]+)\)", source)]
    places = {unquote(target.removeprefix("#")) for target in targets} - set(ids)
    assert all(any(place.startswith(f"{scene}/") for scene in scenes) for place in places)


def test_html_allows_only_the_replay_script(page: _Page, source: str) -> None:
    """The page's policy allows one script by its hash; all else is data, without event handlers."""
    (script,) = re.findall(r"<script>(.*?)</script>", source, flags=re.DOTALL)
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    assert f"script-src &#39;sha256-{digest}&#39;;" in source
    assert page.tags["script"] - 1 == source.count('<script type="text/plain" data-')
    assert not [name for _, name, _ in page.attributes if name.startswith("on")]


def test_html_escapes_names(page: _Page, source: str) -> None:
    """Markup in a scene's name, an engine's message or the processor's name is shown as text."""
    assert "<script>alert" not in source
    assert "<nothing>" not in source
    assert page.tags["b"] == source.count("<b>") - source.count("<b><")
    assert any("<script>alert" in text for text in page.text)
    assert any("A <CPU>" in text for text in page.text)


def test_html_is_well_formed_and_accessible(page: _Page) -> None:
    """Elements are closed in order, every picture has an accessible label, and every table heading states its scope."""
    assert (page.faults, page.open) == ([], [])
    labels = [value for tag, name, value in page.attributes if tag == "svg" and name == "aria-label"]
    assert page.tags["svg"] == len(labels)
    assert all(labels)
    scopes = [value for tag, name, value in page.attributes if tag == "th" and name == "scope"]
    assert len(scopes) == page.tags["th"]


@pytest.mark.long
def test_report_is_reproducible(results: Results, folder: Path, tmp_path: Path) -> None:
    """The same results give the same bytes, so that a committed report differs only if its results do."""
    build_report(results).write(tmp_path)
    assert read_files(tmp_path) == read_files(folder)


@pytest.mark.long
def test_control_characters_are_escaped_in_every_file(tmp_path: Path) -> None:
    """Control characters in a name are visible text in every file, and results.jsonl returns the name."""
    name = "evil\x9b31m\u202egnp\u2028x"
    scene = find_scenes(["paper/late"])[0].scene.model_copy(update={"name": name})
    build_report(carom.cross_check([scene], ["pic", "pit"], dts=[0.1], timing=False, jobs=1)).write(tmp_path)
    for content in read_files(tmp_path).values():
        text = content.decode()
        assert escape_controls(text) == text
    assert "evil\\u009b31m\\u202egnp\\u2028x" in (tmp_path / "index.html").read_text(encoding="utf-8")
    _, rows = read_raw_records(tmp_path / "results.jsonl")
    assert {row["scene"] for row in rows} == {name}


@each("module", ["jinja2", "matplotlib"])
def test_missing_report_extra_is_reported(
    results: Results, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, module: str
) -> None:
    """Without jinja2 or matplotlib the error has `pip install 'carom[report]'`, and nothing is written."""
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(MissingExtraError, match=re.escape("pip install 'carom[report]'")):
        build_report(results).write(tmp_path / "none")
    assert not (tmp_path / "none").exists()


def test_jsonl_is_strict_and_complete(results: Results, folder: Path) -> None:
    """The first line describes run and machine, and each other line one row, in order, without NaN or infinity."""

    def refuse(text: str) -> None:
        raise AssertionError(text)

    lines = (folder / "results.jsonl").read_text(encoding="utf-8").splitlines()
    head, *found = (json.loads(line, parse_constant=refuse) for line in lines)
    assert [(line["scene"], line["engine"], line["dt_s"]) for line in found] == [
        (row.job.scene.name, row.job.engine, row.job.dt_s) for row in results.rows
    ]
    assert head["environment"]["processor"] == "A <CPU>"
    assert not any("environment" in line for line in found)
    for line, row in zip(found, results.rows, strict=True):
        assert line["status"] == row.status.name.lower()
        assert line["reason"] == row.reason
        assert bool(line["verdicts"]) == (row.status is Status.RAN)
    missed = next(line for line in found if line["scene"] == "paper/missed" and line["engine"] == "pit")
    assert missed["grade"] == "wrong"
    assert missed["missed"] == [0]
    assert missed["total"]["velocity"] is None
    assert missed["price_paid"] == pytest.approx(1.0)
    assert read_raw_records(folder / "results.jsonl") == (head, found)


#: By what is wrong: what a file of results holds, what is said of it, and what is to be done.
_WHOLE = (ROOT / "tests" / "earlier_formats" / "results-3.jsonl").read_bytes().splitlines(keepends=True)
AGAIN, ANOTHER = "; this Carom reads .* run the cross-check again", ".*give the folder of a report"
NO_RESULTS = {
    "empty": (b"", f"is not the results.jsonl of a cross-check{ANOTHER}"),
    "earlier": (b'{"format": 1, "scene": "paper/late", "environment": {}}', f"is of format 1{AGAIN}"),
    "cut": (b"".join(_WHOLE[:2]), f"has 1 of 2 rows{AGAIN}"),
    "cut in a line": (b"".join(_WHOLE)[:-100], r"line 3: invalid JSON \(EOF while"),
    "more": (b"".join((*_WHOLE, b"{\n")), f"has 3 of 2 rows{AGAIN}"),
    "a row that is none": (b"".join((*_WHOLE[:2], b"[]\n")), "line 3: the line: Input should be"),
    "no environment": (b'{"format": 3, "rows": 0}\n', "line 1: environment: Field required"),
    "no JSON": (b"{\n", f"line 1: invalid JSON{ANOTHER}"),
    "digits in a row": (b"".join((*_WHOLE[:2], b'{"scene":' + b"9" * 5000 + b"}\n")), "line 3: "),
    "no object": (b"[]\n", f"line 1: not a JSON object{ANOTHER}"),
    "deep": (b"[" * 100_000, f"line 1: invalid JSON{ANOTHER}"),
    "digits": (b'{"a":' + b"9" * 5000 + b"}", f"line 1: invalid JSON{ANOTHER}"),
    "large": (b" " * (2**20 + 1), f"is larger than the limit for results: 1 MiB{ANOTHER}"),
    "many": (b"[]," * 2**17, f"or 131,072 values{ANOTHER}"),
    "bytes": (b"\xff", f"can't be read{ANOTHER}"),
}


@each("what", NO_RESULTS)
def test_invalid_results_file_is_refused_with_the_reason(
    what: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An invalid results file is refused; the message names the line or limit, and for most what to do."""
    monkeypatch.setitem(MOST_BYTES, ".jsonl", 2**20)
    monkeypatch.setitem(MOST_VALUES, ".jsonl", 2**17)
    path, (data, words) = tmp_path / "results.jsonl", NO_RESULTS[what]
    path.write_bytes(data)
    with pytest.raises(InputError, match=rf"results\.jsonl.*{words}"):
        read_records(path)


def test_junit_counts_match_the_rows(results: Results, folder: Path) -> None:
    """Wrong and inaccurate cells are failures, broken engines errors, and cells not run skipped, with reasons."""
    root = ET.parse(folder / "junit.xml").getroot()  # noqa: S314 - our own file
    assert len(list(root.iter("testcase"))) == len(results.rows) == int(root.attrib["tests"])
    for tag, attribute in (("failure", "failures"), ("error", "errors"), ("skipped", "skipped")):
        found = list(root.iter(tag))
        in_suites = sum(int(suite.attrib[attribute]) for suite in root.iter("testsuite"))
        assert len(found) == int(root.attrib[attribute]) == in_suites
        assert all(entry.attrib["message"] for entry in found)
    grades = Counter(row.grade.name if row.grade else "" for row in results.rows)
    assert int(root.attrib["failures"]) == grades["WRONG"] + grades["INACCURATE"] > 0
    broken = {Status.CRASHED, Status.TIMED_OUT, Status.FAILED}
    assert int(root.attrib["errors"]) == sum(row.status in broken for row in results.rows)
    assert any("gone is not installed" in entry.attrib["message"] for entry in root.iter("skipped"))


@each("fail_on", [Grade.SAMPLED, Grade.WRONG, None])
def test_junit_failures_match_the_exit_code(results: Results, fail_on: Grade | None) -> None:
    """The number of failed cases is the number of rows that violate the grade of `--fail-on`."""
    root = ET.fromstring(render_junit(results, fail_on))  # noqa: S314 - our own text
    violations = [row for row in results.rows if fail_on is not None and is_violation(row, fail_on)]
    assert len([*root.iter("failure")]) == len(violations)
    assert bool(violations) is (fail_on is not None)


def test_markdown_tables_are_well_formed(folder: Path) -> None:
    """Every row of a table has as many cells as its heading, and no name becomes markup."""
    text = (folder / "report.md").read_text(encoding="utf-8")
    blocks = [block.splitlines() for block in text.split("\n\n") if block.startswith("|")]
    assert len(blocks) >= 4
    for block in blocks:
        assert len({len(re.findall(r"(?<!\\)\|", line)) for line in block}) == 1, block
    assert "<script" not in text.replace("\\<", "")
    assert "carom run --report 'a & b'" in text
