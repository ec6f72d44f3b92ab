"""Adapter of pymunk (Chipmunk2D), an impulse-based two-dimensional engine with 64-bit floats."""

from __future__ import annotations

from carom.engines.api import Knob, Profile
from carom_adapters.pymunk.limits import CAPABILITIES, NEIGHBORS
from carom_adapters.pymunk.reader import read_scene
from carom_adapters.pymunk.settings_code import write_code
from carom_adapters.pymunk.world import PymunkWorld
from carom_adapters.shared import engine_adapter as shared

_TUNED: shared.Settings = {
    # Chipmunk solves simultaneous contacts by iteration, and the remaining error changes the energy. In a break shot of
    # ten discs, the energy grows by a fraction of 2e-7 with the default of 10 iterations, and by 2e-14 with 20
    # iterations.
    "iterations": 20,
    # By default Chipmunk pushes overlapping bodies apart, in addition to their bounce. `collision_bias` is the fraction
    # of an overlap that is left after a second. With the value 1, bodies are never pushed apart.
    "collision_bias": 1.0,
    # A disc that slides over the joint of two segments gets caught on the joint, unless each segment has the other as
    # its neighbour.
    NEIGHBORS: 1,
}


adapter = shared.EngineAdapter(
    name="pymunk",
    # Release 5.4.1 reports no contacts to the adapter, although bodies bounce. Release 5.7.0 reports contacts.
    engine=shared.build_engine("pymunk", "pymunk", "pymunk", oldest="5.7", newest_tried="7.3"),
    capabilities=CAPABILITIES,
    knobs={
        "iterations": Knob(1, 100, log=True),
        "collision_bias": Knob(0.0, 1.0),
        "collision_slop": Knob(1e-3, 1e3, log=True),
        "collision_persistence": Knob(1, 10),
    },
    profiles={
        "default": Profile(
            "pymunk's defaults (without damping), with the scene's restitution and friction.",
            shared.add_step({}),
            changed={"elasticity": shared.OF_THE_SCENE, "friction": shared.OF_THE_SCENE, "moment": shared.NOT_TURNED},
        ),
        "tuned": shared.build_tuned_profile("overlapping bodies are never pushed apart", _TUNED),
        "located": shared.build_located_profile("Chipmunk's own collision test", _TUNED),
    },
    world=PymunkWorld,
    code=write_code,
    read=read_scene,
)
