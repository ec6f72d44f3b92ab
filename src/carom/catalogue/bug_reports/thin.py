"""Bug reports about thin walls, ends and corners: tunnelling, and bounces off walls that a ball does not touch."""

from __future__ import annotations

import math

from carom.catalogue.closed_forms import compute_fall, unit
from carom.catalogue.entry import Staged
from carom.catalogue.groups.classics_walled import edges
from carom.catalogue.staging import build_disc, build_impact, build_scene, build_staged, stage_at_wall
from carom.model.scene import Chain

_LAW = "Newton's law: an impact reverses the velocity along the normal"


def _build_solid(*points: complex) -> Chain:
    """Return a solid polygon as a wall."""
    return edges(*points, closed=True, solid=True)


def _stage_at_wall(velocity: complex, radius: float, wall: Chain, *, restitution: float = 1.0) -> Staged:
    """Build a scene in which a disc from the left meets an upright wall at height 0. The wall's face is at x = 0."""
    return stage_at_wall(velocity, radius, -1, [wall], _LAW, time_s=0.255, duration_s=0.5, restitution=restitution)


def at_slab(velocity: complex, radius: float, thickness: float, half_height: float) -> Staged:
    """Build a scene in which a disc from the left meets the face of an upright box."""
    bottom, top = -1j * half_height, 1j * half_height
    return _stage_at_wall(velocity, radius, _build_solid(bottom, thickness + bottom, thickness + top, top))


def _stage_at_vertex(velocity: complex, radius: float, point: complex, normal: complex, wall: Chain) -> Staged:
    """Build a scene in which a disc meets a vertex. The normal points from the vertex to the disc's centre."""
    source = f"{_LAW}, which points from the vertex to the disc's centre"
    return stage_at_wall(velocity, radius, normal, [wall], source, point=point, time_s=0.405, duration_s=0.75)


def box2d_71() -> Staged:
    """A fast ball hits the corner of a chain of two lines."""
    return _stage_at_vertex(40 + 3j, 0.2, 0, unit(-5 + 0.5j), edges(1 - 3j, 0, 1 + 3j))


def godot_9071() -> Staged:
    """A fast ball meets a thin triangle."""
    return _stage_at_wall(30 + 8j, 0.15, _build_solid(-3j, 0.25, 3j))


def godot_72674() -> Staged:
    """A small fast ball meets a wall without thickness."""
    return _stage_at_wall(25, 0.02, edges(-2j, 2j))


def pymunk_111() -> Staged:
    """A ball glances off a thick segment."""
    return _stage_at_wall(1.5 + 6j, 0.25, edges(0.05 - 4j, 0.05 + 4j, half_width_m=0.05), restitution=0.95)


def avian_990() -> Staged:
    """A small ball falls past the corner of a wall and does not touch it."""
    pull, radius, end, start = 9.81, 0.0135, 0.25, 0.05
    start_position = complex(-radius - 0.0005, start)
    walls = [_build_solid(0, 0.1, 0.1 - 1j, -1j)]
    scene = build_scene([build_disc(start_position, 0, radius)], walls=walls, pull=pull, duration_s=end)
    final = compute_fall(start_position, 0, end, -1j * pull)
    return build_staged(scene, [], "Galileo: the ball falls freely, half a millimetre from the wall", final=[final])


def construct_4905() -> Staged:
    """A ball whose centre is just outside of a box comes down on the corner of the box."""
    return _stage_at_vertex(3 - 4j, 0.25, 0, unit(-0.35 + 1j), _build_solid(0, 4, 4 - 2j, -2j))


def construct_3443() -> Staged:
    """A ball falls straight down on the upper corner of a tilted box."""
    return _stage_at_vertex(-5j, 0.2, 0, unit(0.3 + 1j), _build_solid(0, 2 - 2j, -4j, -2 - 2j))


def vrc8ball_64() -> Staged:
    """A ball moves along two cushions and past the pocket between them."""
    radius, jaw = 0.0286, 0.06
    walls = [edges(-1.2, -jaw, complex(-0.75 * jaw, -jaw)), edges(complex(0.75 * jaw, -jaw), jaw, 1.2)]
    scene = build_scene([build_disc(complex(-1, radius + 0.001), 3, radius)], walls=walls, duration_s=0.65)
    return build_staged(scene, [], "The path is a straight line, a millimetre from all walls")


def vrc8ball_70() -> Staged:
    """A ball meets the jaw of a side pocket."""
    jaw = 0.06
    cushion = edges(complex(0.75 * jaw, -jaw), jaw, 1.2)
    return _stage_at_vertex(2 - 0.75j, 0.0286, jaw, unit(-0.6 + 1j), cushion)


def ball2box_10() -> Staged:
    """A ball bounces on a box twice. The second bounce is a centimetre from the corner."""
    pull, radius, drift, fall = 10.0, 0.2, 0.25, 0.3
    box = _build_solid(0, -2, -2 - 1j, -1j)
    start = complex(-0.01 - 3 * fall * drift, radius + 0.5 * pull * fall**2)
    end, up = 3.5 * fall, complex(drift, pull * fall)
    impacts = [build_impact(fall, 0, -1, up), build_impact(3 * fall, 0, -1, up)]
    final = compute_fall(complex(-0.01, radius), up, end - 3 * fall, -1j * pull)
    scene = build_scene([build_disc(start, drift, radius)], walls=[box], pull=pull, duration_s=end)
    source = "Galileo: rise and fall take equal times; Newton's law of restitution gives the speed after each bounce"
    return build_staged(scene, impacts, source, final=[final])


def cannon_301() -> Staged:
    """A ball falls on a floor, a quarter of a metre from the end of the floor."""
    pull, radius, height = 9.81, 0.3, 1.0
    time = math.sqrt(2 * height / pull)
    end, up = 1.5 * time, 1j * pull * time
    discs, walls = [build_disc(complex(-0.25, radius + height), 0, radius)], [edges(-4, 0, pieces=4)]
    scene = build_scene(discs, walls=walls, pull=pull, duration_s=end)
    final = compute_fall(complex(-0.25, radius), up, end - time, -1j * pull)
    return build_staged(scene, [build_impact(time, 0, -1, up)], f"Free fall; {_LAW}", final=[final])
