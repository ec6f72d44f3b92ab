from __future__ import annotations

import importlib.util
import os
import signal
from pathlib import Path

import pytest

import carom.runs.sweep
from carom import Disc, Scene
from carom.runs.cell_score import CellResult, cell_key
from carom.runs.journal import Journal, canonical
from carom.runs.local import LocalPool
from carom.runs.results import Cell, Status
from carom.runs.sweep import BATCH_CELLS, batches, sweep


@pytest.fixture
def scene() -> Scene:
    """Two discs that meet obliquely, after a second or so."""
    return Scene(
        name="oblique",
        discs=[
            Disc(position_m=(0, 0), velocity_m_s=(1, 0), radius_m=0.5),
            Disc(position_m=(3, 0.3), velocity_m_s=(-1, 0), radius_m=0.5),
        ],
        duration_s=2.0,
    )


def cells_of(scene: Scene, engines: tuple[str, ...], count: int) -> list[Cell]:
    return [Cell(scene, engine, "tuned", 1 / (20 + k // 2), 0, (k % 2) / 2) for engine in engines for k in range(count)]


def test_a_message_holds_cells_of_one_engine_and_not_too_many(scene: Scene) -> None:
    """Every cell is in one message; a message is of one engine, and no longer than a worker's fair share."""
    cells = cells_of(scene, ("pit", "pic"), 150)
    found = batches(cells)
    assert sorted(map(id, (cell for batch in found for cell in batch))) == sorted(map(id, cells))
    assert all(len({cell.engine for cell in batch}) == 1 for batch in found)
    assert max(map(len, found)) == BATCH_CELLS


@pytest.mark.usefixtures("hostile")
def test_an_abort_costs_one_cell_and_has_a_name(scene: Scene) -> None:
    """Where an engine aborts or exits in the middle of a message, each such cell says so, and every other is run."""
    cells = cells_of(scene, ("aborts", "exits", "raises", "missing", "pit"), 2)
    with LocalPool(2) as pool:
        found = sweep(cells, pool)
    by_engine: dict[str, list[CellResult]] = {}
    for cell in cells:
        by_engine.setdefault(cell.engine, []).append(found[cell_key(cell)])
    assert {engine: {result.status for result in results} for engine, results in by_engine.items()} == {
        "aborts": {Status.CRASHED},
        "exits": {Status.CRASHED},
        "raises": {Status.FAILED},
        "missing": {Status.UNAVAILABLE},
        "pit": {Status.RAN},
    }
    assert all("SIGABRT" in result.reason for result in by_engine["aborts"])
    assert all("exit code 7" in result.reason for result in by_engine["exits"])


@pytest.mark.usefixtures("hostile")
def test_a_cell_that_hangs_is_ended_and_so_is_the_next(scene: Scene) -> None:
    """A cell without an answer is ended after the time limit, says after how long, and leaves the next its turn."""
    cells = cells_of(scene, ("hangs",), 2)
    with LocalPool(1, time_limit_s=0.5) as pool:
        found = sweep(cells, pool)
    assert [found[cell_key(cell)].status for cell in cells] == [Status.TIMED_OUT, Status.TIMED_OUT]
    assert "0.5 s" in found[cell_key(cells[0])].reason


def test_what_is_in_the_journal_is_not_run_again(scene: Scene, tmp_path: Path) -> None:
    """A sweep that goes on runs what is missing alone, and ends with the content of one that never stopped."""
    cells = cells_of(scene, ("pit", "pic"), 8)
    with LocalPool(2) as pool:
        with Journal(tmp_path / "whole.jsonl") as journal:
            sweep(cells, pool, journal)
        with Journal(tmp_path / "parts.jsonl") as journal:
            sweep(cells[::3], pool, journal)
        first = (tmp_path / "parts.jsonl").read_bytes()
        calls: list[tuple[int, int]] = []
        with Journal(tmp_path / "parts.jsonl", resume=True) as journal:
            sweep(cells, pool, journal, lambda done, total, _: calls.append((done, total)))
    assert (tmp_path / "parts.jsonl").read_bytes().startswith(first)
    assert len((tmp_path / "parts.jsonl").read_bytes().splitlines()) == len(cells)
    assert canonical(tmp_path / "parts.jsonl") == canonical(tmp_path / "whole.jsonl")
    assert calls[0] == (len(cells[::3]), len(cells))
    assert calls[-1] == (len(cells), len(cells))


def test_the_key_is_of_the_content(scene: Scene) -> None:
    """Step, phase, profile, engine and any number of the scene make another cell; its description does not."""
    cell = Cell(scene, "pit", "tuned", 0.1)
    others = [
        Cell(scene, "pit", "tuned", 0.1, 0, 0.5),
        Cell(scene, "pit", "tuned", 0.1000000001),
        Cell(scene, "pit", "default", 0.1),
        Cell(scene, "pic", "tuned", 0.1),
        Cell(scene.model_copy(update={"duration_s": 2.0000000000000004}), "pit", "tuned", 0.1),
        Cell(scene.model_copy(update={"name": "other"}), "pit", "tuned", 0.1),
    ]
    assert len({cell_key(other) for other in [cell, *others]}) == 7
    described = Cell(scene.model_copy(update={"description": "words"}), "pit", "tuned", 0.1, refinement=3)
    assert cell_key(described) == cell_key(cell)


@pytest.mark.skipif(importlib.util.find_spec("distributed") is None, reason="distributed, extra cluster, is missing")
@pytest.mark.filterwarnings("ignore")  # a worker that is killed leaves sockets behind that Python warns of
@pytest.mark.usefixtures("hostile")
def test_a_cluster_gives_the_same_journal_though_a_worker_is_killed(
    scene: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On a real Dask cluster, one of whose workers is killed in the middle, a sweep gives the same journal to the bit.

    An engine that aborts is there, too: it costs its own cells and no worker of the cluster.
    """
    from distributed import LocalCluster

    from carom.runs.cluster import ClusterPool

    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")]))
    cells = [*cells_of(scene, ("pit", "pic"), 32), *cells_of(scene, ("aborts",), 2)]
    monkeypatch.setattr(carom.runs.sweep, "BATCH_CELLS", 8)
    with LocalPool(2) as here, Journal(tmp_path / "here.jsonl") as journal:
        sweep(cells, here, journal)
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None, silence_logs=50) as cluster:  # type: ignore[no-untyped-call] # distributed has no types
        before = {worker.process.pid for worker in cluster.workers.values()}
        killed: list[int] = []

        def progress(done: int, _total: int, _what: str) -> None:
            if done and not killed:
                killed.append(min(before))
                os.kill(killed[0], signal.SIGKILL)

        with ClusterPool(cluster.scheduler_address) as pool, Journal(tmp_path / "there.jsonl") as journal:
            sweep(cells, pool, journal, progress)
    assert killed
    assert len(canonical(tmp_path / "here.jsonl")) == len(cells)
    assert canonical(tmp_path / "there.jsonl") == canonical(tmp_path / "here.jsonl")


@pytest.mark.skipif(importlib.util.find_spec("distributed") is None, reason="distributed, extra cluster, is missing")
@pytest.mark.filterwarnings("ignore")  # the client that gives up leaves sockets behind, too
def test_a_scheduler_that_is_not_there_is_a_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where no scheduler answers, one error says so with the address."""
    from carom.runs import cluster

    monkeypatch.setattr(cluster, "CONNECT_S", 0.5)
    with pytest.raises(cluster.ClusterError, match=r"no Dask scheduler answers at tcp://127\.0\.0\.1:9"):
        cluster.ClusterPool("tcp://127.0.0.1:9")
