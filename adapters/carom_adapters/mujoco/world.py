"""A world of MuJoCo: the model that a scene becomes, its steps, and what is seen of them."""

from __future__ import annotations

import copy
import importlib
import itertools
import math
from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import numpy as np

from carom.adapter import (
    AdapterError,
    Contact,
    Observation,
    Scene,
    Setting,
    StepClock,
    oriented_contact,
    pair_of,
    require_supported,
    wall_body,
)
from carom_adapters.mujoco.limits import (
    CAPABILITIES,
    ENABLE_SETTINGS,
    FLAG_SETTINGS,
    LARGEST_VALUE,
    MJCF_INTEGRATORS,
    OPTION_SETTINGS,
    require_usable,
)

__all__ = ["MujocoWorld"]

#: Compiled models that are kept for scenes that differ in their start states alone: one for each profile, and a few
#: steps of each.
KEPT_MODELS = 16


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
        require_usable(scene, settings)
        require_supported("MuJoCo", scene, CAPABILITIES, float(settings["dt_s"]))
        self._asked = dict(settings)
        self._mujoco: Any = importlib.import_module("mujoco")  # untyped: its classes come from C++ without stubs
        self._mujoco.set_mju_user_warning(_ignore)
        try:
            self._model = _compiled(_mjcf(scene, settings))
            self._data = self._mujoco.MjData(self._model)
        except (ValueError, MemoryError, self._mujoco.FatalError) as error:
            raise AdapterError(f"MuJoCo refuses the scene of {len(scene.discs)} discs: {error}") from error
        self._shared = True
        self._probe: Any = None
        self._clock = StepClock(float(self._model.opt.timestep))
        # What a step of any length makes of a velocity, see `_solref`.
        self._geom_damping = self._model.geom_solref[:, 1] * self._clock.dt_s
        self._pair_damping = self._model.pair_solref[:, 1] * self._clock.dt_s
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
        self._clock.count(steps)

    def observe(self) -> Observation:
        """Read the coordinates, the contacts with a force, and the warning counters.

        MuJoCo looks for contacts and then moves the bodies, so those of step k (from 0) stand at ``k dt_s``.
        """
        position, velocity = self._position.copy(), self._velocity.copy()
        position[self._movable] = self._qpos
        velocity[self._movable] = self._qvel
        return Observation(position, velocity, tuple(self._contacts()), self._warning())

    def _contacts(self) -> list[Contact]:
        data, at_s = self._data, self._clock.step_began_s
        found: list[Contact] = []
        if not data.ncon:
            return found
        # Read as arrays: MuJoCo's bindings take long to make an object of every contact.
        rows, geoms, frames = data.contact.efc_address, data.contact.geom, data.contact.frame
        for row, (geom1, geom2), frame in zip(rows, geoms, frames, strict=True):
            force = float(data.efc_force[row]) if row >= 0 else 0.0  # -1: left out of the solver's rows
            if force <= 0:
                continue
            normal = (float(frame[0]), float(frame[1]))  # from the first geom to the second
            impulse = force * self._clock.dt_s
            found.append(oriented_contact(self._number[geom1], self._number[geom2], at_s, normal, impulse))
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
        self._clock.cut(dt_s)
        self._model.opt.timestep = dt_s
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
        return frozenset(pair_of(self._number[a], self._number[b]) for a, b in geoms[overlaps])

    def save(self) -> object:
        """Return coordinates and velocities, which with these settings are all of a state."""
        return (self._clock.now_s, self._data.qpos.copy(), self._data.qvel.copy())

    def restore(self, state: Any) -> None:
        """Put coordinates and velocities back."""
        time_s, self._data.qpos[:], self._data.qvel[:] = state
        self._clock.restart(time_s)

    def close(self) -> None:
        """Let go of model and data; their memory goes with the last reference."""
        del self._qpos, self._qvel, self._data, self._probe, self._model
