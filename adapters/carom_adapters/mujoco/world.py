"""World of MuJoCo: compiles the model of a scene, takes steps, and reads states and contacts."""

from __future__ import annotations

import copy
import importlib
from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from carom.engines.api import (
    AdapterError,
    Contact,
    Observation,
    Scene,
    Setting,
    StepClock,
    flattened,
    oriented_contact,
    pair_of,
)
from carom_adapters.mujoco.limits import LARGEST_VALUE, MJCF_INTEGRATORS, require_usable
from carom_adapters.mujoco.model import build_mjcf, choose_mass_unit, list_axis_dampings, parse_body, sort_bodies
from carom_adapters.shared.legs import Driven, Legs, find_first_velocity
from carom_adapters.shared.walls import find_walls_in_pieces, sum_contacts

#: Number of compiled models in the cache. Scenes that differ only in their initial states share a model. The cache has
#: room for the models of all profiles with a few step sizes.
KEPT_MODELS = 16


def _ignore(_text: str) -> None:
    """Ignore the text of a warning, which MuJoCo would write to a file in the working folder.

    Instead, `observe` reads MuJoCo's counters of warnings.
    """


@lru_cache(maxsize=KEPT_MODELS)
def _compile(text: str) -> Any:
    """Compile a model, or return the model that was compiled from the same text.

    The text does not contain positions and velocities of movable discs. So scenes that differ only in the states of
    movable discs share a compiled model.
    """
    return importlib.import_module("mujoco").MjModel.from_xml_string(text)


#: Flags that early releases of MuJoCo lack. For each flag in MJCF: the name of MuJoCo's enumeration, and the name of
#: its member.
_LATER = {"speculative": ("mjtEnableBit", "mjENBL_SPECULATIVE"), "autoreset": ("mjtDisableBit", "mjDSBL_AUTORESET")}


def _find_flag_bit(mujoco: Any, flag: str) -> int:
    """Return the bit of a flag.

    If this release of MuJoCo lacks the flag, return 0, so that the flag is reported as not set.
    """
    kind, member = _LATER[flag]
    return int(getattr(getattr(mujoco, kind), member, 0))


class MujocoWorld:
    """A compiled model, and its state."""

    def __init__(self, scene: Scene, settings: Mapping[str, Setting]) -> None:
        require_usable(scene, settings)
        self._requested_settings = dict(settings)
        self._mujoco: Any = importlib.import_module("mujoco")  # untyped, because its C++ classes have no stubs
        self._mujoco.set_mju_user_warning(_ignore)
        try:
            # Leave out flags that this release lacks. Missing flags are later reported as not set.
            lacking = {name for name in _LATER if not _find_flag_bit(self._mujoco, name)}
            known = {name: value for name, value in settings.items() if name not in lacking}
            self._model = _compile(build_mjcf(scene, known))
            self._data = self._mujoco.MjData(self._model)
        except (ValueError, MemoryError, self._mujoco.FatalError) as error:
            raise AdapterError(f"MuJoCo refuses the scene of {len(scene.discs)} discs: {error}") from error
        # Views of MuJoCo's arrays are kept, since creating a view takes long.
        self._warnings, self._qpos, self._qvel = self._data.warning.number, self._data.qpos, self._data.qvel
        self._is_model_shared = True
        #: A view of each array of contact dampings in the model, and the array's values times the step size.
        self._dampings: list[tuple[NDArray[np.float64], NDArray[np.float64]]] = []
        self._probe: Any = None
        self._clock = StepClock(float(self._model.opt.timestep))
        # Damping times step size, a product that is the same for all step sizes; see `_compute_solref`.
        self._geom_damping = self._model.geom_solref[:, 1] * self._clock.dt_s
        self._pair_damping = self._model.pair_solref[:, 1] * self._clock.dt_s
        self._friction_damping = self._model.pair_solreffriction[:, 1] * self._clock.dt_s
        self._turns = scene.arrays.turns
        # Normals of cylinders lean out of the plane, although slide joints keep the cylinders upright. Normals of free
        # spheres lean out of the plane after some dozen impacts, since each impact amplifies rounding errors
        # perpendicular to the plane.
        self._can_lean = settings.get("shape", "sphere") == "cylinder" or settings["joints"] == "free"
        self._unit = choose_mass_unit(scene, settings)
        self._walls_in_pieces = find_walls_in_pieces(scene)
        discs = [one for one in sort_bodies(scene) if one >= 0]
        # In MuJoCo, driven discs are also moving bodies.
        moving = [i for i in discs if scene.discs[i].driven or not scene.discs[i].immovable]
        self._movable = np.array(moving, dtype=np.intp)
        self._position = np.array([disc.position_m for disc in scene.discs], dtype=np.float64)
        self._has_joints = any(not disc.immovable for disc in scene.discs)
        self._velocity = np.array([disc.velocity_m_s for disc in scene.discs], dtype=np.float64)
        self._body_number = [parse_body(self._model.geom(i).name) for i in range(self._model.ngeom)]
        self._spin = scene.arrays.spins.copy()
        # Indices of x and y of each movable disc, and of the spins of discs that turn. The bodies of the model have the
        # order of the movable discs. The spin is the disc's last coordinate.
        model, movable = self._model, slice(1, 1 + len(self._movable))
        joint = model.body_jntadr[movable]
        self._at = model.jnt_qposadr[joint][:, np.newaxis] + np.arange(2)
        self._moves = model.body_dofadr[movable][:, np.newaxis] + np.arange(2)
        # The third coordinate of a free joint is the distance of the centre from the plane. A free joint does not keep
        # the distance at 0.
        self._free = np.flatnonzero(model.jnt_type[joint] == self._mujoco.mjtJoint.mjJNT_FREE)
        self._height_at = model.jnt_qposadr[joint[self._free]] + 2
        for body in 1 + self._free:  # the model may be shared, but all worlds set the same values
            about = list_axis_dampings(scene, settings, model.body_inertia[body].tolist())
            if about is not None:
                model.dof_damping[model.body_dofadr[body] + 3 : model.body_dofadr[body] + 6] = about
        self._radius = scene.arrays.radius_m[self._movable][self._free]
        # If the sum of the squared distances from the plane is below `_low`, no disc is off the plane by more than its
        # radius, so the distances need not be checked one by one.
        self._low = 0.25 * float(np.min(self._radius, initial=np.inf)) ** 2
        driven = [scene.discs[i].driven for i in moving]
        turning = (np.isfinite(scene.arrays.inertia[self._movable]) | np.array(driven, dtype=bool)) & self._turns
        self._turning = self._movable[turning]
        self._about = (model.body_dofadr[movable] + model.body_dofnum[movable] - 1)[turning]
        self._data.qpos[self._at] = self._position[self._movable]
        self._data.qvel[self._moves] = self._velocity[self._movable]
        self._data.qvel[self._about] = self._spin[self._turning]
        self._legs = Legs[int]()
        self._start_driven(1, [scene.discs[i] for i in moving])
        self._start_driven(1 + len(moving), [wall for wall in scene.walls if wall.driven])

    def _start_driven(self, first: int, bodies: Sequence[Driven]) -> None:
        """Set the initial velocities of driven bodies, and record later changes. `first` is the first body's number."""
        for body, scene_body in enumerate(bodies, first):
            if scene_body.driven:
                begin = int(self._model.body_dofadr[body])
                self._data.qvel[begin : begin + 2] = find_first_velocity(scene_body)
                self._legs.add(begin, scene_body)

    @property
    def settings(self) -> Mapping[str, Setting]:
        """The settings in use. Most settings are read from the compiled model, and the others are as requested."""
        model, mujoco = self._model, self._mujoco
        disabled, flag = model.opt.disableflags, mujoco.mjtDisableBit
        # earlier releases of MuJoCo use the prefix "mpr" instead of "ccd"
        ccd = "ccd" if hasattr(model.opt, "ccd_tolerance") else "mpr"
        read: dict[str, Setting] = {
            "dt_s": float(model.opt.timestep),
            "integrator": MJCF_INTEGRATORS[mujoco.mjtIntegrator(model.opt.integrator).name],
            "jacobian": mujoco.mjtJacobian(model.opt.jacobian).name.removeprefix("mjJAC_").lower(),
            "tolerance": float(model.opt.tolerance),
            "iterations": int(model.opt.iterations),
            "warmstart": not disabled & int(flag.mjDSBL_WARMSTART),
            "speculative": bool(model.opt.enableflags & _find_flag_bit(mujoco, "speculative")),
            "ccd_tolerance": float(getattr(model.opt, f"{ccd}_tolerance")),
            "ccd_iterations": int(getattr(model.opt, f"{ccd}_iterations")),
            "shape": self._requested_settings.get("shape", "sphere"),
            "autoreset": not disabled & _find_flag_bit(mujoco, "autoreset"),
            "joints": self._requested_settings["joints"],
            "listed_pairs": bool(model.npair),
            "in_turn": self._requested_settings.get("in_turn", False),
            "stiffness": abs(float(model.geom("0").solref[0])),
            "damping": abs(float(model.geom("0").solref[1])),
            "solimp": " ".join(f"{value:g}" for value in model.geom("0").solimp),
        }
        if self._has_joints and not self._turns:
            read["joints"] = "slide" if model.jnt_type[0] == mujoco.mjtJoint.mjJNT_SLIDE else "free"
        if self._turns:
            read |= {
                "cone": mujoco.mjtCone(model.opt.cone).name.removeprefix("mjCONE_").lower(),
                "solver": mujoco.mjtSolver(model.opt.solver).name.removeprefix("mjSOL_"),
                "mass_unit": self._unit,
            }
        return read

    def advance(self, steps: int) -> None:
        """Take the steps in MuJoCo's own loop. Between steps, set the prescribed velocities of driven bodies."""
        for count, changes in self._legs.split_steps(steps, self._clock):
            for begin, velocity in changes:
                self._data.qvel[begin : begin + 2] = velocity
            self._mujoco.mj_step(self._model, self._data, count)

    def observe(self) -> Observation:
        """Return the state of every disc, the contacts with a force, and any warning.

        MuJoCo finds contacts and then moves the bodies, so a contact of step k (counted from 0) has the time ``k
        dt_s``.
        """
        position, velocity, spin = self._position.copy(), self._velocity.copy(), None
        position[self._movable] = self._qpos[self._at]
        velocity[self._movable] = self._qvel[self._moves]
        if self._turns:
            spin = self._spin.copy()
            spin[self._turning] = self._qvel[self._about]
        contacts = sum_contacts(self._read_contacts(), self._walls_in_pieces) if self._data.ncon else ()
        return Observation(position, velocity, contacts, self._find_warning(), spin)

    def take_quiet_steps(
        self, position_m: NDArray[np.float64], velocity_m_s: NDArray[np.float64], spin_rad_s: NDArray[np.float64]
    ) -> int:
        """Take steps until a step may have contacts or a warning; see `carom.engines.api.QuietWorld`."""
        data, steps, steps_taken = self._data, len(position_m), 0
        qpos, qvel = np.empty((steps, len(self._qpos))), np.empty((steps, len(self._qvel)))
        for steps_taken in range(1, steps + 1):
            self.advance(1)
            qpos[steps_taken - 1], qvel[steps_taken - 1] = self._qpos, self._qvel
            if (data.ncon and np.count_nonzero(data.efc_force)) or self._find_warning():
                break
        position_m[:steps_taken], velocity_m_s[:steps_taken] = self._position, self._velocity
        position_m[:steps_taken, self._movable] = qpos[:steps_taken, self._at]
        velocity_m_s[:steps_taken, self._movable] = qvel[:steps_taken, self._moves]
        if self._turns:
            spin_rad_s[:steps_taken] = self._spin
            spin_rad_s[:steps_taken, self._turning] = qvel[:steps_taken, self._about]
        return steps_taken

    def _read_contacts(self) -> list[Contact]:
        data, at_s = self._data, self._clock.step_began_s
        found: list[Contact] = []
        # Contacts are read as arrays, since MuJoCo's Python bindings are slow at creating an object for each contact.
        rows, geoms, frames = data.contact.efc_address, data.contact.geom, data.contact.frame
        for k, (row, (geom1, geom2), frame) in enumerate(zip(rows, geoms, frames, strict=True)):
            if row < 0:  # the contact has no row in the solver, so it has no force
                continue
            force, tangential = float(data.efc_force[row]), None
            if self._turns:
                force, tangential = self._compute_impulses(k, frame)
            if force <= 0:
                continue
            normal = (float(frame[0]), float(frame[1]))  # MuJoCo's normal points from the first geom to the second
            impulse = force * self._clock.dt_s
            if self._can_lean:
                normal, impulse = flattened(normal, impulse)
            found.append(
                oriented_contact(self._body_number[geom1], self._body_number[geom2], at_s, normal, impulse, tangential)
            )
        return found

    def _compute_impulses(self, contact: int, frame: NDArray[np.float64]) -> tuple[float, float]:
        """Return a contact's normal force, and its impulse of friction along the normal turned by +90 degrees.

        The force is read by a function of MuJoCo, because the solver's own numbers have another form if a pyramid
        approximates the friction cone.
        """
        force = np.zeros(6)
        self._mujoco.mj_contactForce(self._model, self._data, contact, force)
        along = force[1:3] @ frame[3:9].reshape(2, 3)
        nx, ny = flattened((float(frame[0]), float(frame[1])), 0.0)[0] if self._can_lean else frame[:2]
        tangential = float(nx * along[1] - ny * along[0])
        return float(force[0]) / self._unit, tangential * self._clock.dt_s / self._unit

    def _find_warning(self) -> str:
        number, warnings = self._warnings, []
        if len(self._free):
            height = self._qpos[self._height_at]
            if not height.dot(height) <= self._low and np.count_nonzero((height := np.abs(height)) > self._radius):
                k = int(np.argmax(height > self._radius))
                disc = self._movable[self._free[k]]
                warnings.append(
                    f"MuJoCo moved disc {disc} out of the plane: its centre is {height[k]:.3g} m off, more than a "
                    "radius"
                )
        if not any(number.tolist()):  # faster than NumPy's functions, and runs after every step
            return "; ".join(warnings)
        kind = self._mujoco.mjtWarning
        # If the reset is switched off, MuJoCo only counts huge values, which is no reason for a warning.
        autoreset = not self._model.opt.disableflags & _find_flag_bit(self._mujoco, "autoreset")
        bad = number[[int(kind.mjWARN_BADQPOS), int(kind.mjWARN_BADQVEL), int(kind.mjWARN_BADQACC)]]
        if autoreset and bad.any():
            warnings.append(f"MuJoCo reset the state: a value was not finite, or was beyond {LARGEST_VALUE:g}")
        if number[[int(kind.mjWARN_CONTACTFULL), int(kind.mjWARN_CNSTRFULL)]].any():
            warnings.append("MuJoCo omitted contacts, because its memory for contacts is full")
        return "; ".join(warnings)

    def cut(self, dt_s: float) -> None:
        """Set the size of the following steps, and the damping of contacts, which depends on this size."""
        if self._is_model_shared:  # the model is shared with other worlds, which have another step size
            self._model, self._is_model_shared = copy.copy(self._model), False
            model = self._model
            dampings = (
                (model.geom_solref, self._geom_damping),
                (model.pair_solref, self._pair_damping),
                (model.pair_solreffriction, self._friction_damping),
            )
            by_step = float(self._requested_settings["stiffness"]) == 0
            self._dampings = [
                (parameters[:, 1], damping) for parameters, damping in dampings if by_step and len(parameters)
            ]
        self._clock.cut(dt_s)
        self._model.opt.timestep = dt_s
        for of_contacts, damping in self._dampings:
            np.divide(damping, dt_s, out=of_contacts)

    def touching(self) -> frozenset[tuple[int, int]]:
        """Return the pairs that overlap by MuJoCo's own collision detection, in a copy of the state."""
        if self._probe is None:
            self._probe = self._mujoco.MjData(self._model)
        self._probe.qpos[:] = self._data.qpos
        self._mujoco.mj_fwdPosition(self._model, self._probe)
        if not self._probe.ncon:
            return frozenset()
        geoms, overlaps = self._probe.contact.geom, self._probe.contact.dist < 0
        return frozenset(pair_of(self._body_number[a], self._body_number[b]) for a, b in geoms[overlaps])

    def save(self) -> object:
        """Return coordinates and velocities.

        With the settings of the profile `located`, later steps depend only on coordinates and velocities.
        """
        return (self._clock.now_s, self._legs.started, self._data.qpos.copy(), self._data.qvel.copy())

    def restore(self, state: Any) -> None:
        """Restore coordinates and velocities."""
        time_s, self._legs.started, self._data.qpos[:], self._data.qvel[:] = state
        self._clock.restart(time_s)

    def close(self) -> None:
        """Drop the references to model and data, so that their memory is freed."""
        del self._data, self._warnings, self._qpos, self._qvel, self._probe, self._dampings, self._model
