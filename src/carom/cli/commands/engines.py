"""`carom engines`: list the engines, describe one of them in full, or print the settings of an engine as code."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from carom.cli import arguments, output
from carom.cli.command_line import get_command_line
from carom.errors import InputError

if TYPE_CHECKING:
    from carom.model.scene import Scene


def _declare_show_option(flag: str, text: str) -> Any:
    """Return an option that is only allowed with ``--show``."""
    return typer.Option(flag, help=f"With --show: {text}.")


def engines(
    names: Annotated[
        list[str] | None,
        typer.Argument(help="Engines to describe in full. With --show: the engine whose settings are printed."),
    ] = None,
    show: Annotated[
        str | None,
        typer.Option("--show", metavar="PROFILE", help="Print the settings of this profile as code for the engine."),
    ] = None,
    dt: Annotated[str | None, _declare_show_option("--dt", "step size in seconds (default: one frame)")] = None,
    restitution: Annotated[float | None, _declare_show_option("--restitution", "restitution of every contact")] = None,
    friction: Annotated[float | None, _declare_show_option("--friction", "friction of every contact")] = None,
    scene: Annotated[
        str | None,
        _declare_show_option("--scene", "scene file or catalogue scene (default: two discs and a floor)"),
    ] = None,
) -> None:
    """List engines, describe some in full, or print the settings of one as code."""
    from carom.execution.describe_engines import engines as known_engines
    from carom.report.engine_and_scene_lists import build_engine_document, format_engine_lines

    names = [arguments.parse_engine(name) for name in names or ()]
    if show is not None:
        if len(names) != 1:
            raise InputError("--show needs exactly one engine: carom engines NAME --show PROFILE")
        from carom.execution.settings_code import write_code

        shown_scene = _find_scene(scene, restitution, friction)
        dt_s = 1.0 / shown_scene.frame_rate_hz if dt is None else arguments.parse_step(dt)
        output.print_text(write_code(names[0], show, shown_scene, dt_s, command=get_command_line()).rstrip("\n"))
        return
    if any(option is not None for option in (dt, restitution, friction, scene)):
        raise InputError("--dt, --restitution, --friction and --scene need --show")
    if names:
        for info in known_engines(names):
            output.print_document(build_engine_document(info))
        return
    output.print_lines(format_engine_lines(known_engines()))


def _find_scene(name: str | None, restitution: float | None, friction: float | None) -> Scene:
    """Return the requested scene. A restitution or friction that is not None replaces the scene's value."""
    from carom.execution.settings_code import build_example_scene
    from carom.model.scene import Scene

    found = build_example_scene() if name is None else arguments.load_one_scene(name, "--scene")
    changes = {
        **({} if restitution is None else {"restitution": restitution, "wall_restitution": restitution}),
        **({} if friction is None else {"friction": friction, "wall_friction": friction}),
    }
    return Scene(**{**dict(found), **changes})
