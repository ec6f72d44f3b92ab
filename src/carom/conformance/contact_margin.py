"""Errors that a declared contact margin allows: the errors of PIC if all bodies are thicker by the margin.

An engine with a margin m responds to bodies at a distance of up to m as if their surfaces were up to m nearer. So if
bodies touch at a distance R of their centres, the engine's impact is at a distance between R and R + m. Instant and
normal of the impact are between those of impacts at these two distances. Let w be the relative speed, and b the
distance at which the bodies would pass each other. Then the impact is early by at most ``(sqrt((R + m)^2 - b^2) -
sqrt(R^2 - b^2)) / w``. Without friction, an impact changes a velocity by ``(1 + e) mu / m_i w cos(a)`` along a normal
at the angle a, with ``sin(a) = b / R``. So the velocity error is at most ``(1 + e) mu / m_i w sin(a - a')``, where
``sin(a') = b / (R + m)``. Bodies that would pass each other at a distance below m collide. The errors of time and
velocity grow with m. So the exact solution of the scene with thicker bodies has the greatest possible error at its
first impact, and propagates this error to later impacts.
"""

from __future__ import annotations

from dataclasses import replace

from carom.model.scene import Disc, Scene, Wall
from carom.model.trace import Trace
from carom.solvers.pic import solve_pic


def thicken_scene(scene: Scene, margin_m: float) -> Scene:
    """Return a scene whose bodies are thicker, so that they meet at a distance of `margin_m`.

    Moments of inertia don't change.
    """
    half = margin_m / 2

    def thicken_disc(one: Disc) -> Disc:
        radius = one.radius_m + half
        factor = one.inertia_factor * (one.radius_m / radius) ** 2
        return one.model_copy(update={"radius_m": radius, "inertia_factor": factor})

    def thicken_wall(one: Wall) -> Wall:
        (x, y), (nx, ny) = one.point_m, one.normal
        return one.model_copy(update={"point_m": (x + half * nx, y + half * ny)})

    # Copy without validation, because bodies that start within the margin now overlap.
    discs, walls = tuple(map(thicken_disc, scene.discs)), tuple(map(thicken_wall, scene.half_planes()))
    return scene.model_copy(update={"discs": discs, "walls": walls})


def solve_thickened(scene: Scene, margin_m: float) -> Trace:
    """Return the PIC trace of thicker bodies as a trace of the original scene."""
    return replace(solve_pic(thicken_scene(scene, margin_m)), scene=scene)
