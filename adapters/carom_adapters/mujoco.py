"""Adapter of MuJoCo: contacts as soft constraints, three-dimensional, 64-bit floats; discs are spheres in one plane."""

from __future__ import annotations

import copy
import importlib
import itertools
import math
from collections.abc import Mapping
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from carom.adapter import (
    Accuracy,
    AdapterError,
    Capabilities,
    Contact,
    ContactTimes,
    Engine,
    Observation,
    Profile,
    Scene,
    Setting,
    require_sound,
    require_supported,
    wall_body,
)

if TYPE_CHECKING:
    from carom.adapter import World

__all__ = ["MujocoAdapter", "adapter"]

#: Attributes of MJCF's ``option``, and of its ``flag``, by MuJoCo's own names.
OPTION_SETTINGS = ("integrator", "jacobian", "tolerance", "iterations", "ccd_tolerance", "ccd_iterations")
FLAG_SETTINGS = ("warmstart", "autoreset")
ENABLE_SETTINGS = ("speculative",)

#: What MJCF calls the members of `mujoco.mjtIntegrator`.
MJCF_INTEGRATORS = {
    "mjINT_EULER": "Euler",
    "mjINT_RK4": "RK4",
    "mjINT_IMPLICIT": "implicit",
    "mjINT_IMPLICITFAST": "implicitfast",
    "mjINT_DISCRETE": "discrete",
}

#: ``joints`` is "free" (six a disc) or "slide" (x and y, all that a disc has). ``stiffness`` (1/s**2) is that of a
#: contact, 0 for none: see `_solref`. ``solimp`` is the attribute of a geom.
#: With ``listed_pairs`` each pair of bodies is listed in the model, and tested in every step: see `_located`.
#: ``shape`` is "sphere" or "cylinder", the latter as high as it is wide.
OTHER_SETTINGS = ("joints", "stiffness", "solimp", "listed_pairs", "shape")

#: Settings that are one of a few words.
WORDS: Mapping[str, tuple[str, ...]] = {
    "integrator": tuple(MJCF_INTEGRATORS.values()),
    "jacobian": ("dense", "sparse", "auto"),
    "joints": ("free", "slide"),
    "shape": ("sphere", "cylinder"),
}

#: MuJoCo's mjMAXVAL: a coordinate, velocity or acceleration beyond it counts as bad.
LARGEST_VALUE = 1e10

#: MuJoCo's mjMINVAL is 1e-15: it refuses a lighter body, makes up a normal for centres that are closer than this, and
#: its solver takes no step in acceleration that is smaller. The latter two are kept well away from.
SMALLEST_MASS_KG = 1e-15
SMALLEST_RADIUS_M = 1e-12
LEAST_ACCELERATION_M_S2 = 1e-12

#: A contact's regularisation, (1 - impedance) / impedance / mass with impedance 0.9999, must not fall below mjMINVAL.
LARGEST_MASS_KG = 1e11

#: Compiled models that are kept for scenes that differ in their start states alone: one for each profile, and a few
#: steps of each.
KEPT_MODELS = 16

#: Half a million pairs, which take MuJoCo seconds to compile.
MOST_LISTED = 1000


#: Cylinders touch planes and each other off the middle: up to 6.3e-4 of the scene's speed (a disc in a box, at 240
#: steps a second).
CYLINDER_ACCURACY = Accuracy(velocity=1e-3)


def _solref(stiffness: float, restitution: float, dt_s: float) -> tuple[float, float]:
    """Return a contact's ``solref`` in the form (-stiffness, -damping) for this coefficient of restitution.

    MuJoCo aims at the acceleration ``-damping * v - stiffness * depth`` along the normal, whatever the masses. Without
    stiffness, and with a damping of ``(1 + restitution) / dt``, the Euler step makes ``-restitution * v`` of ``v``: an
    impact, over in one step. With stiffness, the contact is an oscillator that leaves after half a period with
    ``restitution = exp(-pi z / sqrt(1 - z**2))``, z being its damping ratio, if it may pull at the end.
    """
    if stiffness == 0:
        return 0.0, -(1.0 + restitution) / dt_s
    loss = -math.log(restitution) if restitution > 0 else math.inf
    ratio = 1.0 if math.isinf(loss) else loss / math.hypot(math.pi, loss)
    return -stiffness, -2.0 * ratio * math.sqrt(stiffness)


def _ignore(_text: str) -> None:
    """Drop MuJoCo's warning texts, which would go to a file in the working folder; `observe` reads the counts."""


def _require_usable(scene: Scene, settings: Mapping[str, Setting]) -> None:
    """Refuse what MuJoCo would refuse in words of its own, or silently get wrong.

    Raises:
        AdapterError: A setting has an unknown name or value, or a step, mass, radius or all
            speeds are beyond one of MuJoCo's own constants.
    """
    known = (*OPTION_SETTINGS, *FLAG_SETTINGS, *ENABLE_SETTINGS, *OTHER_SETTINGS)
    require_sound("MuJoCo", scene, settings, known, {"tolerance": 0.0, "iterations": 1, "stiffness": 0.0})
    for name, words in WORDS.items():
        if name in settings and settings[name] not in words:
            raise AdapterError(f"MuJoCo: {name} must be one of {', '.join(words)}, got {settings[name]!r}")
    if settings.get("listed_pairs", False) and len(scene.discs) > MOST_LISTED:
        raise AdapterError(f"MuJoCo: listed_pairs is for at most {MOST_LISTED} discs, got {len(scene.discs)}")
    dt_s = float(settings["dt_s"])
    fastest = max(math.hypot(*disc.velocity_m_s) for disc in scene.discs)
    if 0 < fastest < LEAST_ACCELERATION_M_S2 * dt_s:
        raise AdapterError(
            f"MuJoCo: the fastest disc's speed over dt_s must be at least {LEAST_ACCELERATION_M_S2:g} m/s^2, "
            f"got {fastest:g} m/s in {dt_s:g} s: its solver would take the bounce for rounding"
        )
    for i, disc in enumerate(scene.discs):
        if not (disc.immovable or SMALLEST_MASS_KG < disc.mass_kg <= LARGEST_MASS_KG):
            limits = f"above {SMALLEST_MASS_KG:g} and at most {LARGEST_MASS_KG:g}, or inf"
            raise AdapterError(f"MuJoCo: discs[{i}].mass_kg must be {limits}, got {disc.mass_kg}")


def _attributes(**values: object) -> str:
    # repr keeps every bit of a float.
    return " ".join(f'{name}="{value if isinstance(value, str) else repr(value)}"' for name, value in values.items())


def _mjcf(scene: Scene, settings: Mapping[str, Setting]) -> str:
    """Return the model. A geom is named by its body's number, which is how contacts find their bodies again."""
    dt_s, stiffness, slide = float(settings["dt_s"]), float(settings["stiffness"]), settings["joints"] == "slide"
    # condim 1 is a contact without friction.
    listed = {"contype": "0", "conaffinity": "0"} if settings.get("listed_pairs", False) else {}
    shared = {"condim": "1"} | listed | ({"solimp": str(settings["solimp"])} if "solimp" in settings else {})

    def geom(number: int, restitution: float, **values: object) -> str:
        solref = "{!r} {!r}".format(*_solref(stiffness, restitution, dt_s))
        return f"<geom {_attributes(name=str(number), solref=solref, **shared, **values)}/>"

    def disc(i: int) -> str:
        body = scene.discs[i]
        place = "{!r} {!r} 0".format(*body.position_m)
        sphere: dict[str, object] = {"type": "sphere", "size": body.radius_m}
        if settings.get("shape", "sphere") == "cylinder":
            sphere = {"type": "cylinder", "size": f"{body.radius_m!r} {body.radius_m!r}"}
        if body.immovable:
            return geom(i, scene.restitution, pos=place, **sphere)
        if slide:
            # Its inertia about any axis is of no effect, so it is not left to a small disc to have too little of it.
            return (
                f'<body><inertial pos="0 0 0" mass="{body.mass_kg!r}" diaginertia="1 1 1"/>'
                '<joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/>'
                f"{geom(i, scene.restitution, **sphere)}</body>"
            )
        return f"<body><freejoint/>{geom(i, scene.restitution, mass=body.mass_kg, **sphere)}</body>"

    def wall(k: int) -> str:
        half_plane = scene.walls[k]
        return geom(
            wall_body(k),
            scene.wall_restitution,
            type="plane",
            size="0 0 1",  # infinite
            pos="{!r} {!r} 0".format(*half_plane.point_m),
            zaxis="{!r} {!r} 0".format(*half_plane.normal),
            # The geom of higher priority decides alone; MuJoCo would take the larger damping of the two otherwise.
            priority="1",
        )

    option = _attributes(
        timestep=dt_s,
        gravity="{!r} {!r} 0".format(*scene.gravity_m_s2),
        **{k: v for k, v in settings.items() if k in OPTION_SETTINGS},
    )
    flag = _attributes(
        **{k: "enable" if v else "disable" for k, v in settings.items() if k in FLAG_SETTINGS + ENABLE_SETTINGS}
    )
    bodies = "\n".join([*map(disc, range(len(scene.discs))), *map(wall, range(len(scene.walls)))])
    world = f"<option {option}><flag {flag}/></option><worldbody>\n{bodies}\n</worldbody>"
    if settings.get("listed_pairs", False):
        world += f"<contact>\n{_pairs(scene, settings)}\n</contact>"
    return f"<mujoco>{world}</mujoco>"


def _pairs(scene: Scene, settings: Mapping[str, Setting]) -> str:
    """Return every pair of a disc with another body, not both immovable, with a contact of its own."""
    dt_s, stiffness, discs = float(settings["dt_s"]), float(settings["stiffness"]), scene.discs
    solimp = {"solimp": str(settings["solimp"])} if "solimp" in settings else {}
    pairs = [
        (i, j, scene.restitution)
        for i in range(len(discs))
        for j in range(i + 1, len(discs))
        if not (discs[i].immovable and discs[j].immovable)
    ]
    pairs += [
        (i, wall_body(k), scene.wall_restitution)
        for i in range(len(discs))
        for k in range(len(scene.walls))
        if not discs[i].immovable
    ]

    def pair(i: int, j: int, restitution: float) -> str:
        solref = "{!r} {!r}".format(*_solref(stiffness, restitution, dt_s))
        return f"<pair {_attributes(geom1=str(i), geom2=str(j), condim='1', solref=solref, **solimp)}/>"

    return "\n".join(itertools.starmap(pair, pairs))


@lru_cache(maxsize=KEPT_MODELS)
def _compiled(mjcf: str) -> Any:
    """Compile a model, or return the one that was compiled from the same text: a sweep of start states has but one.

    Where movable discs are and how fast is no part of it.
    """
    return importlib.import_module("mujoco").MjModel.from_xml_string(mjcf)


class MujocoWorld:
    """A compiled model with data of its own."""

    def __init__(self, scene: Scene, settings: Mapping[str, Setting]) -> None:
        _require_usable(scene, settings)
        require_supported("MuJoCo", scene, MujocoAdapter.capabilities, float(settings["dt_s"]))
        self._asked = dict(settings)
        self._start_s, self._steps = 0.0, 0
        self._mujoco: Any = importlib.import_module("mujoco")  # untyped: its classes come from C++ without stubs
        self._mujoco.set_mju_user_warning(_ignore)
        try:
            self._model = _compiled(_mjcf(scene, settings))
            self._data = self._mujoco.MjData(self._model)
        except (ValueError, MemoryError, self._mujoco.FatalError) as error:
            raise AdapterError(f"MuJoCo refuses the scene of {len(scene.discs)} discs: {error}") from error
        self._shared = True
        self._probe: Any = None
        self._dt_s = float(self._model.opt.timestep)
        # What a step of any length makes of a velocity, see `_solref`.
        self._geom_damping = self._model.geom_solref[:, 1] * self._dt_s
        self._pair_damping = self._model.pair_solref[:, 1] * self._dt_s
        self._movable = np.array([i for i, disc in enumerate(scene.discs) if not disc.immovable], dtype=np.intp)
        self._position = np.array([disc.position_m for disc in scene.discs], dtype=np.float64)
        self._velocity = np.array([disc.velocity_m_s for disc in scene.discs], dtype=np.float64)
        self._number = [int(self._model.geom(i).name) for i in range(self._model.ngeom)]
        # Views of x and y of each movable disc: a free joint has a quaternion beside them, and spins.
        slide = settings["joints"] == "slide"
        self._qpos = self._data.qpos.reshape(len(self._movable), 2 if slide else 7)[:, :2]
        self._qvel = self._data.qvel.reshape(len(self._movable), 2 if slide else 6)[:, :2]
        self._qpos[:] = self._position[self._movable]
        self._qvel[:] = self._velocity[self._movable]

    @property
    def settings(self) -> Mapping[str, Setting]:
        """The settings, read back from the compiled model."""
        model, mujoco = self._model, self._mujoco
        disabled, flag = model.opt.disableflags, mujoco.mjtDisableBit
        read: dict[str, Setting] = {
            "dt_s": float(model.opt.timestep),
            "integrator": MJCF_INTEGRATORS[mujoco.mjtIntegrator(model.opt.integrator).name],
            "jacobian": mujoco.mjtJacobian(model.opt.jacobian).name.removeprefix("mjJAC_").lower(),
            "tolerance": float(model.opt.tolerance),
            "iterations": int(model.opt.iterations),
            "warmstart": not disabled & int(flag.mjDSBL_WARMSTART),
            "speculative": bool(model.opt.enableflags & int(mujoco.mjtEnableBit.mjENBL_SPECULATIVE)),
            "ccd_tolerance": float(model.opt.ccd_tolerance),
            "ccd_iterations": int(model.opt.ccd_iterations),
            "shape": self._asked.get("shape", "sphere"),
            "autoreset": not disabled & int(flag.mjDSBL_AUTORESET),
            "joints": self._asked["joints"],
            "listed_pairs": bool(model.npair),
            "stiffness": abs(float(model.geom("0").solref[0])),
            "damping": abs(float(model.geom("0").solref[1])),
            "solimp": " ".join(f"{value:g}" for value in model.geom("0").solimp),
        }
        if model.njnt:
            slide = model.jnt_type[0] == mujoco.mjtJoint.mjJNT_SLIDE
            read["joints"] = "slide" if slide else "free"
        return read

    def advance(self, steps: int) -> None:
        """Take the steps in MuJoCo's own loop."""
        self._mujoco.mj_step(self._model, self._data, nstep=steps)
        self._steps += steps

    def observe(self) -> Observation:
        """Read the coordinates, the contacts with a force, and the warning counters.

        MuJoCo looks for contacts and then moves the bodies, so those of step k (from 0) stand at ``k dt_s``.
        """
        position, velocity = self._position.copy(), self._velocity.copy()
        position[self._movable] = self._qpos
        velocity[self._movable] = self._qvel
        return Observation(position, velocity, tuple(self._contacts()), self._warning())

    def _contacts(self) -> list[Contact]:
        data, at_s = self._data, self._start_s + (self._steps - 1) * self._dt_s
        found: list[Contact] = []
        if not data.ncon:
            return found
        # Read as arrays: MuJoCo's bindings take long to make an object of every contact.
        rows, geoms, frames = data.contact.efc_address, data.contact.geom, data.contact.frame
        for row, (geom1, geom2), frame in zip(rows, geoms, frames, strict=True):
            force = float(data.efc_force[row]) if row >= 0 else 0.0  # -1: left out of the solver's rows
            if force <= 0:
                continue
            first, second = self._number[geom1], self._number[geom2]
            nx, ny = float(frame[0]), float(frame[1])  # from the first geom to the second
            if first < 0 or 0 <= second < first:
                first, second, nx, ny = second, first, -nx, -ny
            found.append(Contact(first, second, at_s, (nx, ny), force * self._dt_s))
        return found

    def _warning(self) -> str:
        kind, number = self._mujoco.mjtWarning, self._data.warning.number
        if not number.any():
            return ""
        told = []
        # Without the reset, MuJoCo only counts such a value and goes on with it, which does no harm.
        autoreset = not self._model.opt.disableflags & int(self._mujoco.mjtDisableBit.mjDSBL_AUTORESET)
        bad = number[[int(kind.mjWARN_BADQPOS), int(kind.mjWARN_BADQVEL), int(kind.mjWARN_BADQACC)]]
        if autoreset and bad.any():
            told.append(f"MuJoCo reset the state: a value was not finite or beyond {LARGEST_VALUE:g}")
        if number[[int(kind.mjWARN_CONTACTFULL), int(kind.mjWARN_CNSTRFULL)]].any():
            told.append("MuJoCo left contacts out: its memory for them is full")
        return "; ".join(told)

    def cut(self, dt_s: float) -> None:
        """Take steps of another length from here on; a contact's damping is so much per step."""
        if self._shared:  # with other worlds, whose step is another
            self._model, self._shared = copy.copy(self._model), False
        self._start_s += self._steps * self._dt_s
        self._steps = 0
        self._dt_s = self._model.opt.timestep = dt_s
        if float(self._asked["stiffness"]) == 0:
            self._model.geom_solref[:, 1] = self._geom_damping / dt_s
            self._model.pair_solref[:, 1] = self._pair_damping / dt_s

    def touching(self) -> frozenset[tuple[int, int]]:
        """Return the pairs that MuJoCo's collision detection finds to overlap, in a copy of the state."""
        if self._probe is None:
            self._probe = self._mujoco.MjData(self._model)
        self._probe.qpos[:] = self._data.qpos
        self._mujoco.mj_fwdPosition(self._model, self._probe)
        if not self._probe.ncon:
            return frozenset()
        geoms, overlaps = self._probe.contact.geom, self._probe.contact.dist < 0
        pairs = (sorted((self._number[a], self._number[b])) for a, b in geoms[overlaps])
        return frozenset((high, low) if low < 0 else (low, high) for low, high in pairs)

    def save(self) -> object:
        """Return coordinates and velocities, which with these settings are all of a state."""
        return (self._start_s + self._steps * self._dt_s, self._data.qpos.copy(), self._data.qvel.copy())

    def restore(self, state: Any) -> None:
        """Put coordinates and velocities back."""
        self._start_s, self._data.qpos[:], self._data.qvel[:] = state
        self._steps = 0

    def close(self) -> None:
        """Let go of model and data; their memory goes with the last reference."""
        del self._qpos, self._qvel, self._data, self._probe, self._model


def _default(dt_s: float) -> dict[str, Setting]:
    return {"dt_s": dt_s, "joints": "free", "stiffness": 1000.0}


def _tuned(dt_s: float) -> dict[str, Setting]:
    return {
        "dt_s": dt_s,
        "joints": "slide",
        "stiffness": 0.0,
        # The same impedance at any depth, and the highest that MuJoCo takes; it cancels out of the bounce.
        "solimp": "0.9999 0.9999 0.001 0.5 2",
        # The bounce is an Euler step of the contact's damping; the other integrators make something else of it.
        "integrator": "Euler",
        # The sparse Cholesky factorisation of MuJoCo 4.0.0 is wrong (google-deepmind/mujoco#3767).
        "jacobian": "dense",
        # The solver ends when it can do no better.
        "tolerance": 0.0,
        # A state far out is gone on with, rather than put back to the start.
        "autoreset": False,
        # Of a disc that moves so far in a step that it may pass through another, MuJoCo makes a contact ahead of time.
        "speculative": True,
    }


def _no_ccd(dt_s: float) -> dict[str, Setting]:
    return {**_tuned(dt_s), "speculative": False}


def _located(dt_s: float) -> dict[str, Setting]:
    # MuJoCo's broad phase rounds to 32 bits, and leaves out contacts shallower than about 1e-7 m; a listed pair does
    # not go through it. And a contact ahead of its time leaves no instant to be found. A warm start would begin from
    # what a step left that was taken back.
    return {**_no_ccd(dt_s), "listed_pairs": True, "warmstart": False}


def _cylinder(dt_s: float) -> dict[str, Setting]:
    # Cylinders touch along a line, of which MuJoCo keeps single points, off the middle: free to turn, they tip over.
    return {**_tuned(dt_s), "shape": "cylinder", "ccd_tolerance": 1e-12, "ccd_iterations": 500}


def _cylinder_plain(dt_s: float) -> dict[str, Setting]:
    return {**_tuned(dt_s), "shape": "cylinder", "joints": "free"}


class MujocoAdapter:
    """MuJoCo with the contact spring of its users (`default`), or reversing velocities in one step (`tuned`)."""

    name = "mujoco"
    engine = Engine("MuJoCo", module="mujoco", distribution="mujoco", install="pip install 'carom[mujoco]'")
    capabilities = Capabilities(
        gravity=True,
        restitution=(0.0, 1.0),
        restitution_combine="none",
        contact_times=ContactTimes.STEP,
        continuous_detection=True,
        max_speed_m_s=LARGEST_VALUE,
        max_coordinate_m=LARGEST_VALUE,
        min_radius_m=SMALLEST_RADIUS_M,
        dimensions=3,
    )
    profiles: Mapping[str, Profile] = {
        "default": Profile(
            "What a user of MuJoCo gets who asks for a bounce: as shipped, but frictionless, with an undamped contact "
            "spring (solref -1000 0), damped for restitution below 1 by the formula of the linear oscillator.",
            _default,
        ),
        "tuned": Profile(
            "The most exact fixed-step settings known, from Carom's own measurements: a contact is damped so that one "
            "Euler step reverses the velocity.",
            _tuned,
        ),
        "located": Profile(
            "The tuned settings without speculation, each step cut at the instant from which on MuJoCo's own collision "
            "detection finds an overlap (Carom's own bisection).",
            _located,
            located=True,
        ),
        "no-ccd": Profile("The tuned settings without continuous detection: no contact is speculated on.", _no_ccd),
        "cylinder": Profile(
            "The tuned settings with cylinders for spheres, kept from tipping over by the slide joints, and their "
            "contacts found to 1e-12 (Carom's own measurements).",
            _cylinder,
            CYLINDER_ACCURACY,
        ),
        "cylinder-plain": Profile(
            "The tuned settings with cylinders for spheres, free to turn, as a user would have them: they tip over.",
            _cylinder_plain,
        ),
    }

    def prepare(self, scene: Scene, settings: Mapping[str, Setting]) -> World:
        """Compile a model.

        Raises:
            AdapterError: The scene or a setting is outside what MuJoCo can do.
        """
        return MujocoWorld(scene, settings)


adapter = MujocoAdapter()
