"""What docs/play.md says of a first try is what is seen on the page."""

from __future__ import annotations

import pytest
from docs.figures import walkthrough
from playwright.sync_api import Browser

pytestmark = pytest.mark.browser


def test_a_first_try_is_as_it_is_told(browser: Browser) -> None:
    """Every figure and sentence of the steps is what the page says when they are done again; its pictures are there."""
    text = walkthrough.DOCUMENT.read_text(encoding="utf-8")
    assert walkthrough.told(browser) == text.partition(walkthrough.BEGIN)[2].partition(walkthrough.END)[0]
    assert all(walkthrough.picture(name).is_file() for name in ("missed", "found"))
