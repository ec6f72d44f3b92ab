"""A cluster that speaks TLS: the certificates are those that Dask's own configuration names."""

from __future__ import annotations

import importlib
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from carom import Disc, Scene
from carom.runs.cluster import ClusterError, ClusterPool
from carom.runs.job import Job, Method
from carom.runs.journal import canonical
from carom.runs.pool import InProcess, Pool
from carom.runs.scoring import score_journal, sweep

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(shutil.which("openssl") is None, reason="the certificates are made by the command openssl"),
]


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
def address(certificate: dict[str, str]) -> Iterator[str]:
    """Where the scheduler of a cluster with one worker listens, on this machine."""
    dask: Any = importlib.import_module("dask")
    distributed: Any = importlib.import_module("distributed")
    with (
        dask.config.set(certificate),
        distributed.LocalCluster(
            n_workers=1,
            threads_per_worker=1,
            protocol="tls://",
            security=distributed.Security(require_encryption=True),
            dashboard_address=None,
            silence_logs=50,
        ) as cluster,
    ):
        yield cluster.scheduler_address


def swept(pool: Pool, path: Path) -> list[bytes]:
    discs = [Disc(position_m=(3.0 * k, 0.1 * k), velocity_m_s=(1.0 - k, 0.0), radius_m=0.5) for k in range(3)]
    scene = Scene(name="three", discs=discs, duration_s=3.0)
    with score_journal(path) as journal:
        sweep([Job(scene, Method("pit", "tuned"), 0.1 / k) for k in (1, 2, 3)], pool, journal)
    return canonical(path)


def test_a_cluster_with_tls_gives_the_same_journal(address: str, certificate: dict[str, str], tmp_path: Path) -> None:
    """Over TLS, with the certificates of Dask's configuration, a sweep yields what it yields in this process."""
    dask: Any = importlib.import_module("dask")
    assert address.startswith("tls://")
    with dask.config.set(certificate), ClusterPool(address) as pool:
        assert swept(pool, tmp_path / "tls.jsonl") == swept(InProcess(), tmp_path / "here.jsonl")


@pytest.mark.usefixtures("certificate")
@pytest.mark.parametrize("protocol", ["tls", "tcp"])
def test_without_a_certificate_nobody_gets_in(address: str, protocol: str) -> None:
    """Without certificates, and without TLS, a sentence says that the scheduler does not answer."""
    dask: Any = importlib.import_module("dask")
    none = {f"distributed.comm.tls.{role}": {"cert": None, "key": None} for role in ("client", "scheduler", "worker")}
    with (
        dask.config.set({"distributed.comm.tls.ca-file": None, **none}),
        pytest.raises(ClusterError, match="no Dask scheduler answers at"),
    ):
        ClusterPool(address.replace("tls://", f"{protocol}://"))
