"""Reads an MJCF model, compiled by MuJoCo, as a scene. The scene contains the part of the model in the plane z = 0."""

from __future__ import annotations

import importlib
import math
from typing import Any
from xml.etree import ElementTree

import numpy as np

from carom.engines.api import AdapterError, Disc, Imported, Scene, Wall, one_coefficient

#: Largest difference of two numbers that count as equal. The limit allows for the rounding of a quaternion.
ROUNDING = 1e-12

#: Kinds of geoms that scenes support.
PLANE, SPHERE, CYLINDER = "plane", "sphere", "cylinder"


def read_scene(content: bytes, name: str, duration_s: float) -> Imported:
    """Return the discs and walls of a model, and list everything in the model that scenes do not support.

    Positions and velocities are from the model's first keyframe or, without a keyframe, from the initial state.

    Raises:
        AdapterError: The content is not an MJCF model that MuJoCo can compile, or the model refers to other files.
        SceneError: The supported part of the model is not a valid scene: there is no disc, or bodies overlap.
    """
    mujoco: Any = importlib.import_module("mujoco")
    text = content.decode("utf-8", errors="replace")
    _require_single_file(text)
    try:
        model = mujoco.MjModel.from_xml_string(text)
        data = mujoco.MjData(model)
        if model.nkey:
            mujoco.mj_resetDataKeyframe(model, data, 0)
        mujoco.mj_forward(model, data)
    except (ValueError, MemoryError, mujoco.FatalError) as error:
        raise AdapterError(f"MuJoCo can't compile the model: {error}") from error
    return _Reading(mujoco, model, data).build_scene(name, duration_s)


def _require_single_file(text: str) -> None:
    """Refuse a model that refers to other files, since an untrusted model could make MuJoCo read any file."""
    try:
        root = ElementTree.fromstring(text)  # noqa: S314 - in a worker process; expat limits the expansion of entities
    except ElementTree.ParseError as error:
        raise AdapterError(f"the model is not XML: {error}") from error
    for element in root.iter():
        file_keys = [key for key in element.attrib if key == "file" or key.startswith("file")]
        if element.tag in {"include", "plugin", "model", "attach"} or file_keys:
            raise AdapterError(
                f"the element <{element.tag}> refers to another file or a plug-in; a model must be one file"
            )


class _Reading:
    """A compiled model and the scene read from it."""

    def __init__(self, mujoco: Any, model: Any, data: Any) -> None:
        self.mujoco, self.model, self.data = mujoco, model, data
        self.dropped: list[str] = []
        self.discs: list[tuple[int, Disc]] = []
        self.walls: list[tuple[int, Wall]] = []

    def build_scene(self, name: str, duration_s: float) -> Imported:
        for geom in range(self.model.ngeom):
            kind = self.mujoco.mjtGeom(self.model.geom_type[geom]).name.removeprefix("mjGEOM_").lower()
            label = f"geom {self.model.geom(geom).name or geom}, a {kind}"
            if kind == PLANE:
                self._read_plane(geom, label)
            elif kind in {SPHERE, CYLINDER}:
                self._read_round(geom, label, kind)
            else:
                self.dropped.append(f"{label}: scenes have only discs and half-planes")
        gx, gy, gz = map(float, self.model.opt.gravity)
        if gz != 0.0:
            self.dropped.append(f"gravity along z, {gz:g}")
        counts = {"equality constraints": self.model.neq, "actuators": self.model.nu, "tendons": self.model.ntendon}
        self.dropped += [f"{count} {parts}" for parts, count in counts.items() if count]
        if np.any(self.model.dof_damping):
            self.dropped.append("damping of joints")
        if self.model.npair:
            self.dropped.append("settings of listed pairs: the settings of their geoms are used instead")
        return Imported(
            Scene(
                name=name,
                discs=[disc for _, disc in self.discs],
                walls=[wall for _, wall in self.walls],
                gravity_m_s2=(gx, gy),
                duration_s=duration_s,
                **self._find_coefficients("restitution", self._compute_restitution, 1.0),
                **self._find_coefficients("friction", self._read_friction, math.inf),
            ),
            tuple(self.dropped),
        )

    def _read_plane(self, geom: int, label: str) -> None:
        nx, ny, nz = map(float, self.data.geom_xmat[geom].reshape(3, 3)[:, 2])
        if self._can_move(geom):
            self.dropped.append(f"{label}: it moves")
        elif abs(nz) > ROUNDING:
            self.dropped.append(f"{label}: its normal is not in the plane z = 0")
        else:
            x, y, _ = map(float, self.data.geom_xpos[geom])
            self.walls.append((geom, Wall(point_m=(x, y), normal=(nx, ny))))

    def _read_round(self, geom: int, label: str, kind: str) -> None:
        model, data = self.model, self.data
        x, y, z = map(float, data.geom_xpos[geom])
        radius, axis = float(model.geom_size[geom][0]), data.geom_xmat[geom].reshape(3, 3)[:, 2]
        if abs(z) > ROUNDING * radius:
            self.dropped.append(f"{label}: its centre is {z:g} off the plane z = 0")
        elif kind == CYLINDER and np.hypot(*axis[:2]) > ROUNDING:
            self.dropped.append(f"{label}: its axis is not z")
        elif not self._can_move(geom):
            self.discs.append((geom, Disc(position_m=(x, y), radius_m=radius, mass_kg=math.inf)))
        elif (turns := self._can_turn(int(model.geom_bodyid[geom]))) is None:
            self.dropped.append(f"{label}: its body has several parts, or can't move freely in the plane")
        else:
            self._read_movable(geom, label, (x, y), radius, turns)

    def _read_movable(self, geom: int, label: str, place: tuple[float, float], radius: float, turns: bool) -> None:
        model, body = self.model, int(self.model.geom_bodyid[geom])
        if math.dist(self.data.xipos[body], self.data.geom_xpos[geom]) > ROUNDING * radius:
            self.dropped.append(f"{label}: its centre is not the centre of gravity of its body")
            return
        motion = np.zeros(6)
        self.mujoco.mj_objectVelocity(model, self.data, self.mujoco.mjtObj.mjOBJ_BODY, body, motion, 0)
        mass = float(model.body_mass[body])
        # The third principal axis of a sphere or of an upright cylinder is perpendicular to the plane.
        factor = float(model.body_inertia[body][2]) / (mass * radius**2) if turns else math.inf
        if 1.0 < factor < math.inf:
            self.dropped.append(f"{label}: its moment of inertia, {factor:g} m r^2, is reduced to m r^2")
            factor = 1.0
        if motion[5] != 0.0 or np.any(motion[:2]):
            self.dropped.append(f"{label}: its motion out of the plane is ignored")
        disc = Disc(
            position_m=place,
            velocity_m_s=(float(motion[3]), float(motion[4])),
            radius_m=radius,
            mass_kg=mass,
            spin_rad_s=float(motion[2]) if turns else 0.0,
            inertia_factor=factor,
        )
        self.discs.append((geom, disc))

    def _can_move(self, geom: int) -> bool:
        return bool(self.model.body_weldid[self.model.geom_bodyid[geom]] != 0)

    def _can_turn(self, body: int) -> bool | None:
        """Whether a body can turn in the plane; None for a body that can't move freely in the plane."""
        model, kinds = self.model, self.mujoco.mjtJoint
        if model.body_geomnum[body] != 1 or model.body_parentid[body] != 0:
            return None
        first, count = int(model.body_jntadr[body]), int(model.body_jntnum[body])
        if any(int(parent) == body for parent in model.body_parentid[1:]):
            return None
        joints = [
            (kinds(model.jnt_type[k]).name, tuple(np.abs(model.jnt_axis[k]))) for k in range(first, first + count)
        ]
        if [kind for kind, _ in joints] == ["mjJNT_FREE"]:
            return True
        across, slides = (0.0, 0.0, 1.0), {axis for kind, axis in joints if kind == "mjJNT_SLIDE"}
        hinges = [axis for kind, axis in joints if kind == "mjJNT_HINGE"]
        plain = slides >= {(1.0, 0.0, 0.0), (0.0, 1.0, 0.0)} and slides <= {(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), across}
        if not plain or any(axis != across for axis in hinges) or len(slides) + len(hinges) != count or len(hinges) > 1:
            return None
        return bool(hinges)

    def _compute_restitution(self, geom: int) -> float:
        """Return the restitution that follows from a geom's ``solref``, which describes a damper or a spring."""
        first, second = map(float, self.model.geom_solref[geom])
        if first == 0.0 and second < 0.0:  # a damper without a spring, which acts for one Euler step
            return max(-second * float(self.model.opt.timestep) - 1.0, 0.0)
        if first > 0.0:
            ratio = second
        elif first < 0.0:
            ratio = -second / (2.0 * math.sqrt(-first))
        else:
            ratio = 1.0
        return 0.0 if ratio >= 1.0 else math.exp(-math.pi * ratio / math.sqrt(1.0 - ratio**2))

    def _read_friction(self, geom: int) -> float:
        return float(self.model.geom_friction[geom][0]) if self.model.geom_condim[geom] > 1 else 0.0

    def _find_coefficients(self, name: str, compute: Any, limit: float) -> dict[str, float]:
        """Return the coefficients of pairs of discs, and of pairs of a disc and a wall."""
        discs, walls = [compute(geom) for geom, _ in self.discs], [compute(geom) for geom, _ in self.walls]
        pair = one_coefficient(f"{name} of pairs of discs", discs, limit, self.dropped)
        return {name: pair, f"wall_{name}": one_coefficient(f"{name} of walls", walls or [pair], limit, self.dropped)}
