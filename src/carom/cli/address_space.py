"""Checks that address space (`ulimit -v`) suffices for NumPy.

If the address space is too small, NumPy ends the process without a message.
"""

from __future__ import annotations

import os
import sys

from carom.errors import InputError

#: Fraction of the limit that imports may use. The run uses the rest, and needs at least a third as much memory as the
#: imports.
LOADED = 0.75


def read_limit_mb() -> float:
    """Return the limit on this process's address space, in megabytes; 0 if there is no limit."""
    try:
        import resource
    except ImportError:  # this is not a POSIX system
        return 0.0
    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    return 0.0 if limit == resource.RLIM_INFINITY else limit / 1e6


def require_address_space() -> None:
    """If address space is limited, test in a child process whether NumPy can be loaded.

    NumPy's library OpenBLAS allocates memory while it is loaded. If memory is too small, OpenBLAS ends the process with
    exit code 1 and without a message.

    Raises:
        InputError: NumPy can't be loaded within the limit.
    """
    if not read_limit_mb() or "numpy" in sys.modules:
        return
    child = os.fork()
    if not child:
        code = 1
        try:
            import resource

            resource.setrlimit(resource.RLIMIT_AS, (round(LOADED * 1e6 * read_limit_mb()),) * 2)
            null = os.open(os.devnull, os.O_RDWR)
            os.dup2(null, 1)
            os.dup2(null, 2)
            import numpy as np

            import carom.studies.cross_check.run  # noqa: F401 - imported to measure its memory

            np.ones((2, 2)) @ np.ones((2, 2))
            code = 0
        finally:
            os._exit(code)
    _, status = os.waitpid(child, 0)
    if status:
        limit = f"{read_limit_mb():.0f} MB of address space (ulimit -v)"
        raise InputError(f"NumPy can't be loaded within {limit}; raise the limit")
