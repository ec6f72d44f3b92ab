"""Results of a stress campaign: where each method fails under an attack, and by how much relations are violated."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path

from carom.engines.registry import EngineInfo
from carom.execution.environment import Environment
from carom.execution.job import Method, Status
from carom.model.scene import Scene, save_scene
from carom.support.folders import file_name

#: Folder of scenes within that of the results, and what the names of made scenes begin with.
SCENES, STRESS = "scenes", "stress/"

#: Phrases in journals of earlier versions.
_EARLIER = {
    "gives way": "fails at this size",
    "stands to the end": "passes to the end",
    "gives way at the harmless end": "fails at the harmless end",
}


class SpotEnding(StrEnum):
    """How a cell ended; the value is the phrase shown."""

    GIVES_WAY = "fails at this size"
    STANDS = "passes to the end"
    NEVER_STOOD = "fails at the harmless end"
    HOLDS = "holds"
    FAILS = "fails"
    STILL_DOES = "still does it"
    DOES_NOT = "does not do it"
    NOT_RUN = "not run"

    @classmethod
    def _missing_(cls, value: object) -> SpotEnding | None:
        """Return the ending for a phrase of an earlier version."""
        return cls(_EARLIER[value]) if isinstance(value, str) and value in _EARLIER else None


@dataclass(frozen=True)
class Spot:
    """One cell of the table: one attack, relation or complaint, and one method.

    Attributes:
        kind: "attack", "relation" or "complaint".
        line: Name of the attack, relation or complaint.
        method: Name of the method.
        ending: How it ended.
        value: The size at which the method fails, or the largest size tried if it passes; for a relation or a complaint
            the deviation. None where there is no number.
        stands_at: The largest size that it passed, None where there is none.
        error: The error at `stands_at`, in the measure of the attack; None where there is none.
        reason: Why it fails, or why there is no number.
        scenes: The files, in the folder of the results, whose scenes show the number.
        runs: Number of runs behind the result.
        status: Status of the run that decided, or of the refusal.
    """

    kind: str
    line: str
    method: str
    ending: SpotEnding
    value: float | None = None
    stands_at: float | None = None
    error: float | None = None
    reason: str = ""
    scenes: tuple[str, ...] = ()
    runs: int = 0
    status: Status = Status.RAN

    @property
    def cut_off(self) -> bool:
        """Whether the engine, or its adapter, broke off the run that decided."""
        return self.status.is_failure


@dataclass(frozen=True)
class FoundSpot:
    """A cell as it is found, before its scenes are saved.

    Attributes:
        spot: The cell, without files.
        scenes: The scenes that show its number.
    """

    spot: Spot
    scenes: tuple[Scene, ...] = ()

    def save(self, folder: Path) -> Spot:
        """Save the scenes into the folder of the results. Return the cell with their files."""
        files = {f"{SCENES}/{file_name(scene.name.removeprefix(STRESS))}.toml": scene for scene in self.scenes}
        for file, scene in files.items():
            (folder / SCENES).mkdir(parents=True, exist_ok=True)
            save_scene(scene, folder / file)
        return replace(self.spot, scenes=tuple(files))


@dataclass(frozen=True)
class Line:
    """One line of the table.

    Attributes:
        kind: "attack", "relation" or "complaint".
        name: Its name.
        axis: Varied quantity, required relation, or reported bug.
        truth: Source of the true answer.
        gives_way: Criterion of failure, with its reason.
        ladder: Values of the axis that are tried, from the harmless end on; empty where there is none.
        link: Address of the thread of a complaint.
        about: Engine that a complaint is about.
        group: Group of an attack, by the situation.
    """

    kind: str
    name: str
    axis: str
    truth: str
    gives_way: str
    ladder: tuple[float, ...] = ()
    link: str = ""
    about: str = ""
    group: str = ""

    def depth(self, spot: Spot) -> float | None:
        """Return the part of the ladder's decades that a method passed; None where none was tried.

        A last value without a logarithm, such as a gap of 0, counts as one more decade.
        """
        if not self.ladder or spot.ending is SpotEnding.NOT_RUN:
            return None
        if spot.ending is SpotEnding.STANDS or spot.stands_at is None:
            return float(spot.ending is SpotEnding.STANDS)
        rungs = [value for value in self.ladder if value > 0]
        beyond = len(self.ladder) - len(rungs)
        return abs(math.log10(spot.stands_at / rungs[0])) / (abs(math.log10(rungs[-1] / rungs[0])) + beyond)


@dataclass(frozen=True)
class StressResults:
    """All cells of a campaign.

    Attributes:
        lines: Attacks, relations, complaints, in the order of the table.
        methods: The columns.
        engines: Descriptions of their engines, by name.
        spots: The cells, by name of line and method.
        environment: Machine and versions.
        command: The command that repeats the campaign.
        quick: Whether this is the quick form.
        elapsed_s: Elapsed seconds of this run; a resumed run counts only its own.
    """

    lines: tuple[Line, ...]
    methods: tuple[Method, ...]
    engines: Mapping[str, EngineInfo]
    spots: Mapping[tuple[str, str], Spot]
    environment: Environment
    command: str
    quick: bool
    elapsed_s: float
