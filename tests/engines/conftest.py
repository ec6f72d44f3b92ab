"""The engines that `make engines` installs: a test of one that is not there is skipped, with the command it lacks.

Every test here is marked `engines`: the default suite passes, and takes as long, whether or not they are installed.
"""

from pathlib import Path

import pytest

HERE = Path(__file__).parent


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark the tests of this folder."""
    here = {path for path in {item.path for item in items} if HERE in path.parents}
    for item in items:
        if item.path in here:
            item.add_marker(pytest.mark.engines)
