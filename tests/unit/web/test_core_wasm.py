"""`core.wasm`, the core that the page contains: it is of the sources next to it, and is rebuilt to the same bytes."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from tests.packaging import core_wasm


def test_it_is_of_the_sources() -> None:
    """The digest inside is that of the sources, flags and compiler: ``make generated`` writes the file."""
    assert core_wasm.sources_digest_of(core_wasm.CORE_WASM.read_bytes()) == core_wasm.sources_digest()


@pytest.mark.release
def test_a_build_in_another_folder_has_the_same_bytes(tmp_path: Path) -> None:
    """The pinned compiler makes the committed file of the sources, wherever they are."""
    shutil.copytree(core_wasm.ROOT / "src/carom/core", tmp_path / "src/carom/core")
    assert core_wasm.build(tmp_path) == core_wasm.CORE_WASM.read_bytes()
