"""`carom engines`: list the engines, show one in full, or print its settings as code of its own."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from carom.cli.command_line import command_line
from carom.cli.common import (
    engines_named,
    guarded,
    plain_scenes_named,
    print_document,
    say,
    say_lines,
    seconds,
)

if TYPE_CHECKING:
    from carom.model.scene import Scene


@guarded
def engines(
    names: Annotated[
        list[str] | None,
        typer.Argument(help="Engines to show in full, by name; or the one whose settings --show prints."),
    ] = None,
    show: Annotated[
        str | None,
        typer.Option(
            "--show", metavar="PROFILE", help="Print this profile as code of the engine's own, to paste or to run."
        ),
    ] = None,
    dt: Annotated[str | None, typer.Option("--dt", help="With --show: step in seconds. A frame by default.")] = None,
    restitution: Annotated[float | None, typer.Option("--restitution", help="With --show: of every contact.")] = None,
    friction: Annotated[float | None, typer.Option("--friction", help="With --show: of every contact.")] = None,
    scene: Annotated[
        str | None,
        typer.Option("--scene", help="With --show: a scene file or a scene's name. Two discs and a floor by default."),
    ] = None,
) -> None:
    """List the engines, a line each; show one in full; or print its settings as code of its own."""
    from carom.errors import InputError
    from carom.execution.engines import engines as known_engines
    from carom.report.lists import engine_lines, engine_page

    names = engines_named(names)
    if show is not None:
        if names is None or len(names) != 1:
            raise InputError("--show prints the settings of one engine: carom engines NAME --show PROFILE")
        from carom.execution.settings_code import write_code

        shown = _scene(scene, restitution, friction)
        dt_s = 1.0 / shown.frame_rate_hz if dt is None else seconds(dt)
        say(write_code(names[0], show, shown, dt_s, command=command_line()).rstrip("\n"))
        return
    if any(option is not None for option in (dt, restitution, friction, scene)):
        raise InputError("--dt, --restitution, --friction and --scene go with --show")
    if names:
        for info in known_engines(names):
            print_document(engine_page(info))
        return
    say_lines(engine_lines(known_engines()))


def _scene(name: str | None, restitution: float | None, friction: float | None) -> Scene:
    """Return the scene that is asked for, with these coefficients instead of its own where they are given."""
    from carom.errors import InputError
    from carom.execution.settings_code import example_scene
    from carom.model.scene import Scene

    found = [example_scene()] if name is None else plain_scenes_named([name])
    if len(found) != 1:
        raise InputError(f"--scene must name one scene, and {name!r} names {len(found)}")
    given = {
        **({} if restitution is None else {"restitution": restitution, "wall_restitution": restitution}),
        **({} if friction is None else {"friction": friction, "wall_friction": friction}),
    }
    return Scene(**{**dict(found[0]), **given})
