"""A method that is right, and one profile for each fault planted in it, to be installed as somebody else's would be.

It plays back what `carom.solve_pic` found, step by step. `told` profiles return the velocities around a contact, as a
method that knows them does; the others leave them to be read from the states, as an engine does.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from carom import Scene, Trace, solve_pic
from carom.engines.api import Capabilities, Contact, Engine, Observation, Profile, Setting

Array = NDArray[np.float64]

#: Every fault; `told` says in which form a method can have it.
FAULTS = (
    "none", "told-none", "stamped-late", "stamped-at-0", "normal-1", "normal-90", "normal-reversed", "normal-long",
    "told-normal-1", "told-before", "told-stamped-early", "dropped", "told-dropped", "told-doubled", "swapped-states",
    "told-swapped-states", "drifting", "slow", "damped", "turning", "nan-state", "nan-normal", "nan-impulse",
    "told-nan-velocity", "told-infinite-time",
)  # fmt: skip


class World:
    """A run played back, with one fault."""

    def __init__(self, scene: Scene, settings: Mapping[str, Setting]) -> None:
        self.settings = settings
        self._fault = str(settings["fault"])
        self._dt_s = float(settings["dt_s"])
        self._steps = 0
        self._trace = solve_pic(scene)
        last_s = float(self._trace.impacts["time_s"][-1]) if len(self._trace.impacts) else 0.0
        self._last_step = math.ceil(last_s / self._dt_s)

    def advance(self, steps: int) -> None:
        self._steps += steps

    def observe(self) -> Observation:
        time_s, begun_s = self._steps * self._dt_s, (self._steps - 1) * self._dt_s
        position, velocity = state_at(self._trace, time_s)
        impacts = self._trace.impacts
        contacts = [
            self._contact(impacts[k], k == len(impacts) - 1)
            for k in np.flatnonzero((impacts["time_s"] > begun_s) & (impacts["time_s"] <= time_s))
        ]
        match self._fault.removeprefix("told-"):
            case "dropped" if self._steps == self._last_step:
                contacts = []
            case "doubled" if self._steps == self._last_step + 1:
                contacts = [self._contact(impacts[-1], last=True)]
            case "swapped-states":
                position, velocity = position[::-1].copy(), velocity[::-1].copy()
            case "drifting":
                position = position + np.array([0.0, 0.01 * self._steps])
            case "slow":
                start = np.array([disc.position_m for disc in self._trace.scene.discs])
                position = start + 0.99 * (position - start)
            case "damped" if self._steps > self._last_step:
                velocity = velocity * 0.98 ** (self._steps - self._last_step)
            case "turning" if self._steps > self._last_step:
                velocity = velocity @ np.array([[0.0, 1.0], [-1.0, 0.0]])
            case "nan-state" if self._steps > self._last_step:
                velocity = velocity * math.nan
        return Observation(position, velocity, tuple(contacts))

    def _contact(self, impact: np.void, last: bool) -> Contact:
        """Return the contact, with the fault where it is the last one; reported or to be read from the states."""
        fault, first, second = self._fault, int(impact["first"]), int(impact["second"])
        time_s, normal = float(impact["time_s"]), impact["normal"]
        impulse: float | None = None
        velocities = np.array([impact[f"velocity_{b}_{w}"] for w in ("before", "after") for b in ("first", "second")])
        if last:
            match fault.removeprefix("told-"):
                case "stamped-late":
                    time_s += 22 * self._dt_s
                case "stamped-early":
                    time_s -= 0.5 * self._dt_s
                case "stamped-at-0":
                    time_s = 0.0
                case "infinite-time":
                    time_s = math.inf
                case "normal-1" | "normal-90" as turned:
                    angle = math.radians(float(turned.rpartition("-")[2]))
                    normal = normal @ np.array(
                        [[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]]
                    )
                case "normal-reversed":
                    normal = -normal
                case "normal-long":
                    normal = 5.0 * normal
                case "nan-normal":
                    normal = normal * math.nan
                case "nan-impulse":
                    impulse = math.nan
                case "before":
                    velocities[0] += 0.5 * normal
                case "nan-velocity":
                    velocities[3] = math.nan
        told = tuple((float(x), float(y)) for x, y in velocities) if fault.startswith("told-") else None
        return Contact(first, second, time_s, (float(normal[0]), float(normal[1])), impulse, told)  # type: ignore[arg-type] # four of them

    def close(self) -> None:
        pass


def state_at(trace: Trace, time_s: float) -> tuple[Array, Array]:
    """Return where every disc is at a time, on straight lines from impact to impact, and how fast."""
    place = np.array([disc.position_m for disc in trace.scene.discs])
    velocity = np.array([disc.velocity_m_s for disc in trace.scene.discs])
    since = np.zeros(len(place))
    for impact in trace.impacts[trace.impacts["time_s"] <= time_s]:
        for body in ("first", "second"):
            if (disc := int(impact[body])) >= 0:
                place[disc] += velocity[disc] * (impact["time_s"] - since[disc])
                velocity[disc], since[disc] = impact[f"velocity_{body}_after"], impact["time_s"]
    return place + velocity * (time_s - since)[:, None], velocity


class Adapter:
    """The adapter: a profile a fault."""

    name = "planted"
    engine = Engine("Planted")
    capabilities = Capabilities()

    def __init__(self) -> None:
        self.profiles = {fault: self._profile(fault) for fault in FAULTS}

    @staticmethod
    def _profile(fault: str) -> Profile:
        return Profile(f"Right, but for: {fault}.", lambda dt_s: {"dt_s": dt_s, "fault": fault})

    def prepare(self, scene: Scene, settings: Mapping[str, Setting]) -> World:
        return World(scene, settings)


adapter = Adapter()
