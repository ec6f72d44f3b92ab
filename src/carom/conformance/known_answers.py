"""Lists the suite's scenes from the catalogue, and converts their known answers to traces.

With known answers, the suite compares runs with exact solutions instead of results of a solver.
"""

from __future__ import annotations

import math

import numpy as np

from carom.catalogue import KnownAnswer
from carom.errors import InputError
from carom.model.scene import Scene
from carom.model.trace import ImpactRecord, Trace, build_impact_array, build_spin_array, wall_index

#: Names of the suite's scenes from the catalogue. New catalogue scenes are not added automatically, so that existing
#: adapters get no new cases. The list has no scene with several possible answers, and no chaotic scene.
CATALOGUE_SCENES = (
    "paper/missed",
    "paper/late",
    "paper/wrong-direction",
    "paper/multiple",
    "classics/head-on",
    "classics/oblique-3-4-5",
    "classics/inelastic-oblique",
    "classics/perfectly-inelastic",
    "classics/deflection",
    "classics/graze",
    "classics/miss",
    "classics/touching-apart",
    "classics/mass-ratio-1000",
    "classics/bullet",
    "classics/box",
    "classics/restitution-ladder",
    "classics/slanted-wall",
    "classics/bank-shot",
    "classics/sorting",
    "classics/cradle-gaps",
    "spin/grip",
    "spin/slide",
    "spin/striker-slide",
    "spin/throw-slide",
    "spin/throw-stick",
    "spin/gearing",
    "spin/english-stick",
    "spin/english-slide",
)


#: Names of the scenes for the profile `located`: head-on, off-centre, inelastic and successive impacts, impacts on
#: walls, and impacts with friction.
LOCATED_SCENES = (
    "paper/missed",
    "paper/late",
    "classics/head-on",
    "classics/oblique-3-4-5",
    "classics/perfectly-inelastic",
    "classics/slanted-wall",
    "classics/cradle-gaps",
    "spin/grip",
    "spin/throw-slide",
    "spin/english-stick",
)


def build_known_trace(scene: Scene, known: KnownAnswer) -> Trace:
    """Convert the known answer of a scene to a trace. Discs must move in straight lines between impacts.

    Raises:
        InputError: The known answer lacks some impacts of the scene, or some velocities after impacts.
    """
    if known.count != len(known.impacts):
        raise InputError(f"the known answer of {scene.name!r} has only {len(known.impacts)} of {known.count} impacts")
    arrays, turns = scene.arrays, scene.arrays.turns
    position = arrays.position_m.copy()
    # Velocities and spins have one more row, for the walls, which stand still.
    velocity, spin = np.vstack([arrays.velocity_m_s, np.zeros(2)]), np.append(arrays.spins, 0.0)
    records, now_s = [], 0.0
    for impact in known.impacts:
        first, second = impact.first, max(impact.second, -1)
        if impact.velocity_first_after is None:
            raise InputError(f"the known answer of {scene.name!r} lacks the velocities after {impact.time_s} s")
        if turns and (impact.spin_first_after is None or (second >= 0 and impact.spin_second_after is None)):
            raise InputError(f"the known answer of {scene.name!r} lacks the spins after {impact.time_s} s")
        position += velocity[:-1] * (impact.time_s - now_s)
        now_s = impact.time_s
        if second < 0:
            x, y = scene.half_planes()[wall_index(impact.second)].normal
            normal = (-x, -y)
        else:
            x, y = (position[second] - position[first]).tolist()
            normal = (x / math.hypot(x, y), y / math.hypot(x, y))
        before, spins_before = velocity[[first, second]].tolist(), spin[[first, second]].tolist()
        velocity[first], velocity[second] = impact.velocity_first_after, impact.velocity_second_after or before[1]
        spin[first], spin[second] = impact.spin_first_after or 0.0, impact.spin_second_after or 0.0
        (a, b), (c, d) = map(tuple, before), map(tuple, velocity[[first, second]].tolist())
        spins = (*spins_before, *spin[[first, second]].tolist()) if turns else None
        records.append(ImpactRecord(now_s, first, impact.second, normal, a, b, c, d, spins))
    velocity, spin = velocity[:-1], spin[:-1]
    return Trace(
        method="known answer",
        scene=scene,
        impacts=build_impact_array(records),
        final_position_m=position + velocity * (scene.duration_s - now_s),
        final_velocity_m_s=velocity,
        end_time_s=scene.duration_s,
        spins=build_spin_array(records) if turns else None,
        final_spin_rad_s=spin if turns else None,
    )
