"""Balls that are dropped and come to rest, or should: their speeds after that, from eight starts."""

import math

import numpy as np
from numpy.typing import NDArray
from tests.scene_builders import staged, wall_at

from carom import Disc, Scene
from carom.engines.api import Adapter, Setting

G, RADIUS_M, STARTS = 10.0, 0.5, 8


def build_floor_scene(
    disc: Disc, duration_s: float, *, fall: float = 0.0, e: float = 0.0, friction: float = 0.0
) -> Scene:
    """Return a scene of a disc on the line y = 0; `fall` is the tangent by which gravity leans."""
    long = math.hypot(1.0, fall)
    laws = {"gravity_m_s2": (G * fall / long, -G / long), "wall_restitution": e, "wall_friction": friction}
    return staged("rest", disc, wall_at(0, 0, 0, 1), **laws, duration_s=duration_s)


def measure_speeds_at_rest(
    engine: Adapter, profile: str, rate_hz: float, e: float = 0.5, **changes: Setting
) -> list[NDArray[np.float64]]:
    """Return the speeds away from the floor, step by step, from a second after each ball is at rest, for 4 s."""
    found = []
    for start in range(STARTS):
        height = 1.0 + 0.03 * start / STARTS
        rests_s = math.sqrt(2.0 * height / G) * (1.0 + e) / (1.0 - e)
        scene = build_floor_scene(Disc(position_m=(0, RADIUS_M + height), radius_m=RADIUS_M), rests_s + 5.0, e=e)
        world = engine.prepare(scene, {**engine.profiles[profile].settings(1.0 / rate_hz), **changes})
        world.advance(math.ceil((rests_s + 1.0) * rate_hz))
        speeds = []
        for _ in range(round(4.0 * rate_hz)):
            world.advance(1)
            speeds.append(world.observe().velocity_m_s[0, 1])
        world.close()
        found.append(np.array(speeds))
    return found


def count_take_offs(speeds: NDArray[np.float64], rate_hz: float) -> int:
    """Return how often a ball leaves the floor faster than by half of what it falls in a step."""
    up = speeds > 0.5 * G / rate_hz
    return int(np.sum(up[1:] & ~up[:-1]))


def list_hopping_balls(speeds: list[NDArray[np.float64]], rate_hz: float) -> list[bool]:
    """Return whether each ball takes off five times a second or more."""
    return [count_take_offs(of_start, rate_hz) >= 20 for of_start in speeds]
