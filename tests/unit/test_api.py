"""What `import carom` gives, what it does not cost, and that the site has everything in it."""

from __future__ import annotations

import importlib
import re
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

import carom
import carom.adapter

DOCS = Path(__file__).resolve().parents[2] / "docs"


def test_every_public_name_resolves_to_the_object_of_its_home_module() -> None:
    """Each is what its home module calls so, never a module that hides it; `__all__` has each once, in order."""
    for name in carom.__all__:
        thing = getattr(carom, name)
        assert not isinstance(thing, ModuleType), name
        assert getattr(importlib.import_module(thing.__module__), name) is thing
    assert set(carom.__all__) <= set(dir(carom))
    assert sorted(set(carom.__all__)) == carom.__all__


def test_unknown_attribute_is_an_attribute_error_that_names_it() -> None:
    """A misspelt name fails the way it fails in any module."""
    with pytest.raises(AttributeError, match="module 'carom' has no attribute 'sovle_pic'"):
        _ = carom.sovle_pic


def test_import_costs_nothing() -> None:
    """`import carom` imports no other package; a scene that is made and solved, no report and nothing that draws."""
    program = (
        "import sys; before = set(sys.modules); import carom; new = {m.partition('.')[0] for m in set(sys.modules)"
        " - before}; print(sorted(new - set(sys.stdlib_module_names) - {'carom'}));"
        "carom.solve_pic(carom.Scene(name='a', discs=[carom.Disc(position_m=(0, 0), radius_m=1)], duration_s=1));"
        "print([m for m in ('carom.pages', 'matplotlib', 'jinja2', 'rich') if m in sys.modules])"
    )
    result = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert result.stdout.split() == ["[]", "[]"]


def described(page: str) -> list[str]:
    """Return the names that the reference on this page describes."""
    return re.findall(r"^::: (\S+)$", (DOCS / "api" / page).read_text(encoding="utf-8"), re.MULTILINE)


def test_every_public_name_of_carom_is_described_once() -> None:
    """The reference has each name of `carom.__all__`, and of these nothing else."""
    pages = ("carom.md", "scenes.md", "methods.md")
    found = [name.removeprefix("carom.") for page in pages for name in described(page)]
    assert sorted(name for name in found if "." not in name) == carom.__all__


def test_every_public_name_of_the_seam_is_described_once() -> None:
    """What `carom.adapter` shares with `carom` is described there, the rest on the seam's own page."""
    page = (DOCS / "api" / "adapter.md").read_text(encoding="utf-8")
    own = [name.removeprefix("carom.adapter.") for name in described("adapter.md")]
    shared = re.findall(r"\[`\w+`\]\[carom\.(\w+)\]", page)
    assert sorted(own + shared) == sorted(carom.adapter.__all__)


def test_every_decision_is_listed() -> None:
    """The list of decisions has each by its number, in order."""
    listed = re.findall(r"^(\d+)\. \[.+\]\((.+)\)$", (DOCS / "decisions" / "README.md").read_text(), re.MULTILINE)
    assert [name for _, name in listed] == sorted(path.name for path in (DOCS / "decisions").glob("0*.md"))
    assert [int(number) for number, _ in listed] == [int(name[:4]) for _, name in listed]
