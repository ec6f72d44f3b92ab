"""The hostile adapters of the runs' tests and the cross-checks of the pages', for the studies, too."""

from __future__ import annotations

from tests.unit.pages.conftest import nasty, not_run, results
from tests.unit.runs.conftest import hostile, install

__all__ = ["hostile", "install", "nasty", "not_run", "results"]
