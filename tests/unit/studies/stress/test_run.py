import json
from dataclasses import replace
from pathlib import Path

import pytest
from tests.cases import each

from carom import load_scene, run
from carom.errors import InputError
from carom.execution.pool import InProcessPool
from carom.studies.stress import run as campaign
from carom.studies.stress.document import write_stress
from carom.studies.stress.options import StressOptions
from carom.studies.stress.result import CellEnding, StressResults
from carom.studies.stress.run import JOURNAL, list_lines, run_stress_campaign

#: What is asked of Carom's own two methods.
BOTH = StressOptions(["pic", "pit"], quick=True)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("stress")


@pytest.fixture(scope="module")
def results(folder: Path) -> StressResults:
    """A small campaign: one line of each kind, on our own two methods."""
    names = ["tunnelling", "reversal", "mujoco-441", "rapier-97"]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("carom.execution.pool.LocalPool", lambda *_: InProcessPool())
        return run_stress_campaign(names, replace(BOTH, jobs=1), out=folder, command="carom stress")


@pytest.mark.long
def test_every_cell_has_a_number_or_a_reason(results: StressResults) -> None:
    """No cell is empty: it has a number and the file that shows it, or a reason for having none."""
    assert len(results.cells) == len(results.lines) * len(results.methods)
    for result in results.cells.values():
        assert result.value is not None or result.reason
        assert result.value is None or result.scenes


def test_the_methods_are_told_apart(results: StressResults) -> None:
    """PIC passes any speed, PIT fails between one and a few radii a step, and gravity is a reason."""
    cells = results.cells
    assert cells["tunnelling", "pic/event-driven"].ending is CellEnding.PASSES
    fell = cells["tunnelling", "pit/tuned"]
    assert fell.ending is CellEnding.FAILS_AT_SIZE
    assert fell.value is not None
    # Head-on, the approaching half of the chord is two radii: beyond that there may be no frame.
    assert 1.0 < fell.value <= 10.0
    assert cells["reversal", "pic/event-driven"].ending is CellEnding.HOLDS
    assert cells["mujoco-441", "pic/event-driven"].ending is CellEnding.NOT_SEEN
    assert cells["mujoco-441", "pit/tuned"].ending is CellEnding.SEEN
    falling = cells["rapier-97", "pic/event-driven"]
    assert "gravity" in falling.reason or falling.value is not None


@pytest.mark.long
def test_a_number_can_be_had_again_from_its_file(results: StressResults, folder: Path) -> None:
    """Running the file next to PIT's number shows the miss that the cell reports."""
    scene = load_scene(folder / results.cells["tunnelling", "pit/tuned"].scenes[0])
    assert len(run(scene, "pit", dt=1.0 / scene.frame_rate_hz).impacts) == 0


@pytest.mark.long
def test_a_finished_campaign_is_not_run_again(results: StressResults, folder: Path, monkeypatch: object) -> None:
    """Taken up again, a campaign that is finished yields the same cells and runs nothing; a full one is another."""
    assert isinstance(monkeypatch, pytest.MonkeyPatch)
    monkeypatch.setattr(campaign.TableCell, "run", lambda *_: pytest.fail("a finished cell was run again"))
    names = [line.name for line in results.lines]
    again = run_stress_campaign(names, BOTH, out=folder, resume=True, command="carom stress")
    assert again.cells == results.cells
    with pytest.raises(InputError, match="its quick is True, but this study's is False; name another folder"):
        run_stress_campaign(names, replace(BOTH, quick=False), out=folder, resume=True)


@pytest.mark.usefixtures("in_process")
def test_files_of_the_user_are_not_touched(tmp_path: Path) -> None:
    """A folder that no campaign has written into is left as it is, and the message names its content."""
    (tmp_path / "scenes").mkdir()
    (tmp_path / "scenes" / "notes.txt").write_text("mine")
    with pytest.raises(InputError, match="holds files that Carom did not write, such as scenes"):
        run_stress_campaign(["small"], StressOptions(["pit"], quick=True), out=tmp_path)
    assert (tmp_path / "scenes" / "notes.txt").read_text() == "mine"


@pytest.mark.long
def test_an_interrupted_campaign_keeps_what_is_finished(tmp_path: Path) -> None:
    """Ctrl-C after the first cell leaves that cell in the journal, which a resumed campaign takes from it."""

    def interrupt(done: int, total: int, what: str) -> None:
        raise KeyboardInterrupt(f"{done} of {total}: {what}")

    with pytest.raises(KeyboardInterrupt):
        run_stress_campaign(["small"], replace(BOTH, jobs=1), out=tmp_path, progress=interrupt)
    finished = (tmp_path / JOURNAL).read_text().splitlines()
    assert len(finished) >= 2, "the stamp and a cell"
    done: list[int] = []
    run_stress_campaign(["small"], BOTH, out=tmp_path, resume=True, progress=lambda d, _t, _w: done.append(d))
    assert done == [1, 2, 3], "all are counted, those of the journal too"
    assert (tmp_path / JOURNAL).read_text().splitlines()[: len(finished)] == finished


def test_no_two_lines_share_a_name() -> None:
    """Every attack, relation, check and complaint has a name of its own, since the command line takes them by name."""
    names = [line.name for line in list_lines()]
    assert len(set(names)) == len(names)


def test_the_documents_hold_every_cell(results: StressResults, tmp_path: Path) -> None:
    """HTML, Markdown and JSON are written whole; the JSON is strict and has every cell."""
    page = write_stress(results, tmp_path)
    content = json.loads((tmp_path / "stress.json").read_text(), parse_constant=pytest.fail)
    assert [line["name"] for line in content["lines"]] == [line.name for line in results.lines]
    assert all(len(line["cells"]) == len(results.methods) for line in content["lines"])
    markdown, html = (tmp_path / "stress.md").read_text(), page.read_text()
    for line in results.lines:
        assert line.name in markdown
        assert line.name in html
    assert "scenes/tunnelling.pit.tuned.toml" in html
    assert "tunnelling.pit.tuned.toml" in markdown


@each(
    "phrase, ending",
    [
        ("gives way", CellEnding.FAILS_AT_SIZE),
        ("stands to the end", CellEnding.PASSES),
        ("gives way at the harmless end", CellEnding.FAILS_AT_START),
        ("fails at this size", CellEnding.FAILS_AT_SIZE),
    ],
)
def test_a_journal_of_earlier_words_is_read(phrase: str, ending: CellEnding) -> None:
    """How a cell ended is known by the phrase of today and by those that earlier journals have."""
    assert CellEnding(phrase) is ending
