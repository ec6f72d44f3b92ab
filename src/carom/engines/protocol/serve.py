"""Answers requests of the engine protocol on standard input by calling a Python adapter.

So an adapter can run in another interpreter, with another release of its engine. The command `carom history` compares
releases of an engine in this way.
"""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import fields
from enum import Enum
from itertools import count
from typing import Annotated, Any, TypeVar

import numpy as np
from pydantic import Field, TypeAdapter, ValidationError

from carom.engines.api import Accuracy, Adapter, Capabilities, Contact, CuttableWorld, Knob, Profile, TimedWorld, World
from carom.engines.protocol import messages
from carom.errors import AdapterError, CaromError

#: Name of the only setting in the manifest of a served adapter. The value of the setting is the name of a profile. The
#: program reads all other settings from the adapter's profile. Settings of a profile can depend on the step size, but
#: settings in a manifest can't.
PROFILE = "profile"

W = TypeVar("W")
_Declared = TypeVar("_Declared", Capabilities, Accuracy)

_REQUESTS: TypeAdapter[messages.Request] = TypeAdapter(Annotated[messages.Request, Field(discriminator="do")])


class Server:
    """Answers the requests of the protocol with the worlds of an adapter.

    Args:
        adapter: Adapter of the engine.
        version: Version of the engine.
    """

    def __init__(self, adapter: Adapter, version: str) -> None:
        self._adapter, self._version = adapter, version
        self._worlds: dict[int, World] = {}
        # saved states stay in this process, because objects of an engine can't be sent
        self._saved: dict[tuple[int, int], object] = {}
        self._numbers = count(1)

    def answer(self, line: str | bytes) -> dict[str, Any]:
        """Return the answer to one request as JSON values, with None for NaN. Even an invalid line gets an answer."""
        try:
            request = _REQUESTS.validate_json(line)
        except ValidationError as error:
            first = error.errors(include_url=False)[0]
            return _build_error("refused", f"{'.'.join(map(str, first['loc'])) or 'the line'}: {first['msg']}")
        try:
            return self._carry_out(request)
        except CaromError as error:
            return _build_error("refused" if isinstance(request, messages.Prepare) else "failed", str(error))
        except Exception as error:  # noqa: BLE001 - an engine can raise anything
            return _build_error("failed", f"{type(error).__name__}: {error}")

    def close(self) -> None:
        """Close the worlds that are still open."""
        for world in self._worlds.values():
            world.close()
        self._worlds.clear()

    def _carry_out(self, request: messages.Request) -> dict[str, Any]:
        if isinstance(request, messages.Hello):
            return {"protocol": messages.PROTOCOL, "version": self._version}
        if isinstance(request, messages.Prepare):
            return self._prepare(request)
        if (world := self._worlds.get(request.world)) is None:
            raise AdapterError(f"there is no world {request.world}")
        match request:
            case messages.Step():
                return {"seconds": _take_steps(world, request.steps)}
            case messages.Look():
                return _observe(world)
            case messages.Close():
                self._worlds.pop(request.world).close()
                self._saved = {key: state for key, state in self._saved.items() if key[0] != request.world}
                return {}
        if not isinstance(world, CuttableWorld):
            raise AdapterError(f"the steps of {self._adapter.name} can't be shortened with this profile")
        match request:
            case messages.Cut():
                world.cut(request.dt_s)
            case messages.Touching():
                return {"pairs": sorted([int(first), int(second)] for first, second in world.touching())}
            case messages.Save():
                number = next(self._numbers)
                self._saved[request.world, number] = world.save()
                return {"state": number}
            case messages.Restore():
                world.restore(self._saved[request.world, request.state])
        return {}

    def _prepare(self, request: messages.Prepare) -> dict[str, Any]:
        requested = dict(request.settings)
        name = requested.pop(PROFILE, None)
        if name is not None and name not in self._adapter.profiles:
            raise AdapterError(f"{self._adapter.name} has no profile {name!r}")
        profile_settings = {} if name is None else self._adapter.profiles[str(name)].settings(float(requested["dt_s"]))
        world = self._adapter.prepare(request.scene, {**profile_settings, **requested})
        number = next(self._numbers)
        self._worlds[number] = world
        used = {key: _to_json(value) for key, value in world.settings.items()}
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
    """Take steps, and return their run time in seconds. If the world has its own clock, read this clock."""
    if isinstance(world, TimedWorld):
        before = world.seconds
        world.advance(steps)
        return world.seconds - before
    began = time.perf_counter()
    world.advance(steps)
    return time.perf_counter() - began


def _observe(world: World) -> dict[str, Any]:
    observation = world.observe()
    contacts = [_build_contact_fields(contact) for contact in observation.contacts]
    arrays = {name: getattr(observation, name) for name in ("position_m", "velocity_m_s", "spin_rad_s")}
    state = {name: _to_json(np.asarray(array, np.float64)) for name, array in arrays.items() if array is not None}
    return {**state, "contacts": contacts, "warning": observation.warning}


def _build_contact_fields(contact: Contact) -> dict[str, Any]:
    if contact.velocities is not None:
        raise AdapterError("its contacts contain velocities, which the protocol does not support")
    values = ((name, getattr(contact, name)) for name in messages.ToldContact.model_fields)
    return {name: _to_json(value) for name, value in values if value is not None}


def _to_json(value: Any) -> Any:
    """Convert a value to JSON values: arrays and tuples to lists, NumPy's numbers to Python's, and NaN to None."""
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [_to_json(item) for item in value]
    return None if isinstance(value, float) and math.isnan(value) else value


def build_manifest(adapter: Adapter, name: str, version: str, command: Sequence[str]) -> str:
    """Return a manifest, as TOML, for an adapter that is served by a command.

    Args:
        adapter: The adapter; its engine is not imported.
        name: Name of the engine in the manifest. The name must differ from the adapter's name.
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
    table = {
        "description": profile.description,
        "settings": {PROFILE: name},
        "accuracy": _find_differing(profile.accuracy, Accuracy()),
        "located": profile.located,
        "changed": dict(profile.changed),
    }
    if profile.capabilities is not None:
        # In a manifest, profiles inherit the engine's capabilities, so only differences are written.
        table["capabilities"] = _find_differing(profile.capabilities, adapter.capabilities)
    return table


def _build_knob(knob: Knob) -> dict[str, Any]:
    return {"choices": list(knob.choices)} if knob.choices else {"low": knob.low, "high": knob.high, "log": knob.log}


def _find_differing(declared: _Declared, usual: _Declared) -> dict[str, Any]:
    """Return the fields of `declared` that differ from `usual`, as they are written in a manifest."""
    pairs = ((field.name, getattr(declared, field.name), getattr(usual, field.name)) for field in fields(declared))
    return {name: _to_toml_value(value) for name, value, other in pairs if value != other}


def _to_toml_value(value: Any) -> Any:
    if isinstance(value, Enum):
        return value.name.lower()
    return list(value) if isinstance(value, tuple) else value
