"""What every process of a test run does first. The one that only distributes tests to others loads nothing else."""

import os
import sys
import tempfile
from pathlib import Path

import pytest

from carom.core import extension
from carom.core.built import DIGEST

#: Where files are in memory on Linux, and how much of it the tests may need at most, sparse files and all.
MEMORY = Path("/dev/shm")  # noqa: S108 - each session has a folder of its own in it
ROOM_BYTES = 2**30


def is_short(config: pytest.Config) -> bool:
    """Whether long tests are left out."""
    return sys.platform == "linux" and str(config.getoption("markexpr")).startswith("not long")


def pytest_configure(config: pytest.Config) -> None:
    """Refuse to test an extension that was built from other sources than those next to it.

    Let short tests write in memory where it has room, unless a folder is set: each line of a journal waits for a disk.
    """
    if extension.compute_sources_digest() != DIGEST:
        raise pytest.UsageError(
            "the compiled extension was built from other .pyx, .pxd, .h or .c files than those here; build it again: "
            f"{sys.executable} setup.py build_ext --inplace --force"
        )
    if is_short(config) and MEMORY.is_dir() and "TMPDIR" not in os.environ:
        room = os.statvfs(MEMORY)
        if room.f_bavail * room.f_frsize > ROOM_BYTES and not room.f_flag & os.ST_NOEXEC:
            os.environ["TMPDIR"], tempfile.tempdir = str(MEMORY), None
    only_distributes = config.getoption("dist", "no") != "no" and not hasattr(config, "workerinput")
    if not only_distributes:
        config.pluginmanager.import_plugin("tests.session")
