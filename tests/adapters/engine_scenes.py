"""Scenes that several of these tests stage, and what the width of an engine's floats does to a number."""

import math

import numpy as np
from tests.scene_builders import disc_at, staged, wall_at

from carom import Chain, Scene
from carom.engines.api import Adapter


def build_oblique_scene(length: float = 1.0, mass: float = 1.0, time: float = 1.0, x_m: float = 0.0) -> Scene:
    """Two discs of masses 1:2 that meet off their line of centres; the first comes back and leaves a slanted wall.

    Lengths, masses and times are scaled by the three factors, and all is moved by `x_m`.
    """
    speed = length / time
    return staged(
        "oblique",
        disc_at(x_m, 0, 3 * speed, r=0.5 * length, m=mass),
        disc_at(x_m + 1.72 * length, 0.3 * length, -speed, 0.1 * speed, r=0.5 * length, m=2 * mass),
        wall_at(x_m - length, 0, 1, 0.2),
        duration_s=1.5 * time,
    )


def build_cradle_scene() -> Scene:
    """A disc that runs into the end of a row of four in contact."""
    row = [disc_at(i, 0) for i in range(4)]
    return staged("cradle", disc_at(-1.51, 0, 1), *row, duration_s=2.0)


def build_break_scene() -> Scene:
    """A disc that runs into the tip of a triangle of ten in contact."""
    pitch = 1 + 1e-7  # touching, except for the rounding of the root of 3
    rack = [disc_at(math.sqrt(0.75) * pitch * row, (k - row / 2) * pitch) for row in range(4) for k in range(row + 1)]
    return staged("break", disc_at(-3, 0.013, 5), *rack, duration_s=1.0)


def build_floor_scene(pieces: int, phase: float, approach_m_s: float = 2.0, *, half_width_m: float = 0.0) -> Scene:
    """Return a disc that lands at 5 m/s along a floor in pieces, after 0.3 s, this fraction of a metre further left.

    Ten pieces are a metre long: at ten phases and more of them the disc lands before, on and behind a joint.
    """
    speed, radius, lands_s = 5.0, 0.25, 0.3
    start = (-3.0 - phase, radius + half_width_m + lands_s * approach_m_s)
    floor = Chain(points_m=[(-5.0, 0.0), (5.0, 0.0)], pieces=pieces, half_width_m=half_width_m)
    disc = disc_at(*start, speed, -approach_m_s, r=radius)
    return staged("along a floor", disc, floor, duration_s=1.0, frame_rate_hz=60.0)


def build_thin_wall_scene(q: float, phase: float, *, half_width_m: float = 0.0) -> Scene:
    """Return a disc that flies q of its reach a step, head-on at an edge, and is there this fraction of a step later.

    Its reach is its radius and the half width of the wall. What looks once a step has 1/q of all phases to see it in.
    """
    dt_s, radius = 1 / 60, 0.1
    reach = radius + half_width_m
    step_m = q * reach
    wall = Chain(points_m=[(0.0, -2.0), (0.0, 2.0)], half_width_m=half_width_m)
    # Six steps and a phase before it touches, and six after.
    flying = disc_at(-reach - (6 + phase) * step_m, 0, step_m / dt_s, r=radius)
    return staged("at a thin wall", flying, wall, duration_s=12 * dt_s, frame_rate_hz=60.0)


def scale_tolerance(adapter: Adapter, tolerance: float) -> float:
    """Return a tolerance that was derived from the rounding of 64-bit floats, at the width of the engine's own."""
    return tolerance * 2.0 ** {64: 0, 32: 53 - 24}[adapter.capabilities.float_bits]


def round_to_engine(adapter: Adapter, values: object) -> object:
    """Return numbers as the engine holds them, rounded to its own width."""
    return np.array(values, dtype=f"f{adapter.capabilities.float_bits // 8}").astype(np.float64).tolist()
