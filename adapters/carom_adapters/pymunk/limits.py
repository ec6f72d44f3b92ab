"""Limits of pymunk: its settings by name, the range of scenes, and input checks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from carom.engines.api import Scene, Setting, Stamp, require_sound, require_supported
from carom_adapters.shared.engine_adapter import GENERAL

#: Attributes of `pymunk.Space`, by pymunk's own names. Attributes that a profile omits keep pymunk's defaults.
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

#: Chipmunk compares squared distances with squared radii, and divides by masses. Between these bounds squares and
#: quotients stay in the range of 64-bit floats (1e-308 to 1e308), so that no impact is invented or missed.
LARGEST = 1e100
SMALLEST = 1e-100

#: Least values of settings. Smaller values have no meaning, or make Chipmunk abort.
LEAST = dict.fromkeys(SETTINGS, 0.0) | {"iterations": 1, "collision_persistence": 1, "dt_s": SMALLEST}

CAPABILITIES = replace(
    GENERAL,
    belts=True,  # half-planes only: a shape has one surface velocity, so the far side of an edge would run backwards
    damping=True,
    table_friction=True,
    spin=True,
    # Rounding moves a contact point off the line of centres, so an impulse there turns the disc. A smaller inertia lets
    # the disc turn more. With this inertia factor, the relative change of the spin is 3e-9 for discs at 200 radii from
    # the origin.
    min_inertia_factor=1e-6,
    friction=(0.0, LARGEST),
    stamp=Stamp.END,
    max_speed_m_s=LARGEST,
    max_coordinate_m=LARGEST,
    min_radius_m=SMALLEST,
    # Several discs of this radius still fit within the largest coordinates.
    max_radius_m=1e98,
    min_mass_kg=SMALLEST,
    max_mass_kg=LARGEST,
)


def check_inputs(scene: Scene, settings: Mapping[str, Setting]) -> float:
    """Check that pymunk supports a scene and settings, and return the step size, seconds."""
    require_sound("pymunk", scene, settings, SETTINGS, LEAST, {"dt_s": LARGEST, NEIGHBORS: 1})
    dt_s = float(settings["dt_s"])
    require_supported("pymunk", scene, CAPABILITIES, dt_s)
    return dt_s
