"""Options that several studies have in common. `carom.support.options` converts and checks their values."""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Any

from carom.support.limits import DEFAULT_TIME_LIMIT_S, MOST_JOBS, MOST_PHASES
from carom.support.options import (
    DeclaredOptions,
    ValueKind,
    build_megabytes_kind,
    build_name_kind,
    build_seconds_kind,
    build_step_kind,
    build_whole_number_kind,
    declare_option,
)

if TYPE_CHECKING:
    from carom.execution.pool import LocalPool, Pool

#: Grades for the option ``--fail-on``. The command fails if a run has this grade or a worse grade.
FailOn = StrEnum("FailOn", "CLOSE SAMPLED INACCURATE WRONG NEVER")

#: Largest seed that Carom accepts.
MOST_SEED = 2**63 - 1


def _resolve_engine(text: str) -> str:
    from carom.engines.registry import resolve_engine

    return resolve_engine(text)


def declare_engines() -> Any:
    """Declare the option for engines, each given by name or by manifest.

    A manifest is registered, and then replaced by the name of its engine.
    """
    return declare_option(
        None,
        ValueKind("a name", "NAME", build_name_kind().convert, _resolve_engine),
        "Engine name, or path of an engine.toml; repeatable. The engine's code runs with your permissions.",
        "--engine",
        "-e",
        many=True,
        default_text="all installed",
    )


def declare_profiles(*default: str, help_text: str = "Settings profile, repeatable.", default_text: str = "") -> Any:
    """Declare the option for profiles. If the default is None, `default_text` describes it."""
    return declare_option(
        default or None, build_name_kind(), help_text, "--profile", "-p", many=True, default_text=default_text
    )


def declare_steps(default_text: str) -> Any:
    """Declare the option for step sizes. `default_text` describes the default."""
    help_text = "Step size in seconds, such as 1/240; repeatable."
    return declare_option(None, build_step_kind(), help_text, "--dt", many=True, default_text=default_text)


def declare_phases(default: int) -> Any:
    """Declare the option for the number of phases."""
    help_text = "Number of phases: shifts of the scene by fractions of a step."
    return declare_option(default, build_whole_number_kind(1, MOST_PHASES), help_text, "--phases")


def declare_seed() -> Any:
    """Declare the option ``--seed``, which selects the phases."""
    return declare_option(0, build_whole_number_kind(0, MOST_SEED), "Number that selects the phases.", "--seed")


def _parse_address(value: Any) -> str:
    if not re.fullmatch(r"[a-z]+://\S+", value):
        raise ValueError
    return str(value)


def declare_no_scheduler(reason: str) -> Any:
    """Declare the option ``--scheduler`` in a study that can't run on a cluster. Messages contain `reason`."""

    def refuse(_value: Any) -> None:
        raise ValueError

    kind = ValueKind(f"left out, since {reason}", "ADDRESS", refuse)
    return declare_option(None, kind, f"Not available here: {reason}.", "--scheduler")


@dataclass(frozen=True, kw_only=True)
class LimitOptions(DeclaredOptions):
    """Options of every study that starts engines.

    Attributes:
        jobs: Number of parallel runs; by default the number of cores.
        time_limit_s: Seconds after which an engine without an answer is ended.
        memory_limit_mb: Memory limit of an engine's process, in megabytes; by default the limit of
            `carom.execution.pool.LocalPool`.
        scheduler: Address of the scheduler of a Dask cluster on which to run. By default, the study runs on this
            machine.
    """

    jobs: int | None = declare_option(
        None,
        build_whole_number_kind(1, MOST_JOBS),
        "Number of parallel runs.",
        "--jobs",
        "-j",
        default_text="number of cores",
    )
    time_limit_s: float = declare_option(
        DEFAULT_TIME_LIMIT_S, build_seconds_kind(), "Time limit of a run in seconds.", "--time-limit"
    )
    memory_limit_mb: float | None = declare_option(
        None,
        build_megabytes_kind(),
        "Memory limit of an engine process in megabytes.",
        "--memory-limit",
        default_text="total memory / (jobs + 1)",
    )
    scheduler: str | None = declare_option(
        None,
        ValueKind("an address such as tcp://host:8786", "ADDRESS", _parse_address),
        "Dask scheduler to run on, such as tcp://host:8786. Run times are still measured here.",
        "--scheduler",
        default_text="this machine",
    )

    def open_pool(self) -> Pool:
        """Return the requested pool: a pool on the cluster of `scheduler`, or else on this machine.

        Raises:
            CaromError: The cluster can't be used; see `carom.execution.cluster.ClusterPool`.
        """
        if self.scheduler is None:
            return self.open_local_pool()
        from carom.execution.cluster import ClusterPool

        return ClusterPool(self.scheduler, self.time_limit_s, self.memory_limit_mb)

    def open_local_pool(self, jobs: int | None = None) -> LocalPool:
        """Return a pool of worker processes on this machine with these limits."""
        from carom.execution.pool import LocalPool

        _prepare_workers()
        return LocalPool(jobs or self.jobs, self.time_limit_s, self.memory_limit_mb)


def _prepare_workers() -> None:
    """Create codecs, and find out whether the extension is up to date. Forked workers inherit these results."""
    from carom.core.extension import find_extension_notes
    from carom.engines.registry import find_installed_release
    from carom.execution.describe_engines import DescribeTask
    from carom.execution.observation.engine_run import ObserveTask
    from carom.execution.timing import TimeTask
    from carom.execution.workers.worker_main import build_codec

    for task in (DescribeTask, ObserveTask, TimeTask):
        build_codec(task)
    find_extension_notes()
    find_installed_release("carom")
