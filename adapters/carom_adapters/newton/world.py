"""A scene in Newton: a model of spheres in the plane y = 0, run step by step."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from carom.engines.api import (
    Contact,
    Observation,
    Scene,
    Setting,
    StepClock,
    pair_of,
    wall_body,
)
from carom_adapters.newton.limits import OF_THE_SOLVER, SPECULATIVE, check_inputs


class NewtonWorld:
    """One model of spheres in the plane y = 0, in which the scene's y axis is Newton's z axis.

    Rotations of walls about the y axis keep the y coordinates exactly 0.
    """

    def __init__(self, scene: Scene, settings: Mapping[str, Setting]) -> None:
        check_inputs(scene, settings)
        import warp

        warp.config.log_level = warp.LOG_ERROR
        import newton

        self._warp, self._newton = warp, newton
        self._clock = StepClock(float(settings["dt_s"]))
        gx, gy = scene.gravity_m_s2
        builder = newton.ModelBuilder(gravity=(gx, 0.0, gy))
        self._start_position_m = np.array([disc.position_m for disc in scene.discs], dtype=np.float64)
        #: Numbers of the discs that are bodies in Newton, and the number of the disc or wall of each of Newton's
        #: shapes.
        self._moved = [i for i, disc in enumerate(scene.discs) if not disc.immovable]
        walls = scene.half_planes()
        self._body_number = np.array([*range(len(scene.discs)), *map(wall_body, range(len(walls)))])
        # Newton uses the mean of the restitutions of two bodies, and accepts any values.
        of_walls = 2.0 * scene.wall_restitution - scene.restitution
        for disc in scene.discs:
            transform = warp.transform(_to_space(disc.position_m), warp.quat_identity())
            shape = self._build_material(builder, scene.restitution, settings)
            if disc.immovable:
                builder.add_shape_sphere(-1, xform=transform, radius=disc.radius_m, cfg=shape)
                continue
            inertia = np.eye(3) * (0.4 * disc.mass_kg * disc.radius_m**2)
            body = builder.add_body(xform=transform, mass=disc.mass_kg, inertia=inertia, lock_inertia=True)
            builder.body_qd[body] = warp.spatial_vector(*_to_space(disc.velocity_m_s), 0.0, 0.0, 0.0)
            builder.add_shape_sphere(body, radius=disc.radius_m, cfg=shape)
        for wall in walls:
            # The wall is built from its position and rotation, not from its equation. From the equation of a plane that
            # faces down, Newton 1.8 builds a plane that faces up.
            turn = math.atan2(*wall.normal) / 2.0
            transform = warp.transform(_to_space(wall.point_m), (0.0, math.sin(turn), 0.0, math.cos(turn)))
            shape = self._build_material(builder, of_walls, settings)
            builder.add_shape_plane(None, xform=transform, width=0.0, length=0.0, cfg=shape)
        self._model = builder.finalize(device="cpu")
        speculative = {SPECULATIVE: settings[SPECULATIVE]} if SPECULATIVE in settings else {}
        self._pipeline = newton.CollisionPipeline(self._model, **speculative)
        self._contacts = self._pipeline.contacts()
        solver_settings = {name: settings[name] for name in OF_THE_SOLVER if name in settings}
        self._solver = newton.solvers.SolverXPBD(self._model, **solver_settings)
        self._state, self._next = self._model.state(), self._model.state()
        #: Array for the forces that the solver reports at each contact. The first observation creates the array of
        #: forces.
        self._forces: Any = None

    @staticmethod
    def _build_material(builder: Any, restitution: float, settings: Mapping[str, Setting]) -> Any:
        shape = builder.ShapeConfig(density=0.0, restitution=restitution, mu=0.0)
        if "gap" in settings:
            shape.gap = float(settings["gap"])
        return shape

    @property
    def settings(self) -> Mapping[str, Setting]:
        """The settings that the solver and the model really contain."""
        model_settings = {name: getattr(self._solver, name) for name in OF_THE_SOLVER}
        model_settings["gap"] = float(self._model.shape_gap.numpy()[0])
        if (speculative_gap := self._pipeline.speculative_contact_gap_max) is not None:
            model_settings[SPECULATIVE] = speculative_gap
        return {"dt_s": self._clock.dt_s, **model_settings}

    def advance(self, steps: int) -> None:
        """Take steps.

        Newton finds contacts at the start of a step, then moves the bodies, and then solves the contacts of overlapping
        bodies.
        """
        dt_s = self._clock.dt_s
        for _ in range(steps):
            self._state.clear_forces()
            self._pipeline.collide(self._state, self._contacts, dt=dt_s)
            self._solver.step(self._state, self._next, None, self._contacts, dt_s, observables=self._forces)
            self._state, self._next = self._next, self._state
        self._clock.count(steps)

    def observe(self) -> Observation:
        """Return the state of every disc, and the contacts in which a force acted in the last step."""
        if self._forces is None:
            self._forces = self._solver.observables({"contact_f"}, contacts=self._contacts)
        position, velocity = self._start_position_m.copy(), np.zeros_like(self._start_position_m)
        if self._moved:
            position[self._moved] = self._state.body_q.numpy()[:, (0, 2)]
            velocity[self._moved] = self._state.body_qd.numpy()[:, (0, 2)]
        count = int(self._contacts.rigid_contact_count.numpy()[0])
        has_overflowed = count > self._contacts.rigid_contact_max
        warning = (
            f"Newton found {count} contacts, but stores at most {self._contacts.rigid_contact_max}"
            if has_overflowed
            else ""
        )
        return Observation(position, velocity, () if has_overflowed else tuple(self._list_contacts(count)), warning)

    def _list_contacts(self, count: int) -> Iterator[Contact]:
        """Yield the contacts in which a force acted. The yielded contacts contain no impulses.

        The forces that the solver reports do not include the bounce, so impulses can't be computed.
        """
        pushed = np.flatnonzero(self._forces.contact_f.numpy()[:count].any(axis=1))
        normals = self._contacts.rigid_contact_normal.numpy()[pushed].tolist()
        for (a, b), (nx, _, ny) in zip(self._read_bodies(self._contacts, pushed), normals, strict=True):
            pair = pair_of(a, b)
            sign = 1.0 if pair[0] == a else -1.0
            yield Contact(*pair, self._clock.step_began_s, (sign * nx, sign * ny))

    def _read_bodies(self, contacts: Any, those: NDArray[np.intp]) -> list[tuple[int, int]]:
        """Return the two bodies of each contact, numbered as in `Contact`, in Newton's order."""
        shapes = (contacts.rigid_contact_shape0, contacts.rigid_contact_shape1)
        first, second = (self._body_number[shape.numpy()[those]].tolist() for shape in shapes)
        return list(zip(first, second, strict=True))

    def cut(self, dt_s: float) -> None:
        """Set the size of the following steps."""
        self._clock.cut(dt_s)

    def touching(self) -> frozenset[tuple[int, int]]:
        """Return the pairs that overlap by Newton's own collision detection."""
        contacts = self._pipeline.contacts()  # a new object, so that the contacts of the last step stay unchanged
        self._pipeline.collide(self._state, contacts, dt=0.0)
        apart_m = self._warp.zeros(contacts.rigid_contact_max, dtype=float, device="cpu")
        self._newton.eval_rigid_contact_kinematics(self._model, self._state, contacts, out_distance=apart_m)
        count = int(contacts.rigid_contact_count.numpy()[0])
        overlapping = np.flatnonzero(apart_m.numpy()[:count] <= 0.0)
        return frozenset(pair_of(a, b) for a, b in self._read_bodies(contacts, overlapping))

    def save(self) -> object:
        """Return poses and velocities, the complete state."""
        return self._clock.now_s, self._state.body_q.numpy().copy(), self._state.body_qd.numpy().copy()

    def restore(self, state: Any) -> None:
        """Restore poses and velocities."""
        time_s, poses, velocities = state
        self._clock.restart(time_s)
        self._state.body_q.assign(poses)
        self._state.body_qd.assign(velocities)

    def close(self) -> None:
        """Do nothing, because Warp frees an array when its owner is freed."""


def _to_space(vector: tuple[float, float]) -> tuple[float, float, float]:
    """Convert a vector in the scene's plane to a vector in three dimensions."""
    return vector[0], 0.0, vector[1]
