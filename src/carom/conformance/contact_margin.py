"""Errors that a promised contact margin allows: those of a scene with bodies that are thicker by the margin.

An engine with a margin m responds to bodies up to m apart as if their surfaces were up to m nearer. So an impact at a
distance R of the centres is no earlier, and its normal is turned no farther, than an impact at R + m. With the relative
speed w and the distance b at which the bodies would pass each other, it is early by at most ``(sqrt((R + m)^2 - b^2) -
sqrt(R^2 - b^2)) / w``. Without friction an impact changes a velocity by ``(1 + e) mu / m_i w cos(a)`` along a normal at
the angle a with ``sin(a) = b / R``. So the velocity is off by at most ``(1 + e) mu / m_i w sin(a - a')``, where
``sin(a') = b / (R + m)``. Bodies that pass at less than m meet. Both errors grow with m. So the scene with thicker
bodies, solved exactly, has the greatest error of one impact, and propagates it to later impacts.
"""

from __future__ import annotations

from dataclasses import replace

from carom.model.scene import Disc, Scene, Wall
from carom.model.trace import Trace
from carom.solvers.pic import solve_pic


def thickened(scene: Scene, margin_m: float) -> Scene:
    """Return a scene whose bodies meet when they are `margin_m` apart; discs are as hard to turn as before."""
    half = margin_m / 2

    def disc(one: Disc) -> Disc:
        radius = one.radius_m + half
        factor = one.inertia_factor * (one.radius_m / radius) ** 2
        return one.model_copy(update={"radius_m": radius, "inertia_factor": factor})

    def wall(one: Wall) -> Wall:
        (x, y), (nx, ny) = one.point_m, one.normal
        return one.model_copy(update={"point_m": (x + half * nx, y + half * ny)})

    # Copied and not made: bodies that begin within the margin overlap now, which no scene of a file may.
    return scene.model_copy(
        update={"discs": tuple(map(disc, scene.discs)), "walls": tuple(map(wall, scene.half_planes()))}
    )


def thickened_trace(scene: Scene, margin_m: float) -> Trace:
    """Return the run of thicker bodies, as a run of the scene itself."""
    return replace(solve_pic(thickened(scene, margin_m)), scene=scene)
