"""Exit codes of the commands."""

from __future__ import annotations

import signal
from enum import IntEnum


class ExitCode(IntEnum):
    """Exit codes other than 0."""

    VIOLATION = 1  # a run has a grade that the command must report as a failure
    BAD_INPUT = 2  # wrong arguments, options or files, or a system without the needed disk space or memory
    UNAVAILABLE = 3  # a requested engine can't be used
    CRASHED = 4  # a requested engine or its adapter failed
    SIGNAL = 128  # a signal ended the command; as in shells, the signal's number is added
    INTERRUPTED = 128 + signal.SIGINT  # Ctrl-C
