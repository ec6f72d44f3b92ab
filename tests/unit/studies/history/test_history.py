"""Histories of a toy engine, whose changes from release to release are known."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from docs.figures.history import section
from tests.command import carom_command, printed_text
from tests.installed_adapters import clear_entry_point_caches
from tests.scene_builders import disc_at, staged
from tests.unit.studies.history.toy_engine import Toys, install_toys

from carom.engines.registry import list_adapter_points
from carom.execution.job import UnavailableError
from carom.report.render.markdown import render_markdown
from carom.studies.history.compare_cells import ChangeKind
from carom.studies.history.document import build_history_document
from carom.studies.history.options import HistoryOptions
from carom.studies.history.release_cache import ReleaseCache
from carom.studies.history.run import run_history

PAIR = staged("pair", disc_at(-1, 0, 1, r=0.25), disc_at(1, 0, -1, 0.125, r=0.25), duration_s=2.0, frame_rate_hz=20.0)


@pytest.fixture
def registry(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Toys]:
    """The toy engine's registry."""
    yield install_toys(tmp_path, monkeypatch)
    monkeypatch.undo()
    clear_entry_point_caches()


def build_options(*versions: str, **options: object) -> HistoryOptions:
    return HistoryOptions(versions=versions or None, profiles=("default",), jobs=1, **options)  # type: ignore[arg-type]


@pytest.mark.release
def test_history_classifies_each_release(registry: Toys, tmp_path: Path) -> None:
    """Each release of the toy engine has the change that it was built with, or the reason why it can't run."""
    found = run_history("toy", [PAIR], ReleaseCache(tmp_path / "kept"), build_options())
    versions = ["0.9", "1.0", "1.1", "1.2", "1.3", "1.4", "2.0"]
    assert [release.version for release in found.releases] == versions
    reasons = {release.version: release.not_run for release in found.releases}
    assert reasons["0.9"] == "older than 1.0, the oldest release that its adapter supports"
    assert reasons["2.0"].startswith("not installed: pip: ERROR: No matching distribution")
    assert [reason for version, reason in reasons.items() if version not in {"0.9", "2.0"}] == [""] * 5
    moved = {step.new.version: next(iter(step.changes.values())) for step in found.transitions}
    assert {version: change.kind for version, change in moved.items()} == {
        "1.1": ChangeKind.SAME_BITS,
        "1.2": ChangeKind.WORSE,
        "1.3": ChangeKind.SAME_BITS,
        "1.4": ChangeKind.BETTER,
    }
    # 1.0 runs at one phase, since 1.1 is equal; 1.1 also runs at eight more, since 1.2 differs.
    assert [len(cell.runs) for release in found.releases[1:3] for cell in release.cells.values()] == [1, 9]
    assert registry.installed == versions[1:-1]
    text = render_markdown(build_history_document(found))
    assert "1.1 to 1.2, 1 cell became worse." in text
    part = section(found, "By hand.")  # of the page that `make history` writes
    assert part.startswith(f"## {found.origin.engine}\n\nBy hand.\n\n")
    assert "1.1 to 1.2, 1 cell became worse." in part
    assert not any(name.startswith("toy-") for name in list_adapter_points())


@pytest.mark.release
def test_cached_releases_run_without_network(registry: Toys, tmp_path: Path) -> None:
    """Without a network, cached releases can be run by name; otherwise the error lists them."""
    kept = ReleaseCache(tmp_path / "kept")
    first = run_history("toy", [PAIR], kept, build_options("1.0", "1.2"))
    registry.reached = False
    assert run_history("toy", [PAIR], kept, build_options("1.0,1.2")).releases == first.releases
    with pytest.raises(UnavailableError, match=r"no network; --versions can name these cached releases: 1\.0, 1\.2$"):
        run_history("toy", [PAIR], kept, build_options())


@pytest.mark.release
@pytest.mark.usefixtures("registry")
def test_history_command_exits_with_1_if_newest_release_is_worse(tmp_path: Path) -> None:
    """`carom history` exits with 1 only if the newest release is worse; `--bisect` finds the changed one."""
    scene = tmp_path / "pair.json"
    scene.write_text(PAIR.model_dump_json())
    common = ["history", "toy", str(scene), "-p", "default", "-j", "1"]
    worse = carom_command(*common, "--versions", "1.1,1.2", "--out", str(tmp_path / "out"))
    assert worse.exit_code == 1, worse.output
    written = sorted(path.name for path in (tmp_path / "out").iterdir())
    assert written == [".carom", "history.md", "history.svg", "journal.jsonl"]
    assert "| 1.1 | 1.2 | pair | default | 1/20 s | worse |" in (tmp_path / "out" / "history.md").read_text()
    better = carom_command(*common, "--versions", "1.2..1.4")
    assert better.exit_code == 0, better.output
    first, *_, last = carom_command("history", "toy", "--list").output.splitlines()
    assert (first, last.split(maxsplit=1)) == ("2.0", ["0.9", "older than 1.0, the oldest supported release"])
    found = carom_command("history", "toy", "--versions", "1.0..1.3", "--bisect", f"{scene}:default:1/20")
    told = "1.2 differs from 1.1, which agrees with 1.0, the oldest (worse: largest error of a final velocity"
    assert told in printed_text(found)
