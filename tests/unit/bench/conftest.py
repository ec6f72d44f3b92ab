"""The hostile adapters of the runs' tests, for the bench's, too."""

from __future__ import annotations

from tests.unit.runs.conftest import hostile, install

__all__ = ["hostile", "install"]
