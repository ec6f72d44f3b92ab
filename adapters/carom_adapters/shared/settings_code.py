"""Helpers of adapters that write programs: comments, arguments, assignments, and lines for several engines."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence

from carom.engines.api import Disc, Scene, Setting

#: Last lines of a Python program, which run all steps, and print one line ``x y vx vy spin`` for each disc.
PYTHON_END = "for _ in range(steps):\n    {step}\nfor body in discs:\n    print({state})\n"


def format_comment(text: str, sign: str = "# ") -> str:
    """Return a text as comment lines of at most 100 characters."""
    return "\n".join(
        f"{sign}{line}"
        for one in text.splitlines()
        for line in textwrap.wrap(one, 100 - len(sign), break_on_hyphens=False)
    )


def format_arguments(values: Mapping[str, object]) -> str:
    """Return values as keyword arguments. Floats keep all bits."""
    return ", ".join(f"{name}={value!r}" for name, value in values.items())


def format_assignments(owner: str, settings: Mapping[str, Setting], names: Sequence[str]) -> str:
    """Return lines of code that set attributes of the object `owner` to the given settings with names in `names`."""
    return "".join(f"{owner}.{name} = {settings[name]!r}\n" for name in names if name in settings)


def count_steps(scene: Scene, settings: Mapping[str, Setting]) -> int:
    """Return the number of steps of a scene."""
    return scene.step_count(float(settings["dt_s"]))


def format_disc(disc: Disc, arguments: Mapping[str, object]) -> str:
    """Return the line that adds a disc. `arguments` follow the disc's position and radius."""
    return f"add_disc({disc.position_m!r}, {disc.radius_m!r}{', ' * bool(arguments)}{format_arguments(arguments)})"


def format_body_lines(scene: Scene) -> str:
    """Return the lines that add half-planes and discs that can't turn. Movable discs have a mass argument."""
    discs = (
        format_disc(disc, ({} if disc.immovable else {"mass": disc.mass_kg}) | {"velocity": disc.velocity_m_s})
        for disc in scene.discs
    )
    return "\n".join([*discs, *(f"add_wall({wall.point_m!r}, {wall.normal!r})" for wall in scene.half_planes())])
