"""On what a result was obtained: machine, versions, time; stamped on every result."""

from __future__ import annotations

import platform
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path

from carom.engines.registry import EngineInfo
from carom.support.system import available_cores


@dataclass(frozen=True)
class Environment:
    """Machine and versions of a run.

    Attributes:
        date: UTC, ISO 8601, to the second.
        carom: Version of Carom.
        python: Implementation and version.
        system: Operating system, architecture and C library, whose rounding of elementary functions can differ.
        processor: Name of the processor.
        cores: Number of cores that this process may use.
        versions: Version of every distribution that takes part, by name.
    """

    date: str
    carom: str
    python: str
    system: str
    processor: str
    cores: int
    versions: Mapping[str, str]

    @property
    def machine(self) -> tuple[str, str, int]:
        """What run times depend on in addition to versions: system, processor and number of cores."""
        return (self.system, self.processor, self.cores)


def environment(infos: Iterable[EngineInfo] = ()) -> Environment:
    """Return what this process runs on, with the versions of the engines that take part."""
    engines = {info.engine: info.version for info in infos if info.available and info.engine != "Carom"}
    return Environment(
        date=datetime.now(UTC).isoformat(timespec="seconds"),
        carom=metadata.version("carom"),
        python=f"{platform.python_implementation()} {platform.python_version()}",
        system=" ".join([platform.system(), platform.machine(), *platform.libc_ver()]).strip(),
        processor=_told("/proc/cpuinfo", "model name") or platform.processor() or "unknown",
        cores=available_cores(),
        versions={"numpy": metadata.version("numpy"), **engines},
    )


def resident_bytes(field: str = "VmRSS", process: int | str = "self") -> int | None:
    """Return a process's resident memory: VmRSS is what is so now, VmHWM the most that ever was; None off Linux."""
    kibibytes = _told(f"/proc/{process}/status", field).split()
    return int(kibibytes[0]) * 1024 if kibibytes else None


def _told(path: str, field: str) -> str:
    """Return what Linux tells of a field; empty elsewhere."""
    try:
        lines = Path(path).read_text(encoding="utf-8").splitlines()
    except OSError:
        return ""
    return next((line.partition(":")[2].strip() for line in lines if line.startswith(field)), "")
