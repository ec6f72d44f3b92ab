"""What `import carom` gives, and what it does not cost."""

from __future__ import annotations

import importlib
import subprocess
import sys
from types import ModuleType

import pytest

import carom


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
