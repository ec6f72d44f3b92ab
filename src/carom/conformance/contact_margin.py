"""Computes the errors that a contact margin allows: the errors of PIC in a scene with thicker bodies.

An engine with a margin m lets bodies collide when their surfaces are still up to m apart. Let R be the distance of the
centres when bodies touch. The engine's impact occurs at a distance between R and R + m. Let w be the relative speed,
and b the distance at which the centres would pass each other without an impact. Then the impact is early by at most
``(sqrt((R + m)^2 - b^2) - sqrt(R^2 - b^2)) / w``. Without friction, an impact with the restitution e changes the
velocity of a body with the mass m_i by ``(1 + e) mu / m_i w cos(a)``. Here mu is the reduced mass of both bodies, and a
is the angle between the normal and the relative velocity, with ``sin(a) = b / R``. So the velocity error is at most
``(1 + e) mu / m_i w sin(a - a')``, where ``sin(a') = b / (R + m)``. Bodies whose surfaces would pass each other at a
distance below m may also collide. The errors of time and velocity grow with m. So the greatest allowed errors are those
of the exact solution in which all bodies collide at the distance m.
"""

from __future__ import annotations

from dataclasses import replace

from carom.model.scene import Disc, Scene, Wall
from carom.model.trace import Trace
from carom.solvers.pic import solve_pic


def thicken_scene(scene: Scene, margin_m: float) -> Scene:
    """Return a scene with thicker bodies, which meet when the original bodies are still `margin_m` apart.

    The moments of inertia stay the same.
    """
    half = margin_m / 2

    def thicken_disc(disc: Disc) -> Disc:
        radius = disc.radius_m + half
        factor = disc.inertia_factor * (disc.radius_m / radius) ** 2
        return disc.model_copy(update={"radius_m": radius, "inertia_factor": factor})

    def thicken_wall(wall: Wall) -> Wall:
        (x, y), (nx, ny) = wall.point_m, wall.normal
        return wall.model_copy(update={"point_m": (x + half * nx, y + half * ny)})

    # The copy is not validated, because thicker bodies can overlap at the start.
    discs, walls = tuple(map(thicken_disc, scene.discs)), tuple(map(thicken_wall, scene.half_planes()))
    return scene.model_copy(update={"discs": discs, "walls": walls})


def solve_thickened(scene: Scene, margin_m: float) -> Trace:
    """Solve a scene with thicker bodies by PIC. Return the result as a trace of the original scene."""
    return replace(solve_pic(thicken_scene(scene, margin_m)), scene=scene)
