"""Adapter of MuJoCo, a 3D engine with soft contacts and 64-bit floats. Discs are spheres in one plane."""

from __future__ import annotations

from dataclasses import replace

from carom.engines.api import Accuracy, Knob, Profile
from carom_adapters.mujoco.limits import CAPABILITIES
from carom_adapters.mujoco.reader import read_scene
from carom_adapters.mujoco.settings_code import write_code
from carom_adapters.mujoco.world import MujocoWorld
from carom_adapters.shared import engine_adapter as shared

#: Cylinders touch along a line, and MuJoCo's contact points are not in the middle of this line. So velocities have
#: errors of up to 6.3e-4 times the scene's speed (for a disc in a box, at 240 steps per second).
CYLINDER_ACCURACY = Accuracy(velocity=1e-3)

_DEFAULT: shared.Settings = {"joints": "free", "stiffness": 1000.0}

_TUNED: shared.Settings = {
    "joints": "slide",
    "stiffness": 0.0,
    # The setting solimp ("impedance") makes contacts as hard as MuJoCo allows, at any depth of overlap. The impedance
    # does not affect the speed after a bounce.
    "solimp": "0.9999 0.9999 0.001 0.5 2",
    # The contact's damping is chosen such that one step by Euler's method reverses the velocity. Integrators other than
    # Euler's would need another damping.
    "integrator": "Euler",
    # The sparse Cholesky factorisation of MuJoCo 4.0.0 is wrong (google-deepmind/mujoco#3767).
    "jacobian": "dense",
    # In scenes with friction, the normal force of a contact is computed first, and then friction. If MuJoCo optimised
    # both forces together, sliding bodies would lift off, at a speed equal to the friction coefficient times the
    # sliding speed.
    "in_turn": True,
    # The solver iterates until it can't improve the result.
    "tolerance": 0.0,
    # If numbers become huge, MuJoCo would by default set the scene back to its start.
    "autoreset": False,
    # If a disc moves so far in a step that it may pass through another disc, MuJoCo creates a contact before the discs
    # touch.
    "speculative": True,
}

_NO_CCD: shared.Settings = {**_TUNED, "speculative": False}

#: Settings of the profile `located`. Pairs of bodies are listed in the model, since MuJoCo's search for pairs rounds to
#: 32 bits, and misses overlaps of less than about 1e-7 m. Speculative contacts would act before bodies touch. A warm
#: start would use impulses of a step that was undone.
_LOCATED: shared.Settings = {**_NO_CCD, "listed_pairs": True, "warmstart": False}

#: Cylinders touch along a line, but MuJoCo uses only single points of this line, which are not in the middle. So
#: cylinders tip over if they can turn.
_CYLINDER: shared.Settings = {**_TUNED, "shape": "cylinder", "ccd_tolerance": 1e-12, "ccd_iterations": 500}

_PLAIN_CYLINDER: shared.Settings = {**_TUNED, "shape": "cylinder", "joints": "free"}


adapter = shared.EngineAdapter(
    name="mujoco",
    # Release 2.3 does not support the adapter's settings of a pair of bodies. MuJoCo has speculative contacts since
    # release 4.0. Releases 3.x run the profiles without speculative contacts, and report the setting as False.
    engine=shared.build_engine("MuJoCo", "mujoco", "mujoco", oldest="3.0", newest_tried="4.0"),
    capabilities=CAPABILITIES,
    knobs={
        "joints": Knob(choices=("free", "slide")),
        "stiffness": Knob(choices=(0.0, 1e2, 1e3, 1e4, 1e5, 1e6)),
        # The two values of solimp are MuJoCo's default, and the hardest contact that MuJoCo accepts.
        "solimp": Knob(choices=("0.9 0.95 0.001 0.5 2", "0.9999 0.9999 0.001 0.5 2")),
        "integrator": Knob(choices=("Euler", "RK4", "implicit", "implicitfast")),
        "jacobian": Knob(choices=("dense", "sparse")),
        "iterations": Knob(1, 1000, log=True),
        "tolerance": Knob(choices=(0.0, 1e-8)),
        "in_turn": Knob(choices=(False, True)),
        "speculative": Knob(choices=(False, True)),
    },
    profiles={
        "default": Profile(
            "MuJoCo's defaults with the scene's friction, and with a contact spring that lets bodies bounce (solref "
            "-1000 0). If the restitution is below 1, the spring also has the damping for this restitution.",
            shared.add_step(_DEFAULT),
            capabilities=replace(CAPABILITIES, continuous_detection=False),
            changed={
                "stiffness": "solref is -1000 0, a common spring, because nothing bounces with the default 0.02 1",
                "damping": "damping of the contact spring, computed from the scene's restitution",
                "friction": shared.OF_THE_SCENE,
                "condim": "1 (contacts without friction) if the scene has no friction",
            },
        ),
        "tuned": shared.build_tuned_profile("a contact is damped so that one Euler step reverses the velocity", _TUNED),
        "located": shared.build_located_profile(
            "MuJoCo's own collision detection", _LOCATED, but=" without speculative contacts"
        ),
        "no-ccd": Profile("The tuned settings without continuous detection.", shared.add_step(_NO_CCD)),
        "cylinder": Profile(
            "The tuned settings with cylinders instead of spheres. Slide joints keep the cylinders from tipping over, "
            "and MuJoCo finds contacts with a tolerance of 1e-12 (Carom's own measurements).",
            shared.add_step(_CYLINDER),
            CYLINDER_ACCURACY,
        ),
        "cylinder-plain": Profile(
            "The tuned settings with cylinders instead of spheres. The cylinders can turn, so they tip over.",
            shared.add_step(_PLAIN_CYLINDER),
        ),
    },
    world=MujocoWorld,
    code=write_code,
    read=read_scene,
)
