"""Keys by which journals (files of finished results) find the result of a job.

Jobs with equal keys have the same result on any machine.
"""

from __future__ import annotations

import hashlib
import platform
from dataclasses import dataclass
from functools import cache, lru_cache

from carom.engines.registry import find_installed_release, list_adapter_points
from carom.execution.describe_engines import find_engine
from carom.execution.job import Job, Method
from carom.model.scene import Scene


@dataclass(frozen=True)
class JobKey:
    """Key of a job, with everything that affects the job's result.

    Attributes:
        scene: Name of the scene, for display.
        scene_sha256: Hash of the whole scene, including its name.
        method: Engine and profile.
        dt_s: Step size, in seconds.
        phase: Fraction of a step, 0 to 1, by which the scene's start is moved to an earlier time.
        versions: Name and version of every distribution that affects the result, sorted by name.
        form: Name of the task's extra work, such as "drawn" or "timed"; empty for a plain run.
    """

    scene: str
    scene_sha256: str
    method: Method
    dt_s: float
    phase: float
    versions: tuple[tuple[str, str], ...]
    form: str = ""


@lru_cache(maxsize=64)
def compute_scene_hash(scene: Scene) -> str:
    """Return the SHA-256 of all fields of a scene except the description.

    Floats that differ in any bit count as different.
    """
    # Pydantic writes each float as the shortest text that reads back as the same float.
    return hashlib.sha256(scene.model_dump_json(exclude={"description"}).encode()).hexdigest()


@cache
def find_versions(engine: str) -> tuple[tuple[str, str], ...]:
    """Return names and versions of Python and of all distributions that affect an engine's results.

    The result is empty for an unknown engine.
    """
    versions = [
        ("carom", find_installed_release("carom")),
        ("numpy", find_installed_release("numpy")),
        (platform.python_implementation(), platform.python_version()),
    ]
    if engine not in list_adapter_points():
        return ()
    info = find_engine(engine)
    return tuple(sorted(versions if info.engine == "Carom" else [*versions, (info.engine, info.version)]))


def build_job_key(job: Job, form: str = "") -> JobKey:
    """Return the key of a job on this machine.

    If the engine's version is not known yet, a worker process with default limits queries the version.
    """
    scene = job.scene
    digest, versions = compute_scene_hash(scene), find_versions(job.engine)
    return JobKey(scene.name, digest, job.method, job.dt_s, job.phase, versions, form)
