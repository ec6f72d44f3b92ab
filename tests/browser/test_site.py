"""The site of the documents, opened from files."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from playwright.sync_api import expect
from tests.browser.conftest import Window
from tests.processes import PATIENT_S

pytestmark = pytest.mark.browser

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the built site."""
    folder = tmp_path_factory.mktemp("site")
    build = [sys.executable, "-m", "mkdocs", "build", "--quiet", "--site-dir", str(folder)]
    subprocess.run(build, check=True, cwd=ROOT, timeout=PATIENT_S, env=os.environ | {"NO_MKDOCS_2_WARNING": "1"})
    return folder


def test_search_works_from_files_without_network(window: Window, site: Path) -> None:
    """A search on the site opened from files finds the page on tunnelling, and nothing is fetched."""
    page = window(site / "index.html")
    page.locator("input.md-search__input").fill("tunnelling")
    expect(page.locator(".md-search-result__item").first).to_contain_text("My objects pass through each other")
