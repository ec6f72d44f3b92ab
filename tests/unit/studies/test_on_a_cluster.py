"""A study on a cluster of two worker processes gives the same results as on this machine."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import carom
from carom.studies.stress.options import StressOptions
from carom.studies.stress.run import JOURNAL, run_stress_campaign


@pytest.mark.long
@pytest.mark.filterwarnings("ignore")  # a Dask client leaves sockets behind that Python warns of
def test_results_on_a_cluster_are_identical_and_resume_locally(tmp_path: Path) -> None:
    """A campaign on a Dask cluster has the results of this machine, which resumes it; run times are measured here."""
    distributed: Any = pytest.importorskip("distributed", reason="distributed, extra cluster, is not installed")
    tests, options = ["tunnelling", "reversal", "mujoco-441"], StressOptions(["pic", "pit"], quick=True)
    out = tmp_path / "out"
    workers = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": None, "silence_logs": 50}
    with distributed.LocalCluster(**workers) as cluster:
        there = replace(options, scheduler=cluster.scheduler_address)
        found = run_stress_campaign(tests, there, out=out)
        results = carom.cross_check(["paper/late"], ["pit"], scheduler=cluster.scheduler_address)
    assert results.rows[0].timing is not None
    before = (out / JOURNAL).read_bytes()
    assert run_stress_campaign(tests, options, out=out, resume=True).cells == found.cells
    assert (out / JOURNAL).read_bytes() == before
    assert run_stress_campaign(tests, options, out=tmp_path / "here").cells == found.cells
