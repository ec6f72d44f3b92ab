"""What `import carom` gives, and what it does not cost."""

from __future__ import annotations

import importlib
import subprocess
import sys
from types import ModuleType

import pytest

import carom


@pytest.mark.parametrize("name", carom.__all__)
def test_every_public_name_resolves_to_the_object_of_its_home_module(name: str) -> None:
    """Each name in `carom.__all__` is what its home module calls so, never a module that hides it, and is in `dir`."""
    thing = getattr(carom, name)
    assert not isinstance(thing, ModuleType)
    home = importlib.import_module(thing.__module__)
    assert getattr(home, name) is thing
    assert name in dir(carom)


def test_public_names_are_sorted_and_unique() -> None:
    """The list of public names is in order, so that a reader finds a name and a merge adds it once."""
    assert sorted(set(carom.__all__)) == carom.__all__


def test_unknown_attribute_is_an_attribute_error_that_names_it() -> None:
    """A misspelt name fails the way it fails in any module."""
    with pytest.raises(AttributeError, match="module 'carom' has no attribute 'sovle_pic'"):
        _ = carom.sovle_pic


def test_import_costs_nothing() -> None:
    """`import carom` imports neither NumPy nor Pydantic nor any optional part nor any engine."""
    program = (
        "import sys; before = set(sys.modules); import carom; new = {m.partition('.')[0] for m in set(sys.modules)"
        " - before}; heavy = new - set(sys.stdlib_module_names) - {'carom'}; print(sorted(heavy))"
    )
    result = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert result.stdout.strip() == "[]"
