"""Results of `carom stress`: values at which methods fail, violated invariances, and bugs that still occur."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path

from carom.engines.registry import EngineInfo
from carom.execution.environment import Environment
from carom.execution.job import Method, Status
from carom.model.scene import Scene
from carom.model.scene_file import save_scene
from carom.support.folders import build_file_name

#: Subfolder for scenes in the folder of results, and prefix of the names of generated scenes.
SCENES, STRESS = "scenes", "stress/"


class CellEnding(StrEnum):
    """Outcome of a test with one method. Each member's value is the phrase that the report shows."""

    FAILS_AT_SIZE = "fails at this size"
    PASSES = "passes to the end"
    FAILS_AT_START = "fails at the harmless end"
    HOLDS = "holds"
    VIOLATED = "fails"
    SEEN = "still seen"
    NOT_SEEN = "not seen"
    NOT_RUN = "not run"


@dataclass(frozen=True)
class CellResult:
    """A cell of the table: the result of one stress test, invariance or reported bug with one method.

    Attributes:
        ending: Outcome of the test.
        value: For a stress test, the value at which the method fails, or the most extreme tested value if it passes.
            For an invariance or a reported bug, the deviation. None if there is no number.
        passes_until: The most extreme value at which the method passes; None if there is none.
        error: The error at `passes_until`, as the stress test defines it; None if there is none.
        reason: Reason why the method fails, or why there is no number.
        scenes: Paths of the files with the scenes that reproduce `value`, relative to the folder of results.
        runs: Number of runs that were needed for the result.
        status: How the run that determined the result ended, or why it could not start.
    """

    ending: CellEnding
    value: float | None = None
    passes_until: float | None = None
    error: float | None = None
    reason: str = ""
    scenes: tuple[str, ...] = ()
    runs: int = 0
    status: Status = Status.RAN

    @property
    def cut_off(self) -> bool:
        """Whether the engine or its adapter failed, so that the result shows nothing about the engine's motion."""
        return self.status.is_failure


@dataclass(frozen=True)
class UnsavedResult:
    """A result whose scenes are not yet saved.

    Attributes:
        result: The result without file names.
        scenes: The scenes that reproduce the result's number.
    """

    result: CellResult
    scenes: tuple[Scene, ...] = ()

    def save(self, folder: Path) -> CellResult:
        """Save the scenes into the folder of results, and return the result with their file names."""
        files = {f"{SCENES}/{build_file_name(scene.name.removeprefix(STRESS))}.toml": scene for scene in self.scenes}
        for file, scene in files.items():
            (folder / SCENES).mkdir(parents=True, exist_ok=True)
            save_scene(scene, folder / file)
        return replace(self.result, scenes=tuple(files))


@dataclass(frozen=True)
class StressRow:
    """A row of the table: a stress test, an invariance or a reported bug.

    Attributes:
        kind: "attack" for a stress test, "relation" for an invariance, "complaint" for a reported bug.
        name: Name of the test.
        axis: Description of the varied quantity, the required invariance, or the reported bug.
        truth: Explanation of how the correct result is known.
        failure_rule: Explanation of when a method fails.
        ladder: Tested values of the varied quantity, beginning at the harmless end; empty if no quantity is varied.
        link: Web address of the bug report.
        about: Engine that a reported bug concerns.
        group: Group of a stress test.
    """

    kind: str
    name: str
    axis: str
    truth: str
    failure_rule: str
    ladder: tuple[float, ...] = ()
    link: str = ""
    about: str = ""
    group: str = ""

    def compute_depth(self, result: CellResult) -> float | None:
        """Return the passed fraction of the range, on a logarithmic scale; None if no value was tested.

        If the last value has no logarithm (such as a gap of 0), it counts as another factor of 10.
        """
        if not self.ladder or result.ending is CellEnding.NOT_RUN:
            return None
        if result.ending is CellEnding.PASSES or result.passes_until is None:
            return float(result.ending is CellEnding.PASSES)
        values = [value for value in self.ladder if value > 0]
        beyond = len(self.ladder) - len(values)
        return abs(math.log10(result.passes_until / values[0])) / (abs(math.log10(values[-1] / values[0])) + beyond)


@dataclass(frozen=True)
class StressResults:
    """Results of all tests with all methods.

    Attributes:
        rows: Stress tests, invariances and reported bugs, which are the rows of the table.
        methods: The methods, which are the columns of the table.
        engines: Descriptions of the methods' engines, by name.
        cells: The results, by the names of the test and the method.
        environment: Description of the machine, and versions of packages.
        command: The command that repeats the campaign.
        quick: Whether this is a quick campaign.
        elapsed_s: Duration of the whole study, in seconds. For a resumed study, only the time since it was resumed.
    """

    rows: tuple[StressRow, ...]
    methods: tuple[Method, ...]
    engines: Mapping[str, EngineInfo]
    cells: Mapping[tuple[str, str], CellResult]
    environment: Environment
    command: str
    quick: bool
    elapsed_s: float
