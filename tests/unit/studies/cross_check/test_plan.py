"""Jobs of a cross-check, their keys, and a cluster that does not answer."""

import importlib.util
from dataclasses import replace

import pytest
from tests.cases import each
from tests.in_process_pool import InProcessPool
from tests.scene_builders import disc_at, staged

from carom import Scene
from carom.execution import cluster
from carom.execution.cache_key import build_job_key
from carom.execution.job import Job, Method
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
@each("address", ["tcp://127.0.0.1:9", "tls://127.0.0.1:9"])
def test_missing_dask_scheduler_is_reported_with_its_address(address: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """If no Dask scheduler answers, or certificates for TLS are missing, the ClusterError names the address."""
    monkeypatch.setattr(cluster, "CONNECT_S", 0.1)
    with pytest.raises(cluster.ClusterError, match=f"no Dask scheduler at {address}"):
        cluster.ClusterPool(address)
