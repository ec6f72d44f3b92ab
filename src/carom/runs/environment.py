"""On what a result was obtained: machine, versions, time; stamped on every result."""

from __future__ import annotations

import platform
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path

from carom.cores import available_cores

__all__ = ["Environment", "environment"]


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


def environment(distributions: Mapping[str, str]) -> Environment:
    """Return what this process runs on; `distributions` are the engines' names and versions."""
    return Environment(
        date=datetime.now(UTC).isoformat(timespec="seconds"),
        carom=metadata.version("carom"),
        python=f"{platform.python_implementation()} {platform.python_version()}",
        system=" ".join([platform.system(), platform.machine(), *platform.libc_ver()]).strip(),
        processor=_processor(),
        cores=available_cores(),
        versions={"numpy": metadata.version("numpy"), **distributions},
    )


def _processor() -> str:
    try:
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    except OSError:
        pass  # not Linux: what the platform module knows has to do
    return platform.processor() or "unknown"
