"""Computes flights from a trace. A flight is a disc's path from one impact to the next."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carom.model.damping import Damping
from carom.model.trace import Trace
from carom.support.equality import ByValue


@dataclass(frozen=True, eq=False)
class Flight(ByValue):
    """A disc's path between two successive events: impacts, changes of the disc's mode, or the run's start or end.

    Attributes:
        disc: Number of the disc.
        impact: Index of the impact that ends the path, or the total number of impacts if no impact ends it.
        begin_s: Start of the path, in seconds.
        end_s: End of the path, in seconds.
        position_m: Position at the start, shape ``(2,)``.
        velocity_m_s: Velocity at the start, shape ``(2,)``.
        pull_m_s2: Acceleration, shape ``(2,)``: gravity, or the acceleration of a disc that slides or rolls on a wall.
        damping: Damping of the disc's motion.
    """

    disc: int
    impact: int
    begin_s: float
    end_s: float
    position_m: NDArray[np.float64]
    velocity_m_s: NDArray[np.float64]
    pull_m_s2: NDArray[np.float64]
    damping: Damping

    def position_at(self, time_s: float) -> NDArray[np.float64]:
        """Return the disc's position at a time."""
        flown_s = self.damping.to_undamped(time_s - self.begin_s)
        place: NDArray[np.float64] = self.position_m + self.velocity_m_s * flown_s + 0.5 * self.pull_m_s2 * flown_s**2
        return place

    def velocity_at(self, time_s: float) -> NDArray[np.float64]:
        """Return the disc's velocity at a time."""
        elapsed_s = time_s - self.begin_s
        velocity: NDArray[np.float64] = (
            self.velocity_m_s * self.damping.compute_kept_fraction(elapsed_s) + self.pull_m_s2 * elapsed_s
        )
        return velocity


def free_flights(trace: Trace) -> Iterator[Flight]:
    """Yield the flights of all discs, in the order in which the flights end."""
    count, discs = len(trace.impacts), trace.scene.discs
    place = [np.array(disc.position_m, dtype=np.float64) for disc in discs]
    velocity = list(trace.scene.arrays.velocity_m_s)
    drives = {i: disc.drive for i, disc in enumerate(discs) if disc.legs}
    pull = [np.array((0.0, 0.0) if disc.immovable else trace.scene.gravity_m_s2) for disc in discs]
    since, damping = [0.0] * len(discs), Damping(trace.scene.damping_per_s)
    table = trace.scene.table_deceleration_m_s2

    def build_flight(disc: int, impact: int, end_s: float) -> Flight:
        return Flight(disc, impact, since[disc], end_s, place[disc], velocity[disc], pull[disc], damping)

    def build_disc_flights(disc: int, impact: int, end_s: float) -> Iterator[Flight]:
        """Yield a disc's flights up to a time: several if a driven disc changes velocity, or a table stops the disc."""
        for leg in drives[disc].legs_from(since[disc])[1:] if disc in drives else ():
            if leg.begin_s >= end_s:
                break
            yield build_flight(disc, impact, leg.begin_s)
            place[disc], velocity[disc] = np.array(discs[disc].position_m) + leg.moved, np.array(leg.velocity)
            since[disc] = leg.begin_s
        if table and (speed := math.hypot(*velocity[disc])):
            pull[disc] = -table * (velocity[disc] / speed)
            if (stops_s := since[disc] + speed / table) < end_s:
                yield build_flight(disc, impact, stops_s)
                place[disc] = place[disc] + 0.5 * speed / table * velocity[disc]
                velocity[disc], pull[disc], since[disc] = np.zeros(2), np.zeros(2), stops_s
        yield build_flight(disc, impact, end_s)

    def build_mode_flights(impacts: int) -> Iterator[Flight]:
        """Yield the flights that end, before impact number `impacts`, because a disc changes its mode."""
        while modes and modes[-1]["impacts"] <= impacts:
            mode = modes.pop()
            disc = int(mode["disc"])
            yield build_flight(disc, count, float(mode["time_s"]))
            place[disc], velocity[disc], pull[disc] = mode["position"], mode["velocity"], mode["acceleration"]
            since[disc] = float(mode["time_s"])

    modes = [] if trace.modes is None else list(trace.modes[::-1])
    for k, impact in enumerate(trace.impacts):
        yield from build_mode_flights(k)
        for side in ("first", "second"):
            disc = int(impact[side])
            if disc >= 0:
                for flight in build_disc_flights(disc, k, float(impact["time_s"])):
                    yield flight
                place[disc], since[disc] = flight.position_at(flight.end_s), flight.end_s
                velocity[disc] = impact[f"velocity_{side}_after"]
    yield from build_mode_flights(count)
    for disc in range(len(discs)):
        yield from build_disc_flights(disc, count, trace.end_time_s)
