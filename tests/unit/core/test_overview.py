"""The overview in `carom_core.h` lists every file of the core, and no file that does not exist."""

from __future__ import annotations

import re
from pathlib import Path

CORE = Path(__file__).parents[3] / "src/carom/core"
SUFFIXES = (".h", ".c", ".pyx", ".pxd", ".pyi")


def test_the_overview_lists_every_file() -> None:
    """A line lists one file, or one name with several suffixes."""
    text = (CORE / "carom_core.h").read_text(encoding="utf-8")
    overview = text[text.index("FILES.") : text.index("*/")]
    listed = set()
    for name, more in re.findall(r"^     ([\w/]+\.\w+)((?:, \.\w+)*)", overview, re.MULTILINE):
        listed |= {name} | {Path(name).with_suffix(suffix).as_posix() for suffix in re.findall(r"\.\w+", more)}
    files = {path.relative_to(CORE).as_posix() for path in CORE.rglob("*") if path.suffix in SUFFIXES}
    assert listed == files - {"carom_core.h"}
