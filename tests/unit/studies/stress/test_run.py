import json
from dataclasses import replace
from pathlib import Path

import pytest
from tests.in_process_pool import InProcessPool
from tests.scene_builders import require_value

from carom import load_scene, run
from carom.errors import InputError
from carom.studies.stress import run as campaign
from carom.studies.stress.document import build_stress_document, write_stress
from carom.studies.stress.options import StressOptions
from carom.studies.stress.result import CellEnding, StressResults
from carom.studies.stress.run import JOURNAL, list_rows, run_stress_campaign

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
def test_every_campaign_cell_has_number_and_file_or_reason(results: StressResults) -> None:
    """Each cell of a campaign contains a number and a scene file, or a reason."""
    assert len(results.cells) == len(results.rows) * len(results.methods)
    for result in results.cells.values():
        assert result.value is not None or result.reason
        assert result.value is None or result.scenes


def test_campaign_distinguishes_pic_and_pit(results: StressResults) -> None:
    """PIC passes tunnelling, mujoco-441 and time reversal; PIT tunnels at 1 to 10 radii per step."""
    for line, method, ending in (
        ("tunnelling", "pic/event-driven", CellEnding.PASSES),
        ("tunnelling", "pit/tuned", CellEnding.FAILS_AT_SIZE),
        ("reversal", "pic/event-driven", CellEnding.HOLDS),
        ("mujoco-441", "pic/event-driven", CellEnding.NOT_SEEN),
        ("mujoco-441", "pit/tuned", CellEnding.SEEN),
    ):
        assert results.cells[line, method].ending is ending
    # Head-on, the approaching half of the chord is two radii: beyond that there may be no frame.
    assert 1.0 < require_value(results.cells["tunnelling", "pit/tuned"].value) <= 10.0
    falling = results.cells["rapier-97", "pic/event-driven"]
    assert "gravity" in falling.reason or falling.value is not None


@pytest.mark.long
def test_saved_scene_reproduces_the_failure(results: StressResults, folder: Path) -> None:
    """Running the saved scene of PIT's failure in tunnelling gives no impact."""
    scene = load_scene(folder / results.cells["tunnelling", "pit/tuned"].scenes[0])
    assert len(run(scene, "pit", dt=1.0 / scene.frame_rate_hz).impacts) == 0


@pytest.mark.long
def test_resumed_finished_campaign_runs_nothing(
    results: StressResults, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Resuming a finished campaign runs nothing; a full one in the folder of a quick one is refused."""
    monkeypatch.setattr(campaign.TableCell, "run", lambda *_: pytest.fail("a finished cell was run again"))
    names = [line.name for line in results.rows]
    again = run_stress_campaign(names, BOTH, out=folder, resume=True, command="carom stress")
    assert again.cells == results.cells
    with pytest.raises(InputError, match="its quick is True, but this study's is False; name another folder"):
        run_stress_campaign(names, replace(BOTH, quick=False), out=folder, resume=True)


@pytest.mark.long
def test_interrupted_campaign_keeps_finished_cells(tmp_path: Path) -> None:
    """A campaign interrupted after its first cell has that cell in the journal and reuses it when resumed."""

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


def test_stress_test_names_are_unique() -> None:
    """No two stress tests have the same name."""
    names = [line.name for line in list_rows()]
    assert len(set(names)) == len(names)


def test_stress_documents_contain_every_test(results: StressResults, tmp_path: Path) -> None:
    """HTML and Markdown contain every stress test, and the strict JSON contains a cell for each method."""
    page = write_stress(results, build_stress_document(results), tmp_path)
    content = json.loads((tmp_path / "stress.json").read_text(), parse_constant=pytest.fail)
    assert [line["name"] for line in content["lines"]] == [line.name for line in results.rows]
    assert all(len(line["cells"]) == len(results.methods) for line in content["lines"])
    markdown, html = (tmp_path / "stress.md").read_text(), page.read_text()
    assert all(line.name in text for line in results.rows for text in (markdown, html))
    assert "scenes/tunnelling.pit.tuned.toml" in html
    assert "tunnelling.pit.tuned.toml" in markdown
