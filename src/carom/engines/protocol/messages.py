"""The protocol, version 1: one JSON object a line, a request on standard input, then its answer on standard output.

A field that is not known is ignored, by both sides, so that fields can be added; a new request needs a new version of
the protocol. Numbers are the shortest text that reads back as the same double; NaN is ``null``.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, TypeAdapter

from carom.model.scene import Scene
from carom.model.trace import Setting

#: The version of the protocol that is spoken here.
PROTOCOL = 1


def _nan_from_null(value: object) -> object:
    return math.nan if value is None else value


_Float = Annotated[float, BeforeValidator(_nan_from_null)]
_Vector = tuple[_Float, _Float]


class _Message(BaseModel):
    model_config = ConfigDict(frozen=True, extra="ignore", ser_json_inf_nan="strings")


class Hello(_Message):
    """The first request: which versions of the protocol the harness speaks."""

    do: Literal["hello"] = "hello"
    protocol: tuple[int, ...] = (PROTOCOL,)


class Prepare(_Message):
    """Build a scene, at time 0, with settings of one of the profiles; ``dt_s`` is one of the settings."""

    do: Literal["prepare"] = "prepare"
    scene: Scene
    settings: dict[str, Setting]


class Step(_Message):
    """Take this many steps."""

    do: Literal["step"] = "step"
    world: int
    steps: int = Field(ge=0)


class Look(_Message):
    """Tell the present state, and the contacts of the last step."""

    do: Literal["observe"] = "observe"
    world: int


class Cut(_Message):
    """Make the coming steps, until the next cut, so long; contacts keep carrying the time from the start."""

    do: Literal["cut"] = "cut"
    world: int
    dt_s: float


class Touching(_Message):
    """Tell which bodies the engine's own contact test finds in contact now; nothing may change by it."""

    do: Literal["touching"] = "touching"
    world: int


class Save(_Message):
    """Tell whatever is needed to come back to the present state and time; the length of the steps is no part of it."""

    do: Literal["save"] = "save"
    world: int


class Restore(_Message):
    """Come back to a state that was saved in this world."""

    do: Literal["restore"] = "restore"
    world: int
    state: Any


class Close(_Message):
    """Forget a world."""

    do: Literal["close"] = "close"
    world: int


class Failure(_Message):
    """Why a request was not carried out: refused, for what was asked, or failed."""

    kind: Literal["refused", "failed"] = "failed"
    message: str


class Reply(_Message):
    """Base of all answers: an error may replace all other fields."""

    error: Failure | None = None


class Welcome(_Message):
    """Reply to `Hello`: the version of the protocol that is spoken from here on, and the engine's own version."""

    protocol: int
    version: str = ""


class Prepared(_Message):
    """Reply to `Prepare`: the number of the world, and the settings that are really used."""

    world: int
    settings: dict[str, Setting]


class Stepped(_Message):
    """Reply to `Step`: the seconds that the steps took on the program's own monotonic clock."""

    seconds: float = Field(ge=0, allow_inf_nan=False)


class ToldContact(_Message):
    """A contact of the last step; the fields are those of `carom.engines.api.Contact`."""

    first: int
    second: int
    time_s: _Float
    normal: _Vector
    impulse_n_s: float | None = None
    tangential_impulse_n_s: float | None = None


class Seen(_Message):
    """Reply to `Look`; the fields are those of `carom.engines.api.Observation`."""

    position_m: list[_Vector]
    velocity_m_s: list[_Vector]
    spin_rad_s: list[_Float] | None = None
    contacts: list[ToldContact] = []
    warning: str = ""


class Touched(_Message):
    """Reply to `Touching`: pairs of bodies, numbered as in a contact."""

    pairs: list[tuple[int, int]]


class Saved(_Message):
    """Reply to `Save`: any JSON; it comes back as it is."""

    state: Any


class Done(_Message):
    """Reply to `Cut`, `Restore` and `Close`: nothing but that it is done."""


Request = Hello | Prepare | Step | Look | Cut | Touching | Save | Restore | Close


def protocol_schema() -> dict[str, Any]:
    """Return every message of the protocol as JSON Schema: a line is one of them."""
    told = Welcome | Prepared | Stepped | Seen | Touched | Saved | Done | Reply
    lines: TypeAdapter[Any] = TypeAdapter(Request | told)
    return {"title": f"Carom's engine protocol, version {PROTOCOL}", **lines.json_schema()}
