"""Measures the processor cores and the memory that this process may use."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path


def count_available_cores() -> int:
    """Return the number of cores that this process may use. The machine can have more cores."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def measure_available_memory() -> int:
    """Return the machine's memory or, in a container, the memory limit, in bytes."""
    total_bytes = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    with suppress(OSError, ValueError):  # no control group, or one without a memory limit
        total_bytes = min(total_bytes, int(Path("/sys/fs/cgroup/memory.max").read_text(encoding="ascii")))
    return total_bytes
