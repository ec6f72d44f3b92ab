"""Describes the environment in which a result was computed: machine, versions and time."""

from __future__ import annotations

import platform
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from carom.engines.registry import EngineInfo, find_installed_release
from carom.support.system import count_available_cores


@dataclass(frozen=True)
class Environment:
    """Machine and versions of a run.

    Attributes:
        date: Date and time in UTC (ISO 8601), to the second.
        carom: Version of Carom.
        python: Implementation and version.
        system: Operating system, architecture and C library. C libraries can round functions such as the sine
            differently.
        processor: Name of the processor.
        cores: Number of cores that this process may use.
        versions: Version of every distribution that the run uses, by name.
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
        """System, processor and number of cores. Run times depend on the machine and on the versions."""
        return (self.system, self.processor, self.cores)


def describe_environment(infos: Iterable[EngineInfo] = ()) -> Environment:
    """Return the environment of this process, with the versions of the given engines."""
    engines = {info.engine: info.version for info in infos if info.available and info.engine != "Carom"}
    return Environment(
        date=datetime.now(UTC).isoformat(timespec="seconds"),
        carom=find_installed_release("carom"),
        python=f"{platform.python_implementation()} {platform.python_version()}",
        system=" ".join([platform.system(), platform.machine(), *platform.libc_ver()]).strip(),
        processor=_read_proc_field("/proc/cpuinfo", "model name") or platform.processor() or "unknown",
        cores=count_available_cores(),
        versions={"numpy": find_installed_release("numpy"), **engines},
    )


def measure_resident_bytes(field: str = "VmRSS", process: int | str = "self") -> int | None:
    """Return the resident memory of a process; None on systems other than Linux.

    The field VmRSS contains the present value, and VmHWM contains the peak.
    """
    kibibytes = _read_proc_field(f"/proc/{process}/status", field).split()
    return int(kibibytes[0]) * 1024 if kibibytes else None


def _read_proc_field(path: str, field: str) -> str:
    """Return a field of a file in ``/proc``; empty on systems other than Linux."""
    try:
        lines = Path(path).read_text(encoding="utf-8").splitlines()
    except OSError:
        return ""
    return next((line.partition(":")[2].strip() for line in lines if line.startswith(field)), "")
