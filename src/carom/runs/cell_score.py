"""What a sweep keeps of a cell: not the trace but the numbers of its score, found in the worker that ran it."""

from __future__ import annotations

import hashlib
import platform
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, lru_cache
from importlib import metadata

from carom.comparator import compare
from carom.comparator.shift import begun_earlier
from carom.errors import AdapterError, InputError
from carom.registry import engines, load_adapter
from carom.runs.cross_check import reference_trace
from carom.runs.drive import observe_run
from carom.runs.execute import refusal
from carom.runs.messages import Failure
from carom.runs.results import Cell, Row, Status
from carom.scene import Scene
from carom.trace import Trace

__all__ = [
    "CellKey",
    "CellResult",
    "Measures",
    "ScoreTask",
    "cell_key",
    "failed",
    "refused",
    "result_of",
    "scene_hash",
    "versions_of",
]

#: References kept by a worker: the cells of a batch are in order of scene and phase, so that few are enough.
REFERENCES_KEPT = 8


@dataclass(frozen=True)
class CellKey:
    """What tells a cell from all others, in any sweep on any machine.

    Attributes:
        scene_sha256: Hash of all that the scene is made of, its name included.
        engine: Name of the adapter.
        profile: Name of the profile.
        dt_s: Step, seconds.
        phase: Part of a step by which the scene begins earlier.
        versions: Name and version of all that the numbers depend on, in order of name.
    """

    scene_sha256: str
    engine: str
    profile: str
    dt_s: float
    phase: float
    versions: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Measures:
    """The numbers of a score, see `carom.comparator.Score`; angles in radians, NaN without a matched impact.

    Attributes:
        expected: Impacts of the reference.
        matched: Impacts found.
        missed: Impacts missed.
        spurious: Impacts invented.
        undecided: Impacts too close to the end of the run to have been reported.
        ambiguous: Impacts of the reference to which physics gives no unique answer.
        time_error_s: Largest time error by magnitude, with its sign.
        velocity_error: Largest velocity error, over the scene's speed.
        direction_error_rad: Largest direction error.
        final_position_error: Largest distance of a disc from its final place, over the largest radius.
        final_velocity_error: Largest error of a final velocity, over the scene's speed.
        energy_error: Error of the final kinetic energy, over that at the start.
        momentum_error: Error of the final momentum, over mass and speed.
        duration_s: By which times are divided where they are to have no unit.
        steps: Steps taken.
        outcome: How the run ended, the name of a `carom.trace.Outcome`.
    """

    expected: int
    matched: int
    missed: int
    spurious: int
    undecided: int
    ambiguous: int
    time_error_s: float
    velocity_error: float
    direction_error_rad: float
    final_position_error: float
    final_velocity_error: float
    energy_error: float
    momentum_error: float
    duration_s: float
    steps: int
    outcome: str


@dataclass(frozen=True)
class CellResult:
    """What came of a cell.

    Attributes:
        key: Which cell it is.
        scene: Name of the scene, for readers.
        status: Whether it was run.
        reason: Why it was not run, empty where it was.
        measures: The numbers of its score; None where it was not run.
    """

    key: CellKey
    scene: str
    status: Status
    reason: str = ""
    measures: Measures | None = None


@dataclass(frozen=True)
class Unscorable:
    """There is no reference, or no such start; the reason is what a table shows."""

    reason: str


@dataclass(frozen=True)
class ScoreTask:
    """Run a cell and score it, in a worker process."""

    cell: Cell

    def carry_out(self) -> Measures | Unscorable:
        """Return the numbers of the cell's score."""
        cell = self.cell
        try:
            scene = begun_earlier(cell.scene, cell.phase * cell.dt_s)
        except InputError as error:
            return Unscorable(str(error))
        reference = _reference(scene)
        if not isinstance(reference, Trace):
            return Unscorable(reference)
        observed = observe_run(load_adapter(cell.engine), scene, cell.profile, cell.dt_s)
        score = compare(reference, observed)
        return Measures(
            expected=score.expected,
            matched=len(score.errors),
            missed=len(score.missed),
            spurious=len(score.spurious),
            undecided=len(score.undecided),
            ambiguous=len(reference.ambiguous),
            time_error_s=float(score.total.time_s),
            velocity_error=float(score.total.velocity),
            direction_error_rad=float(score.total.direction_rad),
            final_position_error=float(score.total.final_position),
            final_velocity_error=float(score.total.final_velocity),
            energy_error=float(score.total.energy),
            momentum_error=float(score.total.momentum),
            duration_s=scene.duration_s,
            steps=observed.counts.get("steps", 0),
            outcome=observed.outcome.name.lower(),
        )


@lru_cache(maxsize=REFERENCES_KEPT)
def _reference(scene: Scene) -> Trace | str:
    return reference_trace(scene)


@lru_cache(maxsize=64)
def scene_hash(scene: Scene) -> str:
    """Return the SHA-256 of a scene: of every field but the description, each float to the bit."""
    # Pydantic writes each float as the shortest text that reads back as the same one.
    return hashlib.sha256(scene.model_dump_json(exclude={"description"}).encode()).hexdigest()


@cache
def _versions() -> Mapping[str, tuple[tuple[str, str], ...]]:
    common = {
        "carom": metadata.version("carom"),
        "numpy": metadata.version("numpy"),
        platform.python_implementation(): platform.python_version(),
    }
    return {
        info.name: tuple(sorted((common | ({} if info.engine == "Carom" else {info.engine: info.version})).items()))
        for info in engines()
    }


def versions_of(engine: str) -> tuple[tuple[str, str], ...]:
    """Return name and version of all that an engine's numbers depend on; an engine that is missing has an empty one."""
    return _versions().get(engine, ())


def cell_key(cell: Cell) -> CellKey:
    """Return the key of a cell on this machine."""
    return CellKey(scene_hash(cell.scene), cell.engine, cell.profile, cell.dt_s, cell.phase, versions_of(cell.engine))


def failed(cell: Cell, status: Status, reason: str) -> CellResult:
    """Return the result of a cell that gave no numbers."""
    return CellResult(cell_key(cell), cell.scene.name, status, reason)


def refused(cell: Cell) -> CellResult | None:
    """Return the result of a cell that can't be run, decided without starting the engine."""
    row: Row | None = refusal(cell)
    return None if row is None else failed(cell, row.status, row.reason)


def result_of(cell: Cell, answer: object) -> CellResult:
    """Return the result of a cell from a worker's answer to its task."""
    match answer:
        case Measures():
            return CellResult(cell_key(cell), cell.scene.name, Status.RAN, measures=answer)
        case Unscorable():
            return failed(cell, Status.UNSUPPORTED, answer.reason)
        case Failure():
            return failed(cell, Status.FAILED, answer.message)
    raise AdapterError(f"a worker answered with {type(answer).__name__} where a score was asked for")
