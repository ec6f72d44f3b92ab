"""Options shared by all studies, and the options of a cross-check, declared by `carom.support.options`."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import KW_ONLY, dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Any

from carom.errors import InputError
from carom.support.limits import DEFAULT_TIME_LIMIT_S, MOST_JOBS, MOST_PHASES
from carom.support.options import DeclaredOptions, ValueKind, flag, megabytes, name, option, seconds, step, whole

if TYPE_CHECKING:
    from carom.execution.pool import LocalPool, Pool
    from carom.model.scene import Scene
    from carom.model.trace import Setting

#: Time limit of the certified run of a scene, seconds: enough for a few thousand impacts of dozens of discs.
CERTIFY_SECONDS = 10.0

#: The best grade that counts as a violation.
FailOn = StrEnum("FailOn", "CLOSE SAMPLED INACCURATE WRONG NEVER")

#: Largest seed of NumPy's generators.
MOST_SEED = 2**63 - 1

#: Ratio between one step of a scene and the next. The ratio is large enough to show an order of convergence.
REFINEMENT = 4
REFINEMENTS = 3


def default_dts(scene: Scene) -> tuple[float, ...]:
    """Return the default steps of a scene: its own frame, a quarter and a sixteenth of it."""
    return tuple(1.0 / (scene.frame_rate_hz * REFINEMENT**k) for k in range(REFINEMENTS))


def _engine(text: str) -> str:
    from carom.engines.registry import resolve_engine

    return resolve_engine(text)


def engine_names(*, stamped: bool = False) -> Any:
    """Declare the option for engines, by name or manifest.

    A manifest is registered, and replaced by the name of its engine.
    """
    return option(
        None,
        ValueKind("a name", "NAME", name().take, _engine, name().wrong),
        "Engine name, or path of an engine.toml; repeatable. The engine's code runs with your permissions.",
        "--engine",
        "-e",
        many=True,
        stamped=stamped,
        said="all installed",
    )


def profile_names(
    *default: str, what: str = "Settings profile, repeatable.", said: str = "", stamped: bool = False
) -> Any:
    """Declare the option for profiles; `said` describes the default if it is None."""
    return option(default or None, name(), what, "--profile", "-p", many=True, stamped=stamped, said=said)


def step_lengths(said: str, *, stamped: bool = False) -> Any:
    """Declare the option for steps. `said` describes the default."""
    what = "Time step in seconds, such as 1/240; repeatable."
    return option(None, step(), what, "--dt", many=True, stamped=stamped, said=said)


def phase_seed(*, stamped: bool = False) -> Any:
    """Declare the option for the start of the sequence of phases."""
    return option(
        0, whole(0, MOST_SEED), "Number that selects the start positions in a step.", "--seed", stamped=stamped
    )


def time_limit(*, stamped: bool = False) -> Any:
    """Declare the option for the time limit of a run."""
    what = "Time limit of a run in seconds."
    return option(DEFAULT_TIME_LIMIT_S, seconds(), what, "--time-limit", stamped=stamped)


def memory_limit(*, stamped: bool = False) -> Any:
    """Declare the option for the memory limit of a process."""
    what, said = "Memory limit of an engine process in megabytes.", "total memory / (jobs + 1)"
    return option(None, megabytes(), what, "--memory-limit", stamped=stamped, said=said)


def _address(value: Any) -> str:
    if not re.fullmatch(r"[a-z]+://\S+", value):
        raise ValueError
    return str(value)


def scheduler() -> Any:
    """Declare the option for a cluster."""
    said = "an address such as tcp://host:8786"
    return option(
        None,
        ValueKind(said, "ADDRESS", _address, wrong=("host:8786", "nan", "", 5, True, ["tcp://host:8786"])),
        "Dask scheduler to run on, such as tcp://host:8786. Run times are still measured here.",
        "--scheduler",
        said="this machine",
    )


def no_scheduler(reason: str) -> Any:
    """Declare the option for a cluster in a study that can't use one, with the reason."""

    def refuse(_value: Any) -> None:
        raise ValueError

    kind = ValueKind(f"left out, since {reason}", "ADDRESS", refuse, wrong=("tcp://host:8786", "", 5))
    return option(None, kind, f"Not available here: {reason}.", "--scheduler")


@dataclass(frozen=True, kw_only=True)
class LimitOptions(DeclaredOptions):
    """Options of every study that starts engines.

    Attributes:
        jobs: Number of parallel runs; by default the number of cores.
        time_limit_s: Seconds after which an engine without an answer is ended.
        memory_limit_mb: Memory limit of an engine's process, megabytes; by default that of
            `carom.execution.pool.LocalPool`.
        scheduler: Address of the Dask scheduler whose cluster the study runs on; by default it runs on this machine.
    """

    jobs: int | None = option(
        None, whole(1, MOST_JOBS), "Number of parallel runs.", "--jobs", "-j", said="number of cores"
    )
    time_limit_s: float = time_limit()
    memory_limit_mb: float | None = memory_limit()
    scheduler: str | None = scheduler()

    def pool(self) -> Pool:
        """Return the requested pool: a pool on the cluster of `scheduler`, or else on this machine.

        Raises:
            CaromError: The cluster can't be used; see `carom.execution.cluster.ClusterPool`.
        """
        if self.scheduler is None:
            return self.local_pool()
        from carom.execution.cluster import ClusterPool

        return ClusterPool(self.scheduler, self.time_limit_s, self.memory_limit_mb)

    def local_pool(self, jobs: int | None = None) -> LocalPool:
        """Return a pool of worker processes on this machine with these limits."""
        from carom.execution.pool import LocalPool

        _build_codecs()
        return LocalPool(jobs or self.jobs, self.time_limit_s, self.memory_limit_mb)


def _build_codecs() -> None:
    """Build the codecs of the most frequent tasks, so that the processes that a pool forks already have them."""
    from carom.execution.describe_engines import DescribeTask
    from carom.execution.engine_run import ObserveTask
    from carom.execution.timing import TimeTask
    from carom.execution.worker import codec_of

    for task in (DescribeTask, ObserveTask, TimeTask):
        codec_of(task)


def _mapping(value: Any) -> dict[str, Any]:
    if not isinstance(value, Mapping | tuple):  # the default, an empty tuple, is an empty mapping
        raise TypeError
    return dict(value)


def parse_settings(words: Sequence[str]) -> dict[str, Setting]:
    """Parse settings in the form ``name=value``. The values stay texts.

    Raises:
        InputError: A word has no ``=`` or no name, or a setting occurs twice.
    """
    found: dict[str, Setting] = {}
    for word in words:
        name, sign, value = word.partition("=")
        if not (name and sign):
            raise InputError(f"--set must be NAME=VALUE, such as iterations=20, got {word!r}")
        if name in found:
            raise InputError(f"--set: {name} is given twice, as {found[name]} and {value}")
        found[name] = value
    return found


@dataclass(frozen=True)
class Options(LimitOptions):
    """Options of a cross-check, without its scenes.

    Attributes:
        engines: Names of adapters; by default every one whose engine is installed.
        dts: Steps, seconds; by default those of `default_dts` for each scene.
        profiles: Names of profiles, or "all"; by default those of `carom.execution.plan.DEFAULT_PROFILES` that an
            engine has. If two profiles of an engine have the same settings, only the later one is run. A profile that
            cuts steps is run only at a scene's coarsest step, unless steps are given, because its results do not depend
            on the step.
        settings: Settings to try instead of the profiles' own, by name. Every requested engine must have the settings.
            A text is converted to the type of the setting.
        phases: Number of sub-step phases at which to run each job in addition to the scene's own, for the spread of
            errors.
        seed: Start of the quasi-random sequence of phases.
        certified: Whether to score against certified runs. By default PIC is the reference. For scenes of three discs
            or more, a certified run shows up to which impact PIC is reliable, if python-flint is installed.
        certify_s: Seconds for the certified run of each scene.
        timing: Whether to time each job at its scene's coarsest step too, in a pass in which nothing else runs.
        samples: Whether to keep states for drawing. Only reports need them.

    Raises:
        InputError: A value is invalid.
    """

    engines: Sequence[str] | None = engine_names(stamped=True)
    dts: Sequence[float] | None = step_lengths("1, 1/4 and 1/16 of a scene's frame", stamped=True)
    profiles: Sequence[str] | None = profile_names(
        what="Settings profile, repeatable, or 'all' for every profile.", said="default, tuned, located", stamped=True
    )
    settings: Mapping[str, Setting] = option(
        (),
        ValueKind(
            "a mapping from names to values", "NAME=VALUE", _mapping, wrong=("x", 5, ["x"], None), gather=parse_settings
        ),
        "Override a setting of the profiles, repeatable. Every chosen engine must have the setting.",
        "--set",
        stamped=True,
    )
    phases: int = option(
        0,
        whole(0, MOST_PHASES),
        "Also run each scene from this many start positions within a step, to show the spread of errors.",
        "--phases",
        stamped=True,
    )
    seed: int = phase_seed(stamped=True)
    certified: bool | None = option(
        None,
        flag(),
        "Compare with certified runs, which need python-flint.",
        "--certify/--no-certify",
        stamped=True,
        said="PIC, certified for three discs or more",
    )
    certify_s: float = option(CERTIFY_SECONDS, seconds(), "Seconds per certified run.", "--certify-time", stamped=True)
    timing: bool = option(True, flag(), "Time each scene at its coarsest step.", "--timing/--no-timing", stamped=True)
    samples: bool = option(True, flag(), "Whether to keep states for drawing.", stamped=True)
    _: KW_ONLY
    time_limit_s: float = time_limit(stamped=True)
    memory_limit_mb: float | None = memory_limit(stamped=True)

    def steps_of(self, scene: Scene) -> tuple[float, ...]:
        """Return the steps at which a scene is run, from the coarsest on."""
        return tuple(sorted(set(self.dts or default_dts(scene)), reverse=True))
