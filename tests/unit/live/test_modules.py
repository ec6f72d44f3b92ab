"""The modules of the page become one script: each stands after those that it imports, and finds what it names."""

from __future__ import annotations

import re
import shutil
import subprocess
from itertools import pairwise
from pathlib import Path

import pytest

from carom.live import page

_IMPORT = re.compile(r'^import (?:\{([^}]*)\} from )?"\./(\w+)\.js";$', re.MULTILINE)
_EXPORT = re.compile(r"^export (?:(?:async )?function\*?|class) (\w+)|^export \{([^}]*)\}", re.MULTILINE)
_CONSTANTS = re.compile(r"^export const (.*?);(?: //[^\n]*)?$", re.MULTILINE | re.DOTALL)


def _names(listed: str) -> set[str]:
    return {name.split(" as ")[-1].strip() for name in listed.split(",") if name.strip()}


def test_each_module_imports_what_there_is_from_a_module_before_it() -> None:
    """A name that no module exports, or a circle of imports, is found here and not by who opens the page."""
    exported: dict[str, set[str]] = {}
    for module in page.MODULES:
        text = (page.SOURCES / f"{module}.js").read_text(encoding="utf-8")
        imports = _IMPORT.findall(text)
        assert len(imports) == len(re.findall(r"^import\b", text, re.MULTILINE)), f"{module}: an import is not read"
        for listed, source in imports:
            assert source in exported, f"{module} imports {source}, which comes after it"
            assert _names(listed) <= exported[source], f"{module} imports from {source} what that does not export"
        single = {name for name, _ in _EXPORT.findall(text) if name}
        listed_names = set().union(*(_names(listed) for _, listed in _EXPORT.findall(text)))
        constants = set(re.findall(r"(?:^|,\n  )(\w+) =", "\n".join(_CONSTANTS.findall(text)), re.MULTILINE))
        exported[module] = single | listed_names | constants


def test_no_two_modules_give_one_name_to_different_things(tmp_path: Path) -> None:
    """The modules are one script in the page, in which a name that is declared twice is an error."""
    script = tmp_path / "page.mjs"
    script.write_text(page.page_script(), encoding="utf-8")
    node = shutil.which("node") or pytest.skip("there is no node here to read the script")
    done = subprocess.run([node, "--check", script], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_every_module_is_in_the_page() -> None:
    """What lies beside the others is loaded; the loader stands on its own, before them."""
    assert {path.stem for path in page.SOURCES.glob("*.js")} == {*page.MODULES, "loader"}
    assert all(first != second for first, second in pairwise(page.MODULES))
