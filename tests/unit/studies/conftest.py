"""Fixtures of other packages' tests that the tests of studies use."""

from tests.unit.execution.conftest import hostile, install
from tests.unit.report.conftest import nasty, not_run, results

__all__ = ["hostile", "install", "nasty", "not_run", "results"]
