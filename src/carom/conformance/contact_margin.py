"""What a promised contact margin allows: no more than discs and walls that are thicker by it would show.

An engine with a margin answers bodies that are up to m apart, as if their surfaces were up to m nearer. So no impact of
two bodies whose centres touch at a distance R comes earlier, nor with a normal turned farther, than one at R + m: with
the relative speed w and the distance b at which they would pass each other, it is early by
(sqrt((R + m)^2 - b^2) - sqrt(R^2 - b^2)) / w at most; and without friction a velocity, which an impact changes by
(1 + e) mu / m_i w cos(a) along a normal at the angle a with sin(a) = b / R, is off by (1 + e) mu / m_i w sin(a - a') at
most, where sin(a') = b / (R + m). Bodies that pass at less than m meet. Both grow with m, so the scene with thicker
bodies, solved exactly, has the greatest error of one impact, and hands it on to those after it.
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
    """Return what happens to thicker bodies, as a run of the scene itself."""
    return replace(solve_pic(thickened(scene, margin_m)), scene=scene)
