"""Settings to paste: a profile of an engine as code of the engine's own, which its adapter writes in a worker."""

from __future__ import annotations

from dataclasses import dataclass

from carom.engines.api import CodedAdapter, unsupported_reason
from carom.engines.registry import load_adapter, require_profile
from carom.errors import AdapterError
from carom.execution.engine_run import capabilities_of, profile_settings
from carom.execution.engines import describe_engines
from carom.execution.exception_text import describe_exception
from carom.execution.job import AdapterTask, SettingOverrides, Status, UnsupportedError
from carom.execution.pool import LocalPool, Pool
from carom.execution.step_code import changed_lines, step_lines
from carom.execution.validate import plain_text
from carom.model.scene import Disc, Scene, Wall

#: Characters of a program: a line of a hundred for each of a hundred thousand discs.
MOST_CODE = 10_000_000


def example_scene() -> Scene:
    """Return a scene with a body of each kind, for who asks for settings and names none of their own."""
    return Scene(
        name="two discs and a floor",
        discs=[
            Disc(position_m=(0.0, 0.6), velocity_m_s=(1.0, -0.5), radius_m=0.2),
            Disc(position_m=(1.0, 0.5), radius_m=0.2),
        ],
        walls=[Wall(point_m=(0.0, 0.0), normal=(0.0, 1.0))],
        duration_s=1.0,
    )


@dataclass(frozen=True)
class _CodeTask(AdapterTask):
    """Ask an adapter to write a scene with a profile's settings as code."""

    profile: str
    scene: Scene
    dt_s: float
    heading: str
    tried: SettingOverrides = ()
    #: Settings that are searched may lift what a profile declares to be its limits.
    limited: bool = True

    def carry_out(self) -> str:
        """Return the code.

        Raises:
            UnsupportedError: The engine does not declare to support the scene.
            AdapterError: The adapter refuses, or fails.
        """
        adapter = load_adapter(self.engine)
        settings = profile_settings(adapter, self.profile, self.dt_s, self.tried)
        able = capabilities_of(adapter, self.profile)
        if self.limited and (reason := unsupported_reason(self.scene, able, self.dt_s, located=False)):
            raise UnsupportedError(reason)
        if not isinstance(adapter, CodedAdapter):
            raise AdapterError("it has no code() any more")
        try:
            return plain_text(adapter.code(self.scene, settings, self.heading), "code()", MOST_CODE)
        except AdapterError:
            raise
        except Exception as error:
            raise AdapterError(f"code() of {self.engine} fails: {describe_exception(error)}") from error


def write_code(engine: str, profile: str, scene: Scene, dt_s: float, *, command: str = "") -> str:
    """Return a scene with a profile's settings as code of the engine's own; the engine need not be installed.

    Args:
        engine: Name of the adapter.
        profile: Name of one of its profiles.
        scene: The scene.
        dt_s: Step, seconds.
        command: The command line that makes it again, for its heading.

    Raises:
        UnknownNameError: There is no such engine or profile.
        AdapterError: The adapter writes no code, the profile's steps are cut, or the scene is beyond the engine.
    """
    with LocalPool(1) as pool:
        (info,) = describe_engines([engine], pool)
        if info.capabilities is None:
            raise AdapterError(info.unavailable)
        require_profile(engine, profile, info.profiles)
        if not info.code:
            able = ", ".join(one.name for one in describe_engines(None, pool) if one.code)
            raise AdapterError(f"the adapter {engine!r} writes no code of its engine; those that do: {able}")
        if profile in info.located:
            others = ", ".join(name for name in info.profiles if name not in info.located)
            cut = "its steps are cut by Carom, which no setting of the engine does"
            raise AdapterError(f"profile {profile!r} of {engine} can't be pasted: {cut}; those that can: {others}")
        version = f" {info.version}" if info.version else ""
        heading = (
            f"{info.engine}{version}, profile '{profile}' of Carom at steps of {dt_s!r} s: {info.profiles[profile]}"
        )
        made = f"\nMade by: {command}" if command else ""
        task = _CodeTask(engine, profile, scene, dt_s, f"{heading}\nScene: {scene.name}.{made}")
        answer = pool.run(task)
    if answer.value is None:
        why = answer.reason if answer.status is Status.FAILED else answer.said
        raise AdapterError(f"{engine}: {why}")
    return answer.value


def find_step_code(engine: str, profile: str, scene: Scene, dt_s: float, pool: Pool) -> str:
    """Return what of the code of `code_of` says how long a step is and how often a frame takes it.

    Args:
        engine: Name of the adapter.
        profile: Name of one of its profiles.
        scene: The scene, with the rate of its frames.
        dt_s: Step, seconds.
        pool: Where the adapter is asked; it stays open.

    Returns:
        The lines; empty where there are none, or the adapter writes no code of this.
    """
    frame = Scene(**{**dict(scene), "duration_s": 1.0 / scene.frame_rate_hz})
    written = [pool.run(_CodeTask(engine, profile, frame, step_s, "A frame.")).value for step_s in (dt_s, dt_s / 2)]
    here, finer = written
    return "" if here is None or finer is None else step_lines(here, finer)


def find_changed_code(engine: str, profile: str, tried: SettingOverrides, scene: Scene, dt_s: float, pool: Pool) -> str:
    """Return what of an engine's own code reads otherwise with settings instead of a profile's own.

    Args:
        engine: Name of the adapter.
        profile: Name of one of its profiles.
        tried: The settings.
        scene: The scene.
        dt_s: Step, seconds.
        pool: Where the adapter is asked; it stays open.

    Returns:
        The lines; empty where there are none, or the adapter writes no code of this.
    """
    asks = [_CodeTask(engine, profile, scene, dt_s, "Found.", some, limited=False) for some in (tried, ())]
    written = [pool.run(ask).value for ask in asks]
    found, before = written
    return "" if found is None or before is None else changed_lines(found, before)
