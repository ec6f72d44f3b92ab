"""What tells a job from all others: in a journal, in any study, on any machine."""

from __future__ import annotations

import hashlib
import platform
from dataclasses import dataclass
from functools import cache, lru_cache
from importlib import metadata

from carom.engines.registry import adapter_points
from carom.execution.engines import find_engine
from carom.execution.job import Job, Method
from carom.model.scene import Scene


@dataclass(frozen=True)
class JobKey:
    """What tells a job from all others, in any sweep on any machine.

    Attributes:
        scene: Its scene's name, for readers.
        scene_sha256: Hash of all that the scene is made of, its name included.
        method: Engine and profile.
        dt_s: Step, seconds.
        phase: Part of a step by which the scene begins earlier.
        versions: Name and version of all that the numbers depend on, in order of name.
        form: What else is asked of it, such as "drawn" or "timed"; empty where that is nothing.
    """

    scene: str
    scene_sha256: str
    method: Method
    dt_s: float
    phase: float
    versions: tuple[tuple[str, str], ...]
    form: str = ""


@lru_cache(maxsize=64)
def scene_hash(scene: Scene) -> str:
    """Return the SHA-256 of a scene: of every field but the description, each float to the bit."""
    # Pydantic writes each float as the shortest text that reads back as the same one.
    return hashlib.sha256(scene.model_dump_json(exclude={"description"}).encode()).hexdigest()


@cache
def versions_of(engine: str) -> tuple[tuple[str, str], ...]:
    """Return name and version of all that an engine's numbers depend on; an engine that is missing has an empty one."""
    found = [
        ("carom", metadata.version("carom")),
        ("numpy", metadata.version("numpy")),
        (platform.python_implementation(), platform.python_version()),
    ]
    if engine not in adapter_points():
        return ()
    info = find_engine(engine)
    return tuple(sorted(found if info.engine == "Carom" else [*found, (info.engine, info.version)]))


def job_key(job: Job, form: str = "") -> JobKey:
    """Return the key of a job on this machine; see `JobKey.form`.

    An engine that nobody has described yet is asked for its version here, in a process with the usual limits.
    """
    scene = job.scene
    return JobKey(scene.name, scene_hash(scene), job.method, job.dt_s, job.phase, versions_of(job.engine), form)
