"""The JSON Schema of the JSON lines, generated from the types of what they are made of."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from pydantic import Field, TypeAdapter
from pydantic.json_schema import GenerateJsonSchema

from carom.comparator import Errors, Grade, LocalScore
from carom.comparator.consistency import Consistency
from carom.comparator.scales import Scales
from carom.comparator.verdict import Finding
from carom.report.files import FORMATS
from carom.report.records import OF_SPINS
from carom.runs.environment import Environment
from carom.runs.job import Status
from carom.runs.phases import PhaseSpread
from carom.runs.timing import Timing
from carom.trace import Outcome, Setting

__all__ = ["CellLine", "HeadLine", "Step", "records_schema"]

#: A step is a number always; what pydantic calls a float else may be NaN or infinite, which is null.
Step = Annotated[float, Field(gt=0)]


@dataclass(frozen=True)
class SceneLine:
    expected: int
    horizon_s: float | None
    beyond_horizon: int
    scales: Scales


@dataclass(frozen=True)
class HeadLine:
    """The first line: what is the same for all rows."""

    format: int
    rows: int
    environment: Environment
    command: str
    elapsed_s: float
    verdicts: Mapping[str, str]
    scenes: Mapping[str, SceneLine]
    sampling: tuple[Mapping[str, str | float], ...]


@dataclass(frozen=True)
class Taken:
    admissible: tuple[str, ...]
    nearest: int | None
    distance: float
    matches: bool


@dataclass(frozen=True)
class LocalLine(LocalScore):
    """The numbers of local truth with their grade, which follows from them."""

    grade: Grade


@dataclass(frozen=True)
class CellLine:
    """Every other line: one cell."""

    scene: str
    engine: str
    profile: str
    tried: Mapping[str, Setting]
    dt_s: Step
    refinement: int
    status: Status
    reason: str
    grade: Grade | None
    verdicts: tuple[Finding, ...]
    matched: int | None
    missed: tuple[int, ...] | None
    spurious: tuple[int, ...] | None
    undecided: tuple[int, ...] | None
    total: Errors | None
    against_pit: Errors | None
    own_velocity: float | None
    price_paid: float | Literal["inf"] | None
    float_bits: Literal[32, 64] | None
    equals_pit: bool | None
    edits: int | None
    local: Mapping[str, float] | None
    local_truth: LocalLine | None
    parted_s: float | None
    pit_parted_s: float | None
    consistency: Consistency | None
    outcome_taken: Taken | None
    spread: PhaseSpread | None
    counts: Mapping[str, int] | None
    outcome: Outcome | None
    notes: tuple[str, ...]
    settings: Mapping[str, Setting] | None
    timing: Timing | None
    untimed: str
    time_ratio: float | None


class _AsWritten(GenerateJsonSchema):
    """As `carom.report.records` writes: an enum by its name, null for no finite number, spins only where discs turn."""

    def float_schema(self, schema: Any) -> dict[str, Any]:
        return super().float_schema(schema) if "gt" in schema else {"type": ["number", "null"]}

    def enum_schema(self, schema: Any) -> dict[str, Any]:
        return {"enum": [member.name.lower() for member in schema["members"]]}

    def default_schema(self, schema: Any) -> dict[str, Any]:
        return self.generate_inner(schema["schema"])  # a default, which may be NaN, is written as well

    def field_is_required(self, field: Any, total: bool) -> bool:  # noqa: ARG002 - pydantic's signature
        return field["name"] not in OF_SPINS


def records_schema() -> dict[str, Any]:
    """Return the JSON Schema of a line (the one published as ``carom/results.schema.json``)."""
    schema = TypeAdapter(HeadLine | CellLine).json_schema(mode="serialization", schema_generator=_AsWritten)
    version = FORMATS["results"]
    schema["$defs"]["HeadLine"]["properties"]["format"] = {"const": version}
    dialect = "https://json-schema.org/draft/2020-12/schema"
    return {"$schema": dialect, "title": f"A line of Carom's results, format {version}", **schema}
