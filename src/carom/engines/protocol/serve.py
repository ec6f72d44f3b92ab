"""Serves a Python adapter over standard input and output, using the engine protocol.

So an adapter can run in another interpreter, with another release of its engine. `carom history` compares many releases
of an engine in this way.
"""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import fields
from enum import Enum
from itertools import count
from typing import Annotated, Any, TypeVar, cast

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, TypeAdapter, ValidationError

from carom.engines.api import Accuracy, Adapter, Capabilities, Contact, CuttableWorld, Knob, Profile, TimedWorld, World
from carom.engines.protocol.messages import (
    PROTOCOL,
    Close,
    Cut,
    Hello,
    Look,
    Prepare,
    Request,
    Restore,
    Save,
    Step,
    Touching,
)
from carom.errors import AdapterError, CaromError
from carom.model.trace import Setting

#: The only setting in the manifest of a served adapter: the name of a profile. A manifest can't contain settings that
#: depend on the step size, so the program gets them from its adapter.
PROFILE = "profile"

W = TypeVar("W")
_Declared = TypeVar("_Declared", Capabilities, Accuracy)

_REQUESTS: TypeAdapter[Request] = TypeAdapter(Annotated[Request, Field(discriminator="do")])


class Server:
    """Answers requests with the worlds of an adapter.

    Args:
        adapter: Adapter of the engine.
        version: Version of the engine.
    """

    def __init__(self, adapter: Adapter, version: str) -> None:
        self._adapter, self._version = adapter, version
        self._worlds: dict[int, World] = {}
        self._saved: dict[tuple[int, int], object] = {}  # kept here, because saved states can be objects of the engine
        self._numbers = count(1)

    def answer(self, line: str | bytes) -> dict[str, Any]:
        """Return the answer to one request as JSON values, with None for NaN. Any line gets an answer."""
        try:
            request = _REQUESTS.validate_json(line)
        except ValidationError as error:
            first = error.errors(include_url=False)[0]
            return _build_error("refused", f"{'.'.join(map(str, first['loc'])) or 'the line'}: {first['msg']}")
        try:
            return self._carry_out(request)
        except CaromError as error:
            return _build_error("refused" if isinstance(request, Prepare) else "failed", str(error))
        except Exception as error:  # noqa: BLE001 - an exception of the engine becomes the answer
            return _build_error("failed", f"{type(error).__name__}: {error}")

    def close(self) -> None:
        """Close the worlds that are still open."""
        for world in self._worlds.values():
            world.close()
        self._worlds.clear()

    def _carry_out(self, request: Request) -> dict[str, Any]:
        if isinstance(request, Hello):
            return {"protocol": PROTOCOL, "version": self._version}
        if isinstance(request, Prepare):
            return self._prepare(request)
        if (world := self._worlds.get(request.world)) is None:
            raise AdapterError(f"there is no world {request.world}")
        match request:
            case Step():
                return {"seconds": _take_steps(world, request.steps)}
            case Look():
                return _observe(world)
            case Close():
                self._worlds.pop(request.world).close()
                self._saved = {key: state for key, state in self._saved.items() if key[0] != request.world}
                return {}
        if not isinstance(world, CuttableWorld):
            raise AdapterError(f"the steps of {self._adapter.name} can't be cut with this profile")
        match request:
            case Cut():
                world.cut(request.dt_s)
            case Touching():
                return {"pairs": sorted([int(first), int(second)] for first, second in world.touching())}
            case Save():
                number = next(self._numbers)
                self._saved[request.world, number] = world.save()
                return {"state": number}
            case Restore():
                world.restore(self._saved[request.world, request.state])
        return {}

    def _prepare(self, request: Prepare) -> dict[str, Any]:
        asked = dict(request.settings)
        name = asked.pop(PROFILE, None)
        if name is not None and name not in self._adapter.profiles:
            raise AdapterError(f"{self._adapter.name} has no profile {name!r}")
        own = {} if name is None else self._adapter.profiles[str(name)].settings(float(asked["dt_s"]))
        world = self._adapter.prepare(request.scene, {**own, **asked})
        number = next(self._numbers)
        self._worlds[number] = world
        used = {key: _to_json_value(value) for key, value in world.settings.items()}
        return {"world": number, "settings": used | ({} if name is None else {PROFILE: name})}


def serve(server: Server, requests: Iterable[str], write: Callable[[str], object]) -> None:
    """Answer each line of requests with one line, until the requests end."""
    try:
        for line in requests:
            write(json.dumps(server.answer(line)) + "\n")
    finally:
        server.close()


def _build_error(kind: str, message: str) -> dict[str, Any]:
    return {"error": {"kind": kind, "message": message}}


def _take_steps(world: World, steps: int) -> float:
    """Take steps and return the seconds, by the world's own clock if it has one."""
    if isinstance(world, TimedWorld):
        before = world.seconds
        world.advance(steps)
        return world.seconds - before
    began = time.perf_counter()
    world.advance(steps)
    return time.perf_counter() - began


def _observe(world: World) -> dict[str, Any]:
    now = world.observe()
    spins = {} if now.spin_rad_s is None else {"spin_rad_s": _to_json_numbers(now.spin_rad_s)}
    return {
        "position_m": _to_json_numbers(now.position_m),
        "velocity_m_s": _to_json_numbers(now.velocity_m_s),
        "contacts": [_build_contact_fields(contact) for contact in now.contacts],
        "warning": now.warning,
    } | spins


def _build_contact_fields(contact: Contact) -> dict[str, Any]:
    if contact.velocities is not None:
        raise AdapterError("its contacts have velocities before and after, which the protocol does not support")
    impulses = {"impulse_n_s": contact.impulse_n_s, "tangential_impulse_n_s": contact.tangential_impulse_n_s}
    return {
        "first": int(contact.first),
        "second": int(contact.second),
        "time_s": _to_json_number(contact.time_s),
        "normal": [_to_json_number(part) for part in contact.normal],
    } | {name: _to_json_number(value) for name, value in impulses.items() if value is not None}


def _to_json_number(value: float) -> float | None:
    return None if math.isnan(value) else float(value)


def _to_json_numbers(array: NDArray[np.float64]) -> list[Any]:
    """Return an array of one or two dimensions as lists, with None for NaN."""
    found = np.asarray(array, dtype=np.float64)
    if not np.isnan(found).any():
        return cast("list[Any]", found.tolist())
    return [
        _to_json_number(float(one)) if one.ndim == 0 else [_to_json_number(float(part)) for part in one]
        for one in found
    ]


def _to_json_value(value: Any) -> Setting:
    """Return a setting as a JSON value, since an engine's binding may return NumPy numbers."""
    return cast("Setting", value.item() if isinstance(value, np.generic) else value)


def build_manifest(adapter: Adapter, name: str, version: str, command: Sequence[str]) -> str:
    """Return a manifest, as TOML, for an adapter that is served by a command.

    Args:
        adapter: The adapter; its engine is not imported.
        name: Name of the engine in the manifest, different from the adapter's.
        version: Version of the engine.
        command: Command that starts the program.
    """
    import tomli_w

    knobs: Mapping[str, Knob] = getattr(adapter, "knobs", {})
    manifest = {
        "name": name,
        "engine": adapter.engine.name,
        "version": version,
        "oldest": adapter.engine.oldest,
        "newest_tried": adapter.engine.newest_tried,
        "command": list(command),
        "capabilities": _find_differing(adapter.capabilities, Capabilities()),
        "profiles": {key: _build_profile(adapter, key, profile) for key, profile in adapter.profiles.items()},
        "knobs": {key: _build_knob(knob) for key, knob in knobs.items()},
    }
    return tomli_w.dumps(manifest)


def _build_profile(adapter: Adapter, name: str, profile: Profile) -> dict[str, Any]:
    own = profile.capabilities
    # A profile in a manifest inherits the engine's capabilities, so only differences are written.
    able = {} if own is None else {"capabilities": _find_differing(own, adapter.capabilities)}
    return {
        "description": profile.description,
        "settings": {PROFILE: name},
        "accuracy": _find_differing(profile.accuracy, Accuracy()),
        "located": profile.located,
        "changed": dict(profile.changed),
    } | able


def _build_knob(knob: Knob) -> dict[str, Any]:
    return {"choices": list(knob.choices)} if knob.choices else {"low": knob.low, "high": knob.high, "log": knob.log}


def _find_differing(found: _Declared, usual: _Declared) -> dict[str, Any]:
    """Return the fields that differ from the usual fields, in the spelling of a manifest."""
    pairs = ((field.name, getattr(found, field.name), getattr(usual, field.name)) for field in fields(found))
    return {name: _to_toml_value(value) for name, value, other in pairs if value != other}


def _to_toml_value(value: Any) -> Any:
    if isinstance(value, Enum):
        return value.name.lower()
    return list(value) if isinstance(value, tuple) else value
