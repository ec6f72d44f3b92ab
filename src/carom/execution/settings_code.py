"""Writes a scene with the settings of a profile as code for the engine, which users can paste into their programs.

The adapter writes the code, in a worker process.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass

from carom.engines.api import CodedAdapter, unsupported_reason
from carom.engines.registry import load_adapter, require_profile
from carom.errors import AdapterError
from carom.execution.adapter_profile import capabilities_of, prepare_settings
from carom.execution.describe_engines import describe_engines
from carom.execution.exception_text import describe_exception
from carom.execution.job import AdapterTask, SettingOverrides, Status, UnsupportedError
from carom.execution.pool import LocalPool, Pool
from carom.execution.validate_adapter import to_plain_text
from carom.model.scene import Disc, Scene, Wall

#: Largest number of characters of a program: a line of 100 characters for each of 100,000 discs.
MOST_CODE = 10_000_000


def build_example_scene() -> Scene:
    """Return a scene with two discs and a floor, for users who want the settings as code but give no scene."""
    moving = Disc(position_m=(0.0, 0.6), velocity_m_s=(1.0, -0.5), radius_m=0.2)
    resting = Disc(position_m=(1.0, 0.5), radius_m=0.2)
    floor = Wall(point_m=(0.0, 0.0), normal=(0.0, 1.0))
    return Scene(name="two discs and a floor", discs=[moving, resting], walls=[floor], duration_s=1.0)


@dataclass(frozen=True)
class _CodeTask(AdapterTask):
    """Writes a scene with the settings of a profile as code, with the engine's adapter."""

    profile: str
    scene: Scene
    dt_s: float
    heading: str
    overrides: SettingOverrides = ()
    #: Whether the task refuses a scene that is beyond the profile's capabilities.
    limited: bool = True

    def carry_out(self) -> str:
        """Return the code.

        Raises:
            UnsupportedError: The adapter's capabilities exclude the scene.
            AdapterError: The adapter refuses the scene, or fails.
        """
        adapter = load_adapter(self.engine)
        settings = prepare_settings(adapter, self.profile, self.dt_s, self.overrides)
        capabilities = capabilities_of(adapter, self.profile)
        if self.limited and (reason := unsupported_reason(self.scene, capabilities, self.dt_s, located=False)):
            raise UnsupportedError(reason)
        if not isinstance(adapter, CodedAdapter):
            raise AdapterError("the adapter has no method code()")
        try:
            return to_plain_text(adapter.code(self.scene, settings, self.heading), "code()", MOST_CODE)
        except AdapterError:
            raise
        except Exception as error:
            raise AdapterError(f"code() of {self.engine} fails: {describe_exception(error)}") from error


def write_code(engine: str, profile: str, scene: Scene, dt_s: float, *, command: str = "") -> str:
    """Return a scene with a profile's settings as code of the engine. The engine need not be installed.

    Args:
        engine: Name of the adapter.
        profile: Name of one of its profiles.
        scene: The scene.
        dt_s: Step size, in seconds.
        command: The command line that writes this code. The heading of the code quotes this command line.

    Raises:
        UnknownNameError: There is no such engine or profile.
        AdapterError: The adapter writes no code, Carom shortens the profile's steps, or the engine does not support the
            scene.
    """
    with LocalPool(1) as pool:
        (info,) = describe_engines([engine], pool)
        if info.capabilities is None:
            raise AdapterError(info.unavailable)
        require_profile(engine, profile, info.profiles)
        if not info.code:
            able_names = ", ".join(one.name for one in describe_engines(None, pool) if one.code)
            raise AdapterError(f"the adapter {engine!r} cannot print settings as code; adapters that can: {able_names}")
        if profile in info.located:
            other_profiles = ", ".join(name for name in info.profiles if name not in info.located)
            why = "Carom shortens its steps, which no setting of the engine does"
            problem = f"profile {profile!r} of {engine} cannot be printed as code: {why}"
            raise AdapterError(f"{problem}; profiles that can: {other_profiles}")
        version = f" {info.version}" if info.version else ""
        origin = f"{info.engine}{version}, profile '{profile}' of Carom at steps of {dt_s!r} s"
        heading = f"{origin}: {info.profiles[profile]}\nScene: {scene.name}."
        heading += f"\nMade by: {command}" if command else ""
        answer = pool.run(_CodeTask(engine, profile, scene, dt_s, heading))
    if answer.value is None:
        why = answer.reason if answer.status is Status.FAILED else answer.problem
        raise AdapterError(f"{engine}: {why}")
    return answer.value


def find_step_code(engine: str, profile: str, scene: Scene, dt_s: float, pool: Pool) -> str:
    """Return the lines of an engine's code that set the step size and the number of steps per frame.

    Args:
        engine: Name of the adapter.
        profile: Name of one of its profiles.
        scene: The scene, with its frame rate.
        dt_s: Step size, in seconds.
        pool: Pool in which the adapter runs; the caller closes it.

    Returns:
        The lines; empty if there are none, or the adapter writes no code for this scene.
    """
    frame = Scene(**{**dict(scene), "duration_s": 1.0 / scene.frame_rate_hz})
    tasks = [_CodeTask(engine, profile, frame, step_s, "A frame.") for step_s in (dt_s, dt_s / 2)]
    code, finer_code = (pool.run(task).value for task in tasks)
    return "" if code is None or finer_code is None else find_step_lines(code, finer_code)


def find_changed_code(
    engine: str, profile: str, overrides: SettingOverrides, scene: Scene, dt_s: float, pool: Pool
) -> str:
    """Return the lines of an engine's code that change if the settings in `overrides` replace the profile's settings.

    Args:
        engine: Name of the adapter.
        profile: Name of one of its profiles.
        overrides: Settings that are used instead of the profile's settings.
        scene: The scene.
        dt_s: Step size, in seconds.
        pool: Pool in which the adapter runs; the caller closes it.

    Returns:
        The lines; empty if there are none, or the adapter writes no code for this scene.
    """
    tasks = [_CodeTask(engine, profile, scene, dt_s, "Found.", settings, limited=False) for settings in (overrides, ())]
    code, profile_code = (pool.run(task).value for task in tasks)
    return "" if code is None or profile_code is None else find_changed_lines(code, profile_code)


_COMMENT = re.compile(r"<!--.*?-->\s*", re.DOTALL)


def find_step_lines(code: str, at_another_step: str) -> str:
    """Return the statements of a program, or the lines of a model, that depend on the step size.

    - Python: statements that set or use `dt` or `steps`, statements that differ with another step size, and the
      constants that all these statements use. The scene's bodies are left out.
    - XML: lines that differ with another step size.
    - JavaScript: no lines, since the adapter writes a complete module that steps its own world.

    Args:
        code: Code of a scene, as written by an adapter (`carom.engines.api.CodedAdapter`).
        at_another_step: Code of the same scene with another step size.

    Returns:
        The lines as they appear in the code; empty if there are none.
    """
    if code.startswith("<"):
        return find_changed_lines(code, at_another_step)
    if not code.startswith("#"):
        return ""
    statements, other = _split_statements(code), {source for source, _ in _split_statements(at_another_step)}
    own_functions = {one.name for _, one in statements if isinstance(one, ast.FunctionDef)}
    chosen: list[str] = []
    changed_names: set[str] = set()
    # Statements are visited from the last to the first, so that the uses of a name are found before its assignment.
    for source, statement in reversed(statements):
        if isinstance(statement, ast.FunctionDef) or own_functions & (names := set(_find_names(statement, ast.Load))):
            continue
        assigned = set(_find_names(statement, ast.Store))
        decides = bool((names | assigned) & {"dt", "steps"}) or source not in other
        plain = isinstance(statement, ast.Assign) and isinstance(statement.value, ast.Constant)
        if decides or (plain and assigned & changed_names):
            chosen.insert(0, source)
            changed_names |= names
    return "\n".join(chosen)


def find_changed_lines(code: str, before: str) -> str:
    """Return the statements of a Python program, or the lines of another text, that differ from an earlier version.

    For a program, also return each statement that uses a name assigned by a changed statement. Comments are left out.
    """
    if not code.startswith("#"):
        model = code.startswith("<")
        new_code, old_code = (_COMMENT.sub("", text) if model else text for text in (code, before))
        other = set(old_code.splitlines())
        lines = (line.strip() for line in new_code.splitlines() if line not in other)
        return "\n".join(line for line in lines if model or not line.startswith("//"))
    statements, other = _split_statements(code), {source for source, _ in _split_statements(before)}
    assigned = {name for source, one in statements if source not in other for name in _find_names(one, ast.Store)}
    chosen = (source for source, one in statements if source not in other or assigned & {*_find_names(one, ast.Load)})
    return "\n".join(chosen)


def _split_statements(code: str) -> list[tuple[str, ast.stmt]]:
    """Return the statements of a program, each with its source."""
    return [(ast.get_source_segment(code, statement) or "", statement) for statement in ast.parse(code).body]


def _find_names(statement: ast.stmt, context: type[ast.expr_context]) -> Iterator[str]:
    for node in ast.walk(statement):
        if isinstance(node, ast.Name) and isinstance(node.ctx, context):
            yield node.id
