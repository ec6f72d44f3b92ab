"""The hostile adapters of the runs' tests and the cross-checks of the pages', for the studies, too."""

from tests.unit.execution.conftest import hostile, install
from tests.unit.report.conftest import nasty, not_run, results

__all__ = ["hostile", "install", "nasty", "not_run", "results"]
