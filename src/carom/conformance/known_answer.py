"""A known answer as a trace, so that the comparator can hold a run against mathematics and not against a solver."""

from __future__ import annotations

import math

import numpy as np

from carom.errors import InputError
from carom.scene import Scene
from carom.scenes import KnownAnswer
from carom.trace import ImpactRecord, Trace, impact_array, wall_index

__all__ = ["trace_of"]


def trace_of(scene: Scene, known: KnownAnswer) -> Trace:
    """Return the trace that a complete known answer describes; between impacts, discs move in straight lines.

    Raises:
        InputError: The answer does not tell every impact of the scene with the velocities after it.
    """
    if known.count != len(known.impacts):
        raise InputError(f"the known answer of {scene.name!r} tells {len(known.impacts)} of {known.count} impacts")
    position = np.array([disc.position_m for disc in scene.discs])
    velocity = np.array([disc.velocity_m_s for disc in scene.discs])
    records, now_s = [], 0.0
    for known_impact in known.impacts:
        first, second, after = known_impact.first, known_impact.second, known_impact.velocity_first_after
        if after is None:
            raise InputError(f"the known answer of {scene.name!r} lacks the velocities after {known_impact.time_s} s")
        position += velocity * (known_impact.time_s - now_s)
        now_s = known_impact.time_s
        if second < 0:
            x, y = scene.walls[wall_index(second)].normal
            normal, before_second, after_second = (-x, -y), (0.0, 0.0), (0.0, 0.0)
        else:
            x, y = position[second] - position[first]
            normal = (float(x / math.hypot(x, y)), float(y / math.hypot(x, y)))
            before_second = (float(velocity[second][0]), float(velocity[second][1]))
            after_second = known_impact.velocity_second_after or before_second
        before = (float(velocity[first][0]), float(velocity[first][1]))
        records.append(ImpactRecord(now_s, first, second, normal, before, before_second, after, after_second))
        velocity[first] = after
        if second >= 0:
            velocity[second] = after_second
    return Trace(
        method="known answer",
        scene=scene,
        impacts=impact_array(records),
        final_position_m=position + velocity * (scene.duration_s - now_s),
        final_velocity_m_s=velocity,
        end_time_s=scene.duration_s,
    )
