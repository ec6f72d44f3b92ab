"""Converts values to JSON and back, for journals and for the answers of worker processes.

Reading validates each field against the declared type and runs no code. A float is written as the shortest text that
reads back as the same float, NaN or an infinity as a string, and an array as its shape and its bytes in base64.
"""

from __future__ import annotations

import base64
import dataclasses
from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Any, Generic, TypeVar, get_type_hints

import numpy as np
from numpy.typing import DTypeLike, NDArray
from pydantic import ConfigDict, PlainSerializer, PlainValidator, TypeAdapter, create_model

from carom.engines.api import Observation
from carom.model.scene import Scene
from carom.model.step_windows import MEETING_DTYPE, REST_DTYPE, SLIP_DTYPE, WINDOW_DTYPE, LocalTruth, States
from carom.model.trace import EDGE_DTYPE, IMPACT_DTYPE, MODE_DTYPE, SPIN_DTYPE, STATE_DTYPE, Samples, Trace

__all__ = ["CarriedObservation", "CarriedTrace", "Codec"]

T = TypeVar("T")


class Codec(Generic[T]):
    """Converts values of one type to JSON and back. Creating a codec takes milliseconds.

    Args:
        kind: The type: a dataclass that JSON can represent.
    """

    def __init__(self, kind: Any) -> None:
        # pydantic does not accept a configuration for a dataclass. So the type is a tuple with the dataclass, which
        # gets the tuple's configuration.
        self._adapter = TypeAdapter(tuple[kind], config=ConfigDict(ser_json_inf_nan="strings"))

    def dumps(self, value: T) -> bytes:
        """Return a value as one line of JSON, without line feed."""
        return self._adapter.dump_json((value,))[1:-1]  # remove the brackets of the tuple

    def loads(self, line: bytes) -> T:
        """Return the value of a line of JSON.

        Raises:
            pydantic.ValidationError: The line is not JSON, or not of the type.
        """
        value: T = self._adapter.validate_json(b"[" + line + b"]")[0]
        return value


def _build_validator(read: Callable[[Any], Any]) -> PlainValidator:
    """Return a validator that raises ValueError for every exception of `read`, as pydantic requires."""

    def validate(found: Any) -> Any:
        try:
            return read(found)
        except ValueError:
            raise
        except Exception as error:  # noqa: BLE001 - invalid data can cause any exception
            raise ValueError(f"{type(error).__name__}: {error}") from None

    return PlainValidator(validate)


def _build_array_type(dtype: DTypeLike) -> Any:
    """Return an array type that pydantic can convert. The type may be combined with `| None`."""

    def pack(array: NDArray[Any]) -> Any:
        return [list(array.shape), base64.b64encode(np.asarray(array, dtype).tobytes()).decode()]

    def unpack(found: Any) -> NDArray[Any]:
        shape, data = found
        return np.frombuffer(base64.b64decode(data, validate=True), dtype).reshape([int(size) for size in shape])

    return Annotated[Any, PlainSerializer(pack), _build_validator(unpack)]


#: Fields that an older journal of this format may lack. Missing fields are None.
LATER = frozenset({"edges", "modes", "looks", "rests"})


def _build_dataclass_type(kind: type[Any], **carried: Any) -> Any:
    """Return a dataclass type that pydantic can convert, as the JSON text of an object. `carried` has field types.

    A separate JSON text can have NaN and infinities as numbers. As strings, they could not be distinguished from
    settings that are texts.
    """
    hints = (
        get_type_hints(
            kind, localns={"Scene": Scene, "LocalTruth": LocalTruth, "States": States, "np": np, "NDArray": NDArray}
        )
        | carried
    )
    names = [field.name for field in dataclasses.fields(kind)]
    types: dict[str, Any] = {name: (hints[name], None if name in LATER else ...) for name in names}
    config = ConfigDict(ser_json_inf_nan="constants", extra="forbid")
    twin: Any = create_model(kind.__name__, __config__=config, **types)

    def pack(value: Any) -> str:
        text: str = twin.model_construct(**{name: getattr(value, name) for name in names}).model_dump_json()
        return text

    def unpack(text: Any) -> Any:
        if isinstance(text, kind):
            return text
        found = twin.model_validate_json(text)
        return _check_shapes(kind(**{name: getattr(found, name) for name in names}))

    return Annotated[Any, PlainSerializer(pack), _build_validator(unpack)]


def _check_shapes(value: Any) -> Any:
    """Return a value. For a trace, first check the shapes of arrays against scene and impacts."""
    if not isinstance(value, Trace):
        return value
    discs, impacts = len(value.scene.discs), len(value.impacts)
    for name, shape in (
        ("impacts", (impacts,)),
        ("final_position_m", (discs, 2)),
        ("final_velocity_m_s", (discs, 2)),
        ("effective_time_s", (impacts,)),
        ("state_before", (impacts,)),
        ("impacts_per_disc", (discs,)),
        ("spins", (impacts,)),
        ("edges", (impacts,)),
        ("final_spin_rad_s", (discs,)),
    ):
        array = getattr(value, name)
        if array is not None and array.shape != shape:
            raise ValueError(f"{name} must have the shape {shape}, got {array.shape}")
    if value.looks is not None:
        instants, shape = value.looks.time_s.shape, value.looks.position_m.shape
        if len(instants) != 1 or not shape == value.looks.velocity_m_s.shape == (*instants, discs, 2):
            raise ValueError(f"observations of shape {shape} at {instants} instants")
    if value.samples is not None:
        instants = value.samples.time_s.shape
        if len(instants) != 1 or value.samples.position_m.shape != (*instants, discs, 2):
            raise ValueError(f"samples of shape {value.samples.position_m.shape} at {instants} instants")
    return value


_FLOATS = _build_array_type(np.float64)

if TYPE_CHECKING:
    CarriedObservation = Observation
    CarriedTrace = Trace
else:
    CarriedObservation = _build_dataclass_type(
        Observation, position_m=_FLOATS, velocity_m_s=_FLOATS, spin_rad_s=_FLOATS | None
    )
    CarriedTrace = _build_dataclass_type(
        Trace,
        impacts=_build_array_type(IMPACT_DTYPE),
        final_position_m=_FLOATS,
        final_velocity_m_s=_FLOATS,
        effective_time_s=_FLOATS | None,
        state_before=_build_array_type(STATE_DTYPE) | None,
        impacts_per_disc=_build_array_type(np.int64) | None,
        spins=_build_array_type(SPIN_DTYPE) | None,
        edges=_build_array_type(EDGE_DTYPE) | None,
        modes=_build_array_type(MODE_DTYPE) | None,
        final_spin_rad_s=_FLOATS | None,
        samples=_build_dataclass_type(Samples, time_s=_FLOATS, position_m=_FLOATS) | None,
        local_truth=_build_dataclass_type(
            LocalTruth,
            windows=_build_array_type(WINDOW_DTYPE),
            meetings=_build_array_type(MEETING_DTYPE),
            slips=_build_array_type(SLIP_DTYPE),
            rests=_build_array_type(REST_DTYPE) | None,
        )
        | None,
        looks=_build_dataclass_type(
            States, time_s=_FLOATS, position_m=_FLOATS, velocity_m_s=_FLOATS, spin_rad_s=_FLOATS | None
        )
        | None,
    )
