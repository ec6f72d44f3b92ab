"""Results of `carom history`: releases, changes between consecutive releases, and the release that made a change."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise

from carom.execution.environment import Environment
from carom.studies.history.compare_cells import CellChange, ChangeKind, ReleaseCell, ReleaseRun, classify_change
from carom.studies.history.options import HistoryOptions
from carom.studies.history.release_engines import Origin


@dataclass(frozen=True, order=True)
class RunCell:
    """A scene (by its name), a profile and a step size."""

    scene: str
    profile: str
    dt_s: float


@dataclass(frozen=True)
class Release:
    """A release and its results.

    Attributes:
        version: Version of the release.
        name: Name under which the release is registered as an engine; empty if it is not registered.
        reason: Reason why the release was not run; empty if it was run.
        cells: Results by scene, profile and step size.
    """

    version: str
    name: str = ""
    reason: str = ""
    cells: Mapping[RunCell, ReleaseCell] = field(default_factory=dict)

    @cached_property
    def results(self) -> dict[RunCell, ReleaseRun]:
        """Results of the unshifted scenes. Runs that failed have no result."""
        return {cell: run for cell, one in self.cells.items() if (run := one.at_phase_0.value) is not None}

    @property
    def observes_no_contact(self) -> bool:
        """Whether the results are useless because the adapter observes no contact, although velocities change."""
        results = [run for run in self.results.values() if run.expected]
        return bool(results) and all(run.observes_no_contact for run in results)

    @property
    def not_run(self) -> str:
        """The most frequent reason why the release has no result; empty if it has at least one result."""
        if self.reason or self.results:
            return self.reason
        reasons = [one.at_phase_0.problem for one in self.cells.values()]
        return max(dict.fromkeys(reasons), key=reasons.count, default="there is no run")


@dataclass(frozen=True)
class Transition:
    """Changes from a release to the next release that ran.

    Attributes:
        old: The previous release.
        new: The release.
    """

    old: Release
    new: Release

    @cached_property
    def changes(self) -> dict[RunCell, CellChange]:
        """The change for each scene, profile and step size that belongs to both releases."""
        old, new = self.old.cells, self.new.cells
        return {cell: classify_change(old[cell], new[cell]) for cell in old if cell in new}

    @property
    def engine_changes(self) -> dict[RunCell, CellChange]:
        """Changes attributed to the engine."""
        return {cell: change for cell, change in self.changes.items() if change.kind.is_engine_change}

    @property
    def compared(self) -> int:
        """Number of runs (scenes with a profile and step size) that both releases completed."""
        return len(self.changes) - self.count(ChangeKind.NOT_RUN)

    def count(self, kind: ChangeKind) -> int:
        """Return the number of changes of one kind."""
        return sum(change.kind is kind for change in self.changes.values())


@dataclass(frozen=True)
class History:
    """Result of `carom history`.

    Attributes:
        engine: Name of the adapter.
        origin: Registry and package of the engine's releases.
        options: Options of the study.
        releases: Releases from the oldest to the newest.
        environment: Description of the machine, and versions of packages.
        command: The command that repeats the history; empty if it was called from Python.
        elapsed_s: Duration of the whole study, in seconds.
    """

    engine: str
    origin: Origin
    options: HistoryOptions
    releases: tuple[Release, ...]
    environment: Environment
    command: str
    elapsed_s: float

    @property
    def completed(self) -> tuple[Release, ...]:
        """Releases that completed at least one run."""
        return tuple(release for release in self.releases if release.results)

    @cached_property
    def transitions(self) -> tuple[Transition, ...]:
        """Changes between consecutive releases that ran."""
        return tuple(Transition(old, new) for old, new in pairwise(self.completed))

    @property
    def is_worse(self) -> bool:
        """Whether at least one run became worse in the newest release by more than a phase shift can explain."""
        last = self.transitions[-1:] if self.completed and self.completed[-1] is self.releases[-1] else ()
        return any(change.kind is ChangeKind.WORSE for one in last for change in one.changes.values())


@dataclass(frozen=True)
class Bisection:
    """The release that changed the result for a scene, profile and step size.

    Attributes:
        cell: The scene, profile and step size.
        last: The last release that agrees with the oldest release.
        first: The next release, which differs from the oldest release.
        change: The change, with its kind and numbers.
        tested_versions: The releases that were run, in order.
    """

    cell: RunCell
    last: str
    first: str
    change: CellChange
    tested_versions: tuple[str, ...]
