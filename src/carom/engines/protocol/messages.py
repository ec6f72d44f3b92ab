"""Messages of the engine protocol, version 1: requests on standard input, answers on standard output.

A message is a JSON object on one line. Both sides ignore unknown fields, so that new fields don't need a new version of
the protocol. A new kind of request needs a new version. A number is written as the shortest text that reads back as the
same 64-bit float. NaN is written as ``null``.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, TypeAdapter

from carom.model.scene import Scene
from carom.model.trace import Setting

#: The version of the protocol that Carom uses.
PROTOCOL = 1


_Float = Annotated[float, BeforeValidator(lambda value: math.nan if value is None else value)]
_Vector = tuple[_Float, _Float]


class _Message(BaseModel):
    model_config = ConfigDict(frozen=True, extra="ignore", ser_json_inf_nan="strings")


class _WorldRequest(_Message):
    """Base class of the requests to a world, which is given by its number."""

    do: str
    world: int


class Hello(_Message):
    """The first request: the versions of the protocol that the harness supports."""

    do: Literal["hello"] = "hello"
    protocol: tuple[int, ...] = (PROTOCOL,)


class Prepare(_Message):
    """Build a scene at time 0, with the settings of a profile. ``dt_s`` is one of the settings."""

    do: Literal["prepare"] = "prepare"
    scene: Scene
    settings: dict[str, Setting]


class Step(_WorldRequest):
    """Take a number of steps."""

    do: Literal["step"] = "step"
    steps: int = Field(ge=0)


class Look(_WorldRequest):
    """Return the present state, and the contacts of the last step."""

    do: Literal["observe"] = "observe"


class Cut(_WorldRequest):
    """Set the size of the following steps, until the next cut.

    Times of contacts are still measured from the start of the run.
    """

    do: Literal["cut"] = "cut"
    dt_s: float


class Touching(_WorldRequest):
    """Return the pairs of bodies that touch at this time, according to the engine's own contact test.

    The request must not change the state.
    """

    do: Literal["touching"] = "touching"


class Save(_WorldRequest):
    """Return everything needed to restore the present state and time. The step size is not included."""

    do: Literal["save"] = "save"


class Restore(_WorldRequest):
    """Return to a state that was saved in this world."""

    do: Literal["restore"] = "restore"
    state: Any


class Close(_WorldRequest):
    """Release a world."""

    do: Literal["close"] = "close"


class Failure(_Message):
    """Why a request failed, or was refused as invalid."""

    kind: Literal["refused", "failed"] = "failed"
    message: str


class Reply(_Message):
    """Base class of all answers. If the request failed, an answer contains only `error`."""

    error: Failure | None = None


class Welcome(_Message):
    """Reply to `Hello`: the version of the protocol to use from now on, and the version of the engine."""

    protocol: int
    version: str = ""


class Prepared(_Message):
    """Reply to `Prepare`: the number of the world, and the settings in use."""

    world: int
    settings: dict[str, Setting]


class Stepped(_Message):
    """Reply to `Step`: the seconds that the steps took, measured by a monotonic clock of the program."""

    seconds: float = Field(ge=0, allow_inf_nan=False)


class ToldContact(_Message):
    """A contact of the last step, with fields of `carom.engines.api.Contact`."""

    first: int
    second: int
    time_s: _Float
    normal: _Vector
    impulse_n_s: float | None = None
    tangential_impulse_n_s: float | None = None


class Seen(_Message):
    """Reply to `Look`, with the fields of `carom.engines.api.Observation`."""

    position_m: list[_Vector]
    velocity_m_s: list[_Vector]
    spin_rad_s: list[_Float] | None = None
    contacts: list[ToldContact] = []
    warning: str = ""


class Touched(_Message):
    """Reply to `Touching`: pairs of bodies. Bodies are numbered as in a contact."""

    pairs: list[tuple[int, int]]


class Saved(_Message):
    """Reply to `Save`: any JSON value. `Restore` sends the value back unchanged."""

    state: Any


class Done(_Message):
    """Reply to `Cut`, `Restore` and `Close`, without content."""


Request = Hello | Prepare | Step | Look | Cut | Touching | Save | Restore | Close


def build_protocol_schema() -> dict[str, Any]:
    """Return the JSON Schema of a line of the protocol. A line is one of the messages."""
    answers = Welcome | Prepared | Stepped | Seen | Touched | Saved | Done | Reply
    lines: TypeAdapter[Any] = TypeAdapter(Request | answers)
    return {"title": f"Carom's engine protocol, version {PROTOCOL}", **lines.json_schema()}
