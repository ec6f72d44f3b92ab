"""How settings become code to paste: comments, literals, and the words that several engines' programs share."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence

from carom.engines.api import Scene, Setting

#: The last lines of a program in Python: it prints each disc at the end, a line of ``x y vx vy spin``.
PYTHON_END = "for _ in range(steps):\n    {step}\nfor body in discs:\n    print({state})\n"


def comment(text: str, sign: str = "# ") -> str:
    """Return a text as comment lines of at most 100 letters."""
    return "\n".join(
        f"{sign}{line}"
        for one in text.splitlines()
        for line in textwrap.wrap(one, 100 - len(sign), break_on_hyphens=False)
    )


def arguments(values: Mapping[str, object]) -> str:
    """Return values as keyword arguments; `repr` keeps every bit of a float."""
    return ", ".join(f"{name}={value!r}" for name, value in values.items())


def assignments(of: str, settings: Mapping[str, Setting], names: Sequence[str]) -> str:
    """Return a line a setting that is given, which sets the attribute of that name."""
    return "".join(f"{of}.{name} = {settings[name]!r}\n" for name in names if name in settings)


def steps_of(scene: Scene, settings: Mapping[str, Setting]) -> int:
    """Return how many steps cover a scene."""
    return scene.step_count(float(settings["dt_s"]))
