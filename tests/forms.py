"""Both forms of what is compiled: a test that compares them, or needs one of them, chooses it here."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from carom import extension

#: For a test that compares the compiled form with another. The suite passes without a compiler, too: see conftest.py.
needs_extension = pytest.mark.skipif(not extension.extension_available(), reason="the compiled extension is not built")


@contextmanager
def plain_form() -> Iterator[None]:
    """Let plain Python serve in this block, as it does where there is no compiler."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(extension.PLAIN_VARIABLE, "1")
        extension.extension_available.cache_clear()
        yield
    extension.extension_available.cache_clear()
