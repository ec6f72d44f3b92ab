import pytest
from tests.in_process_pool import InProcessPool
from tests.scene_builders import require_value

from carom.studies.stress.options import StressOptions
from carom.studies.stress.result import CellEnding, StressResults
from carom.studies.stress.run import list_rows, run_stress_campaign


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> StressResults:
    """A small campaign by PIC and PIT: a stress test, an invariance and two reported bugs."""
    names = ["tunnelling", "reversal", "mujoco-441", "rapier-97"]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("carom.execution.pool.LocalPool", lambda *_: InProcessPool())
        options = StressOptions(["pic", "pit"], quick=True, jobs=1)
        return run_stress_campaign(names, options, out=tmp_path_factory.mktemp("stress"), command="carom stress")


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


def test_stress_test_names_are_unique() -> None:
    """No two stress tests have the same name."""
    names = [line.name for line in list_rows()]
    assert len(set(names)) == len(names)
