"""Every study gives the same results on a cluster of two workers as on this machine."""

import dataclasses
import hashlib
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.attacks.clusters import start_cluster
from tests.cases import each

import carom
from carom.execution import cluster
from carom.execution.cluster import ClusterError
from carom.execution.journal import MemoryJournal
from carom.studies.bench.options import BenchPlan
from carom.studies.bench.run import measure_work_precision
from carom.studies.stress.options import StressOptions
from carom.studies.stress.run import JOURNAL, run_stress_campaign

pytestmark = [
    pytest.mark.long,
    pytest.mark.filterwarnings("ignore"),  # a Dask client leaves sockets behind that Python warns of
]

#: Fields that each run measures again, or that name the place of the run.
MEASURED = {"environment", "command", "elapsed_s", "options", "plan", "timing", "time_ratio", "skipped"}


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    """Where the scheduler of a cluster with two workers listens, on this machine."""
    distributed: Any = pytest.importorskip("distributed", reason="distributed, extra cluster, is not installed")
    options = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": None, "silence_logs": 50}
    with distributed.LocalCluster(**options) as cluster:
        yield cluster.scheduler_address


def hash_result(value: Any) -> str:
    """Return a hash of everything in a result that isn't measured, to the bit."""
    if dataclasses.is_dataclass(value):
        names = [field.name for field in dataclasses.fields(value) if field.name not in MEASURED]
        value = [(name, hash_result(getattr(value, name))) for name in names]
    elif isinstance(value, np.ndarray):
        value = (value.dtype.descr, value.shape, value.tobytes())
    elif isinstance(value, Mapping):
        value = sorted((hash_result(key), hash_result(one)) for key, one in value.items())
    elif isinstance(value, frozenset):
        value = sorted(map(hash_result, value))
    elif isinstance(value, list | tuple):
        value = [hash_result(one) for one in value]
    return hashlib.sha256(repr(value).encode()).hexdigest()


def run_engine(where: str | None, _folder: Path) -> Any:
    return carom.run("paper/wrong-direction", "pit", scheduler=where)


def run_cross_check(where: str | None, _folder: Path) -> Any:
    found = carom.cross_check(["paper"], ["pic", "pit"], phases=2, scheduler=where)
    assert all(row.timing is not None for row in found.rows if row.job.refinement == 0), "run times are measured here"
    return found


def run_stress(where: str | None, folder: Path) -> Any:
    options = StressOptions(["pic", "pit"], quick=True, scheduler=where)
    found = run_stress_campaign(["tunnelling", "reversal", "mujoco-441"], options, out=folder)
    return found, {path.name: path.read_text() for path in (folder / "scenes").iterdir()}


def run_advise(where: str | None, _folder: Path) -> Any:
    pytest.importorskip("pymunk", reason="pymunk is not installed")
    return carom.advise("paper/missed", ["pymunk"], phases=2, scheduler=where)


def run_tune(where: str | None, _folder: Path) -> Any:
    pytest.importorskip("optuna", reason="optuna, extra tune, is not installed")
    pytest.importorskip("pymunk", reason="pymunk is not installed")
    found = carom.tune("pymunk", ["paper/late"], trials=2, scheduler=where)
    return dataclasses.replace(found, time_ratio=0.0)


def run_bench(where: str | None, _folder: Path) -> Any:
    plan = BenchPlan(["pit"], [1 / 60, 1 / 120], timing=False, phases=2, scheduler=where)
    return measure_work_precision([carom.scene("paper/wrong-direction")], plan, plan.open_pool(), notes=MemoryJournal())


@each("study", [run_engine, run_cross_check, run_stress, run_advise, run_tune, run_bench])
def test_results_on_a_cluster_are_identical(
    study: Callable[[str | None, Path], Any], address: str, tmp_path: Path
) -> None:
    """A study on a Dask cluster returns the same result as on this machine, bit for bit."""
    here, there = study(None, tmp_path / "here"), study(address, tmp_path / "there")
    assert hash_result(there) == hash_result(here)


def test_study_from_a_cluster_resumes_locally(address: str, tmp_path: Path) -> None:
    """A study that ran on a cluster is resumed on this machine from its journal, without running anything."""
    options = StressOptions(["pit"], quick=True)
    there = run_stress_campaign(["tunnelling"], dataclasses.replace(options, scheduler=address), out=tmp_path)
    before = (tmp_path / JOURNAL).read_bytes()
    assert run_stress_campaign(["tunnelling"], options, out=tmp_path, resume=True).cells == there.cells
    assert (tmp_path / JOURNAL).read_bytes() == before


def test_worker_lost_before_its_result_is_fetched_is_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """If the only worker is lost after a task and before its result is fetched, an error reports the lost worker."""
    distributed: Any = pytest.importorskip("distributed", reason="distributed, extra cluster, is not installed")
    completed = distributed.as_completed

    with start_cluster(tmp_path) as (address, (_, worker)):

        def lose_worker(futures: list[Any], **options: Any) -> Iterator[Any]:
            for future in completed(futures, **options):
                worker.kill()
                worker.wait()
                yield future

        monkeypatch.setattr(distributed, "as_completed", lose_worker)
        monkeypatch.setattr(cluster, "WORKERLESS_S", 2.0)
        with pytest.raises(ClusterError, match="had no worker for 2 s; tasks left: 1"):
            carom.run("paper/missed", "pit", scheduler=address)
