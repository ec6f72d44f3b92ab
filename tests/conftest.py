"""Settings for every test.

Property tests draw the same examples in every run, so that a failure is the code's and not the day's. To search
further, run with ``HYPOTHESIS_PROFILE=search``: new examples each time, and many more of them.
"""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator

import pytest
from hypothesis import settings

# Shared machines make deadlines lie: no single example is timed.
settings.register_profile("carom", deadline=None, derandomize=True, max_examples=50)
settings.register_profile("search", deadline=None, max_examples=2000, print_blob=True)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "carom"))


@pytest.fixture
def heard_interrupts() -> Iterator[None]:
    """Let a process that the test starts hear Ctrl-C: tests run in the background of a script inherit deafness."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)
