"""Which jobs a cross-check has, and what a sweep makes of them, by itself and on a cluster, with TLS or without."""

import importlib.util
import shutil
import subprocess
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from tests.cases import each
from tests.in_process_pool import InProcessPool
from tests.journal_lines import read_canonical_lines
from tests.scene_builders import disc_at, staged

from carom import Scene
from carom.execution.cache_key import build_job_key
from carom.execution.cluster import ClusterError, ClusterPool
from carom.execution.job import Job, Method
from carom.execution.pool import Pool
from carom.execution.score_jobs import score_jobs, score_journal
from carom.studies.cross_check.options import Options
from carom.studies.cross_check.plan import build_plan

SCENE = staged("pair", disc_at(0, 0, 1, 0), disc_at(3, 0), duration_s=3.0)


@each(
    "profile, dts, refinements",
    [
        ("tuned", None, [0, 1, 2]),
        ("located", None, [0]),
        ("tuned", (0.1, 0.05), [0, 1]),
        ("located", (0.1, 0.05), [0, 1]),
    ],
)
def test_located_profile_runs_at_the_coarsest_step_only(
    profile: str, dts: tuple[float, ...] | None, refinements: list[int]
) -> None:
    """A located profile, which cuts its steps, runs at the coarsest step, unless time steps are given."""
    with InProcessPool() as pool:
        plan = build_plan([SCENE], Options(engines=("pymunk",), profiles=("tuned", "located"), dts=dts), pool)
    assert [job.refinement for job in plan.jobs if job.method.profile == profile] == refinements


@pytest.fixture
def scene() -> Scene:
    """Two discs that meet obliquely, after a second or so."""
    return staged("oblique", disc_at(0, 0, 1, 0), disc_at(3, 0.3, -1, 0), duration_s=2.0)


def test_job_key_depends_only_on_content(scene: Scene) -> None:
    """Step, phase, method, setting, name and numbers of the scene change the key; its description does not."""
    job = Job(scene, Method("pic", "event-driven"), 0.1)
    others = [
        replace(job, phase=0.5),
        replace(job, dt_s=0.1000000001),
        replace(job, method=Method("pic", "frame-by-frame")),
        replace(job, method=Method("pit", "tuned")),
        replace(job, method=Method("pic", "event-driven", (("iterations", 5),))),
        replace(job, scene=scene.model_copy(update={"duration_s": 2.0000000000000004})),
        replace(job, scene=scene.model_copy(update={"name": "other"})),
    ]
    assert len({build_job_key(other) for other in [job, *others]}) == 8
    described = replace(job, scene=scene.model_copy(update={"description": "words"}), refinement=3)
    assert build_job_key(described) == build_job_key(job)


@pytest.mark.skipif(importlib.util.find_spec("distributed") is None, reason="distributed, extra cluster, is missing")
@pytest.mark.filterwarnings("ignore")  # the client that gives up leaves sockets behind, too
def test_missing_dask_scheduler_is_reported_with_its_address(monkeypatch: pytest.MonkeyPatch) -> None:
    """If no Dask scheduler answers at an address, ClusterPool raises a ClusterError that names the address."""
    from carom.execution import cluster

    monkeypatch.setattr(cluster, "CONNECT_S", 0.1)
    with pytest.raises(cluster.ClusterError, match=r"no Dask scheduler at tcp://127\.0\.0\.1:9"):
        cluster.ClusterPool("tcp://127.0.0.1:9")


#: For tests with a certificate.
needs_openssl = pytest.mark.skipif(
    shutil.which("openssl") is None, reason="the certificates are made by the command openssl"
)


@pytest.fixture(scope="module")
def certificate(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """A certificate that vouches for itself, and its key, as Dask's configuration has them."""
    folder = tmp_path_factory.mktemp("tls")
    cert, key = str(folder / "cert.pem"), str(folder / "key.pem")
    command = ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj", "/CN=127.0.0.1"]
    subprocess.run([*command, "-keyout", key, "-out", cert], check=True, capture_output=True)
    roles = {f"distributed.comm.tls.{role}": {"cert": cert, "key": key} for role in ("client", "scheduler", "worker")}
    return {"distributed.comm.tls.ca-file": cert, **roles}  # type: ignore[dict-item] # Dask's are nested


@pytest.fixture(scope="module")
def scheduler_address(certificate: dict[str, str]) -> Iterator[str]:
    """Where the scheduler of a cluster with one worker listens, on this machine."""
    dask: Any = importlib.import_module("dask")
    distributed: Any = importlib.import_module("distributed")
    options = {"n_workers": 1, "threads_per_worker": 1, "protocol": "tls://", "dashboard_address": None}
    with dask.config.set(certificate):
        security = distributed.Security(require_encryption=True)
        with distributed.LocalCluster(**options, security=security, silence_logs=50) as cluster:
            yield cluster.scheduler_address


def run_sweep(pool: Pool, path: Path) -> list[bytes]:
    scene = staged("three", *(disc_at(3.0 * k, 0.1 * k, 1.0 - k, 0.0) for k in range(3)), duration_s=3.0)
    with score_journal(path) as journal:
        score_jobs([Job(scene, Method("pit", "tuned"), 0.1 / k) for k in (1, 2, 3)], pool, journal)
    return read_canonical_lines(path)


@pytest.mark.long
@needs_openssl
def test_cluster_with_tls_needs_a_certificate(
    scheduler_address: str, certificate: dict[str, str], tmp_path: Path
) -> None:
    """A sweep over TLS gives the journal of a local sweep; without a certificate or TLS there is a ClusterError."""
    dask: Any = importlib.import_module("dask")
    assert scheduler_address.startswith("tls://")
    with dask.config.set(certificate), ClusterPool(scheduler_address) as pool:
        assert run_sweep(pool, tmp_path / "tls.jsonl") == run_sweep(InProcessPool(), tmp_path / "here.jsonl")
    none = {f"distributed.comm.tls.{role}": {"cert": None, "key": None} for role in ("client", "scheduler", "worker")}
    for protocol in ("tls", "tcp"):
        with (
            dask.config.set({"distributed.comm.tls.ca-file": None, **none}),
            pytest.raises(ClusterError, match="no Dask"),
        ):
            ClusterPool(scheduler_address.replace("tls://", f"{protocol}://"))
