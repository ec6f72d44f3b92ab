"""A history tells which release changed a bounce, of an engine of which that is known by construction."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from docs.figures.history import section
from tests.command import carom_command, told
from tests.installed_adapters import clear_entry_point_caches
from tests.scene_builders import disc_at, staged, sure
from tests.unit.studies.history.toy_engine import Toys, toys

from carom.engines.registry import list_adapter_points
from carom.errors import InputError, UnknownNameError
from carom.execution.job import UnavailableError
from carom.report.render.markdown import render_markdown
from carom.studies.history.compare_cells import ChangeKind, history_journal
from carom.studies.history.document import build_history_document
from carom.studies.history.options import HistoryOptions
from carom.studies.history.release_cache import ReleaseCache
from carom.studies.history.run import bisect_change, run_history

PAIR = staged("pair", disc_at(-1, 0, 1, r=0.25), disc_at(1, 0, -1, 0.125, r=0.25), duration_s=2.0, frame_rate_hz=20.0)


@pytest.fixture
def registry(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Toys]:
    """The toy engine's registry."""
    yield toys(tmp_path, monkeypatch)
    monkeypatch.undo()
    clear_entry_point_caches()


def asked(*versions: str, **options: object) -> HistoryOptions:
    return HistoryOptions(versions=versions or None, profiles=("default",), jobs=1, **options)  # type: ignore[arg-type]


@pytest.mark.release
def test_each_release_is_told_as_what_it_is(registry: Toys, tmp_path: Path) -> None:
    """Same bits, worse, better, asked otherwise, half seen, too old and not to be had: each by construction."""
    found = run_history("toy", [PAIR], ReleaseCache(tmp_path / "kept"), asked())
    assert [release.version for release in found.releases] == [
        *("0.9", "1.0", "1.1", "1.2", "1.3", "1.4", "1.5", "1.6", "2.0")
    ]
    reasons = {release.version: release.not_run for release in found.releases}
    assert reasons["0.9"] == "older than 1.0, the oldest release that its adapter drives"
    assert reasons["2.0"].startswith("not installed: pip: ERROR: No matching distribution")
    assert [reason for version, reason in reasons.items() if version not in {"0.9", "2.0"}] == [""] * 7
    moved = {step.new.version: next(iter(step.changes.values())) for step in found.transitions}
    assert {version: change.kind for version, change in moved.items()} == {
        "1.1": ChangeKind.NOTHING,
        "1.2": ChangeKind.WORSE,
        "1.3": ChangeKind.NOTHING,
        "1.4": ChangeKind.BETTER,
        "1.5": ChangeKind.OTHER_SETTINGS,
        "1.6": ChangeKind.UNOBSERVED,
    }
    assert moved["1.5"].why == "slop 0.0 → 0.1"
    assert [release.version for release in found.releases if release.observes_no_contact] == ["1.6"]
    assert registry.installed == ["1.0", "1.1", "1.2", "1.3", "1.4", "1.5", "1.6"]
    text = render_markdown(build_history_document(found))
    assert "the adapter can't read contacts of this release" in text
    assert "1.1 → 1.2: 1 worse." in text
    part = section(found, "By hand.")  # of the page that `make history` writes
    assert part.startswith(f"## {found.origin.engine}\n\nBy hand.\n\n")
    assert "1.1 → 1.2: 1 worse." in part
    assert not any(name.startswith("toy-") for name in list_adapter_points())


@pytest.mark.release
def test_only_what_differs_is_run_at_phases(registry: Toys, tmp_path: Path) -> None:  # noqa: ARG001
    """A cell of the same bits is run once, and a changed one also at each phase."""
    found = run_history("toy", [PAIR], ReleaseCache(tmp_path / "kept"), asked("1.0", "1.1", "1.2", phases=9))
    counts = [len(seen.ran) for release in found.releases for seen in release.seen.values()]
    assert counts == [1, 10, 10]


@pytest.mark.release
def test_a_history_that_was_ended_goes_on(registry: Toys, tmp_path: Path) -> None:
    """What a journal holds is not run again, what is kept is not installed again, and the result is equal."""
    kept, results = ReleaseCache(tmp_path / "kept"), []
    for resume in (False, True):
        with history_journal(tmp_path / "journal.jsonl", resume=resume) as notes:
            results.append(run_history("toy", [PAIR], kept, asked("1.1", "1.2"), notes=notes))
            lines = (tmp_path / "journal.jsonl").read_text().splitlines()
    assert results[0].releases == results[1].releases
    assert registry.installed == ["1.1", "1.2"]
    assert len(lines) == 1 + 2 * 9  # a head, and of each release its own phase and eight more


@pytest.mark.release
def test_without_a_network_what_is_kept_is_run(registry: Toys, tmp_path: Path) -> None:
    """Releases that are kept and named are run; a list that is not to be had is said, with what is kept."""
    kept = ReleaseCache(tmp_path / "kept")
    first = run_history("toy", [PAIR], kept, asked("1.0", "1.2"))
    registry.reached = False
    assert run_history("toy", [PAIR], kept, asked("1.0,1.2")).releases == first.releases
    with pytest.raises(UnavailableError, match=r"no network; cached releases can be named by --versions: 1\.0, 1\.2$"):
        run_history("toy", [PAIR], kept, asked())


@pytest.mark.release
@pytest.mark.parametrize(("versions", "last", "first"), [(["1.0..1.3"], "1.1", "1.2"), (["1.3..1.4"], "1.3", "1.4")])
def test_the_release_that_changed_a_cell_is_found(
    registry: Toys,  # noqa: ARG001
    tmp_path: Path,
    versions: list[str],
    last: str,
    first: str,
) -> None:
    """It is the first that does not as the oldest does."""
    found = sure(bisect_change("toy", PAIR, "default", 1 / 20, ReleaseCache(tmp_path / "kept"), asked(*versions)))
    assert (found.last, found.first) == (last, first)


@pytest.mark.release
def test_where_nothing_changed_no_release_is_found(registry: Toys, tmp_path: Path) -> None:
    """Two releases are asked, and no more."""
    assert bisect_change("toy", PAIR, "default", 1 / 20, ReleaseCache(tmp_path / "kept"), asked("1.2", "1.3")) is None
    assert registry.installed == ["1.2", "1.3"]


@pytest.mark.release
def test_what_is_not_there_is_refused_by_name(registry: Toys, tmp_path: Path) -> None:
    """An engine of no registry, a profile, a release: nothing is installed before it is refused."""
    kept = ReleaseCache(tmp_path / "kept")
    with pytest.raises(InputError, match="pit has no registry"):
        run_history("pit", [PAIR], kept, HistoryOptions(profiles=("tuned",)))
    with pytest.raises(UnknownNameError, match="toy has no profile 'best'"):
        run_history("toy", [PAIR], kept, HistoryOptions(profiles=("best",)))
    with pytest.raises(UnknownNameError, match=r"there is no release '1\.7'"):
        run_history("toy", [PAIR], kept, asked("1.7"))
    assert registry.installed == []


@pytest.mark.release
def test_the_command_writes_its_report_and_its_code_says_whether_the_newest_is_worse(
    registry: Toys,  # noqa: ARG001
    tmp_path: Path,
) -> None:
    """Exit code 1 where the newest release is worse than the one before, 0 where an older one was."""
    scene = tmp_path / "pair.json"
    scene.write_text(PAIR.model_dump_json())
    common = ["history", "toy", str(scene), "-p", "default", "-j", "1"]
    worse = carom_command(*common, "--versions", "1.1,1.2", "--out", str(tmp_path / "out"))
    assert worse.exit_code == 1, worse.output
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == [
        *(".carom", "history.md", "history.svg", "journal.jsonl")
    ]
    assert "| 1.1 | 1.2 | pair | default | 1/20 s | worse |" in (tmp_path / "out" / "history.md").read_text()
    better = carom_command(*common, "--versions", "1.2..1.4")
    assert better.exit_code == 0, better.output
    listed = carom_command("history", "toy", "--list")
    assert listed.output.splitlines()[0] == "2.0"
    assert listed.output.splitlines()[-1].split(maxsplit=1) == ["0.9", "older than 1.0, the oldest supported release"]
    found = carom_command("history", "toy", "--versions", "1.0..1.3", "--bisect", f"{scene}:default:1/20")
    assert "1.2 differs from 1.1, which agrees with the oldest, 1.0 (worse: error of final velocities" in told(found)
