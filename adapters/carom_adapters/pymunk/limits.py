"""Limits of pymunk: names of its settings, supported scenes, and input checks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from carom.engines.api import Scene, Setting, Stamp, require_sound, require_supported
from carom_adapters.shared.engine_adapter import GENERAL

#: Attributes of `pymunk.Space`, with pymunk's names. Attributes that a profile omits keep pymunk's defaults.
SPACE_SETTINGS = (
    "iterations",
    "damping",
    "collision_slop",
    "collision_bias",
    "collision_persistence",
    "idle_speed_threshold",
    "sleep_time_threshold",
)

#: Whether each segment of a chain gets its neighbours (`Segment.set_neighbors`): 1 or 0.
NEIGHBORS = "set_neighbors"
SETTINGS = (*SPACE_SETTINGS, NEIGHBORS)

#: Chipmunk compares squared distances with squared radii, and divides by masses. Between `SMALLEST` and `LARGEST`,
#: squares and quotients stay in the range of 64-bit floats (1e-308 to 1e308), so that no impact is invented or missed.
LARGEST = 1e100
SMALLEST = 1e-100

#: Smallest allowed values of settings. Smaller values are meaningless, or make Chipmunk abort.
LEAST = dict.fromkeys(SETTINGS, 0.0) | {"iterations": 1, "collision_persistence": 1, "dt_s": SMALLEST}

CAPABILITIES = replace(
    GENERAL,
    # half-planes can be conveyors, but edges can't: a shape has one surface velocity, which would be wrong on one side
    # of an edge
    belts=True,
    damping=True,
    table_friction=True,
    spin=True,
    # Because of rounding, a contact point is not exactly on the line of centres. So the normal impulse also changes the
    # spin. The error of the spin grows as the inertia decreases. With the inertia factor 1e-6, the relative error of
    # the spin is 3e-9 for discs at a distance of 200 radii from the origin.
    min_inertia_factor=1e-6,
    friction=(0.0, LARGEST),
    stamp=Stamp.END,
    max_speed_m_s=LARGEST,
    max_coordinate_m=LARGEST,
    min_radius_m=SMALLEST,
    # The largest radius is smaller than the largest coordinate, so that a scene can contain several discs of this
    # radius.
    max_radius_m=1e98,
    min_mass_kg=SMALLEST,
    max_mass_kg=LARGEST,
)


def check_inputs(scene: Scene, settings: Mapping[str, Setting]) -> float:
    """Check that pymunk supports a scene and settings, and return the step size, in seconds."""
    require_sound("pymunk", scene, settings, SETTINGS, LEAST, {"dt_s": LARGEST, NEIGHBORS: 1})
    dt_s = float(settings["dt_s"])
    require_supported("pymunk", scene, CAPABILITIES, dt_s)
    return dt_s
