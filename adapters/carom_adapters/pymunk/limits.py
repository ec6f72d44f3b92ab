"""Limits of pymunk: its settings by name, the range of scenes, and input checks."""

from __future__ import annotations

from collections.abc import Mapping

from carom.engines.api import Capabilities, ContactTimes, Scene, Setting, Stamp, require_sound, require_supported

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

#: Rounding moves a contact point off the line of centres, so an impulse there turns the disc. A smaller inertia lets
#: the disc turn more. With this inertia factor, the relative change of the spin is 3e-9 for discs at 200 radii from the
#: origin.
LEAST_INERTIA_FACTOR = 1e-6

#: Several discs of this radius still fit within the largest coordinates.
LARGEST_RADIUS_M = 1e98

CAPABILITIES = Capabilities(
    segments=True,
    posts=True,
    wall_materials=True,
    driven_walls=True,
    driven_discs=True,
    legs=True,
    belts=True,  # half-planes only: a shape has one surface velocity, so the far side of an edge would run backwards
    gravity=True,
    damping=True,
    table_friction=True,
    restitution=(0.0, 1.0),
    spin=True,
    min_inertia_factor=LEAST_INERTIA_FACTOR,
    friction=(0.0, LARGEST),
    contact_times=ContactTimes.STEP,
    stamp=Stamp.END,
    max_speed_m_s=LARGEST,
    max_coordinate_m=LARGEST,
    min_radius_m=SMALLEST,
    max_radius_m=LARGEST_RADIUS_M,
    min_mass_kg=SMALLEST,
    max_mass_kg=LARGEST,
)


def check_inputs(scene: Scene, settings: Mapping[str, Setting]) -> float:
    """Check that pymunk supports a scene and settings, and return the step size, seconds."""
    require_sound("pymunk", scene, settings, SETTINGS, LEAST, {"dt_s": LARGEST, NEIGHBORS: 1})
    dt_s = float(settings["dt_s"])
    require_supported("pymunk", scene, CAPABILITIES, dt_s)
    return dt_s
