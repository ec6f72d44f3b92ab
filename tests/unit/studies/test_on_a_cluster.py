"""Studies give the same results on a cluster of two workers as on this machine."""

import dataclasses
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from tests.cases import each

import carom
from carom.studies.stress.options import StressOptions
from carom.studies.stress.run import JOURNAL, run_stress_campaign

pytestmark = [
    pytest.mark.long,
    pytest.mark.filterwarnings("ignore"),  # a Dask client leaves sockets behind that Python warns of
]


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    """Where the scheduler of a cluster with two workers listens, on this machine."""
    distributed: Any = pytest.importorskip("distributed", reason="distributed, extra cluster, is not installed")
    options = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": None, "silence_logs": 50}
    with distributed.LocalCluster(**options) as cluster:
        yield cluster.scheduler_address


def run_cross_check(where: str | None, _folder: Path) -> Any:
    found = carom.cross_check(["paper"], ["pic", "pit"], phases=2, scheduler=where)
    assert all(row.timing is not None for row in found.rows if row.job.refinement == 0), "run times are measured here"
    return [(row.trace, repr((row.score, row.spread))) for row in found.rows]


def run_stress(where: str | None, folder: Path) -> Any:
    options = StressOptions(["pic", "pit"], quick=True, scheduler=where)
    found = run_stress_campaign(["tunnelling", "reversal", "mujoco-441"], options, out=folder)
    return found.cells, {path.name: path.read_text() for path in (folder / "scenes").iterdir()}


@each("study", [run_cross_check, run_stress])
def test_results_on_a_cluster_are_identical(
    study: Callable[[str | None, Path], Any], address: str, tmp_path: Path
) -> None:
    """A study on a Dask cluster returns the same result as on this machine, bit for bit."""
    assert study(address, tmp_path / "there") == study(None, tmp_path / "here")


def test_study_from_a_cluster_resumes_locally(address: str, tmp_path: Path) -> None:
    """A study that ran on a cluster is resumed on this machine from its journal, without running anything."""
    options = StressOptions(["pit"], quick=True)
    there = run_stress_campaign(["tunnelling"], dataclasses.replace(options, scheduler=address), out=tmp_path)
    before = (tmp_path / JOURNAL).read_bytes()
    assert run_stress_campaign(["tunnelling"], options, out=tmp_path, resume=True).cells == there.cells
    assert (tmp_path / JOURNAL).read_bytes() == before
