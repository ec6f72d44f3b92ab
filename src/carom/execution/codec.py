"""Converts values to JSON and back, for journals and for the answers of worker processes.

When JSON is read, each field must have its declared type, and no code in the data is run. A float is written as the
shortest text that reads back as the same float. NaN and infinities are written as strings. An array is written as its
shape and its bytes in base64.
"""

from __future__ import annotations

import base64
import dataclasses
from collections.abc import Callable
from functools import lru_cache
from typing import TYPE_CHECKING, Annotated, Any, Generic, TypeVar, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import DTypeLike, NDArray
from pydantic import ConfigDict, TypeAdapter, create_model
from pydantic_core import core_schema

from carom.model.scene import Scene
from carom.model.step_windows import MEETING_DTYPE, REST_DTYPE, SLIP_DTYPE, WINDOW_DTYPE, LocalTruth, States
from carom.model.trace import EDGE_DTYPE, IMPACT_DTYPE, MODE_DTYPE, SPIN_DTYPE, STATE_DTYPE, Samples, Trace
from carom.support.fields import CoreSchema

__all__ = ["CarriedTrace", "Codec", "build_dataclass_type"]

T = TypeVar("T")


class Codec(Generic[T]):
    """Converts values of one type to JSON and back. Reuse a codec, since creating one takes milliseconds.

    Args:
        kind: The type: a dataclass whose fields can be written as JSON.
    """

    def __init__(self, kind: Any) -> None:
        # pydantic accepts a configuration for a tuple but not for a dataclass. So the dataclass is put into a tuple,
        # whose configuration also applies to its item.
        self._adapter = TypeAdapter(tuple[kind], config=ConfigDict(ser_json_inf_nan="strings"))

    def dumps(self, value: T) -> bytes:
        """Return a value as one line of JSON, without line feed."""
        return self._adapter.dump_json((value,))[1:-1]  # remove the brackets of the tuple

    def loads(self, line: bytes) -> T:
        """Return the value of a line of JSON.

        Raises:
            pydantic.ValidationError: The line is not JSON, or its value does not have the codec's type.
        """
        value: T = self._adapter.validate_json(b"[" + line + b"]")[0]
        return value


def _build_type(write: Callable[[Any], Any], read: Callable[[Any], Any]) -> Any:
    """Return a type that makes pydantic write values with `write` and read them with `read`.

    `read` may raise any exception for invalid data.
    """

    def validate(data: Any) -> Any:
        try:
            return read(data)
        except ValueError:
            raise
        except Exception as error:  # noqa: BLE001 - pydantic requires a ValueError
            raise ValueError(f"{type(error).__name__}: {error}") from None

    serialization = core_schema.plain_serializer_function_ser_schema(write)
    schema = core_schema.no_info_plain_validator_function(validate, serialization=serialization)
    return Annotated[Any, CoreSchema(schema)]


def _build_array_type(dtype: DTypeLike) -> Any:
    """Return a type with which pydantic converts arrays to JSON and back. Callers may add ``| None`` to the type."""

    def pack(array: NDArray[Any]) -> Any:
        return [list(array.shape), base64.b64encode(np.asarray(array, dtype).tobytes()).decode()]

    def unpack(found: Any) -> NDArray[Any]:
        shape, data = found
        return np.frombuffer(base64.b64decode(data, validate=True), dtype).reshape([int(size) for size in shape])

    return _build_type(pack, unpack)


#: Number of cached scenes. Successive traces often have the same few scenes.
SCENES_KEPT = 64


@lru_cache(maxsize=SCENES_KEPT)
def _read_scene(text: str) -> Scene:
    """Return the scene of a JSON text. Equal texts give the same object, because checking a scene takes long."""
    return Scene.model_validate_json(text)


_CarriedScene = _build_type(Scene.model_dump_json, _read_scene)


def _build_field_type(hint: Any, carried: Any) -> Any:
    """Return a type with which pydantic converts a field of a dataclass to JSON and back.

    Args:
        hint: The field's declared type.
        carried: The dtype of a structured array, or the type of a nested dataclass; None for other fields.
    """
    optional = type(None) in get_args(hint)
    plain = get_args(hint)[0] if optional else hint
    if get_origin(plain) is np.ndarray:
        field_type = _build_array_type(get_args(get_args(plain)[1])[0] if carried is None else carried)
    else:
        field_type = plain if carried is None else carried
    return field_type | None if optional else field_type


def build_dataclass_type(kind: type[Any], **carried: Any) -> Any:
    """Return a type with which pydantic converts a dataclass. A value is written as a string that contains JSON.

    In the inner JSON, NaN and infinities are written without quotes, because the string "NaN" could be a setting. For
    each field, `_build_field_type` gets the argument `carried[name]`, where `name` is the field's name.
    """
    known = {"Scene": Scene, "LocalTruth": LocalTruth, "States": States, "np": np, "NDArray": NDArray}
    hints = get_type_hints(kind, localns=known)
    names = [field.name for field in dataclasses.fields(kind)]
    types: dict[str, Any] = {name: (_build_field_type(hints[name], carried.get(name)), ...) for name in names}
    config = ConfigDict(ser_json_inf_nan="constants", extra="forbid")
    model: Any = create_model(kind.__name__, __config__=config, **types)

    def pack(value: Any) -> str:
        text: str = model.model_construct(**{name: getattr(value, name) for name in names}).model_dump_json()
        return text

    def unpack(text: Any) -> Any:
        found = model.model_validate_json(text)
        return _check_shapes(kind(**{name: getattr(found, name) for name in names}))

    return _build_type(pack, unpack)


def _check_shapes(value: Any) -> Any:
    """Return the value.

    If the value is a trace, check that the shapes of its arrays match its scene and its impacts.
    """
    if not isinstance(value, Trace):
        return value
    discs, impacts = len(value.scene.discs), len(value.impacts)
    shapes = {
        **dict.fromkeys(("impacts", "effective_time_s", "state_before", "spins", "edges"), (impacts,)),
        **dict.fromkeys(("final_position_m", "final_velocity_m_s"), (discs, 2)),
        **dict.fromkeys(("final_spin_rad_s", "impacts_per_disc"), (discs,)),
    }
    for name, shape in shapes.items():
        array = getattr(value, name)
        if array is not None and array.shape != shape:
            raise ValueError(f"{name} must have the shape {shape}, got {array.shape}")
    for name, states in (("observations", value.observed_states), ("samples", value.samples)):
        if states is not None:
            instants, shape = states.time_s.shape, states.position_m.shape
            velocities = getattr(states, "velocity_m_s", states.position_m)  # samples contain no velocities
            if len(instants) != 1 or not shape == velocities.shape == (*instants, discs, 2):
                raise ValueError(f"{name} must have {discs} positions and velocities per instant, got shape {shape}")
    return value


if TYPE_CHECKING:
    CarriedTrace = Trace
else:
    CarriedTrace = build_dataclass_type(
        Trace,
        scene=_CarriedScene,
        impacts=IMPACT_DTYPE,
        state_before=STATE_DTYPE,
        spins=SPIN_DTYPE,
        edges=EDGE_DTYPE,
        modes=MODE_DTYPE,
        samples=build_dataclass_type(Samples),
        local_truth=build_dataclass_type(
            LocalTruth, windows=WINDOW_DTYPE, meetings=MEETING_DTYPE, slips=SLIP_DTYPE, rests=REST_DTYPE
        ),
        observed_states=build_dataclass_type(States),
    )
