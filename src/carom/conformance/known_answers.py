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
    position = np.array([disc.position_m for disc in scene.discs])
    velocity = np.array([disc.velocity_m_s for disc in scene.discs])
    spin, turns = scene.arrays.spins.copy(), scene.arrays.turns
    records, now_s = [], 0.0
    for known_impact in known.impacts:
        first, second, after = known_impact.first, known_impact.second, known_impact.velocity_first_after
        if after is None:
            raise InputError(f"the known answer of {scene.name!r} lacks the velocities after {known_impact.time_s} s")
        spin_first, spin_second = known_impact.spin_first_after, known_impact.spin_second_after
        if turns and (spin_first is None or (second >= 0 and spin_second is None)):
            raise InputError(f"the known answer of {scene.name!r} lacks the spins after {known_impact.time_s} s")
        position += velocity * (known_impact.time_s - now_s)
        now_s = known_impact.time_s
        ux, uy = velocity[first].tolist()
        if second < 0:
            x, y = scene.half_planes()[wall_index(second)].normal
            normal, before_second, after_second = (-x, -y), (0.0, 0.0), (0.0, 0.0)
            spins = (float(spin[first]), 0.0, spin_first or 0.0, 0.0)
        else:
            x, y = (position[second] - position[first]).tolist()
            vx, vy = velocity[second].tolist()
            normal, before_second = (x / math.hypot(x, y), y / math.hypot(x, y)), (vx, vy)
            velocity[second] = after_second = known_impact.velocity_second_after or before_second
            spins = (float(spin[first]), float(spin[second]), spin_first or 0.0, spin_second or 0.0)
            spin[second] = spins[3]
        own_spins = spins if turns else None
        velocities = ((ux, uy), before_second, after, after_second)
        records.append(ImpactRecord(now_s, first, second, normal, *velocities, own_spins))
        velocity[first], spin[first] = after, spins[2]
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
