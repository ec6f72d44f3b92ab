"""Complaints about thin walls, their ends and their corners: tunnelling, and bounces off walls that are not touched."""

from __future__ import annotations

import math

from carom.catalogue.bug_report import Symptom, complained, misses
from carom.catalogue.classics_walled import edges, in_a_room
from carom.catalogue.closed_forms import after_wall, answered, disc, impact, scene_of, unit
from carom.catalogue.entry import Staged
from carom.model.scene import Chain

_LAW = "Newton's law: the velocity along the normal is reversed"


def _solid(*points: complex) -> Chain:
    """Return a solid body of straight edges."""
    return edges(*points, closed=True, solid=True)


def _slab(thickness: float, height: float) -> Chain:
    """Return an upright box whose left face is at 0."""
    return _solid(-1j * height, thickness - 1j * height, thickness + 1j * height, 1j * height)


def _at_a_wall(velocity: complex, radius: float, wall: Chain, *, restitution: float = 1.0) -> Staged:
    """Stage a disc that comes from the left and meets an upright wall at the height 0; the wall's face is at 0."""
    time_s = 0.255
    start = -radius - velocity * time_s
    scene = scene_of([disc(start, velocity, radius)], walls=[wall], wall_restitution=restitution, duration_s=0.5)
    return answered(scene, [impact(time_s, 0, -1, after_wall(velocity, 1, restitution))], _LAW)


def _at_a_point(velocity: complex, radius: float, point: complex, normal: complex, wall: Chain) -> Staged:
    """Stage a disc that meets a vertex. The normal points from the vertex to the disc's centre."""
    time = 0.405
    start = point + radius * normal - velocity * time
    scene = scene_of([disc(start, velocity, radius)], walls=[wall], duration_s=0.75)
    return answered(scene, [impact(time, 0, -1, after_wall(velocity, normal))], f"{_LAW}, which is through the vertex")


@misses(
    thread="https://github.com/liabru/matter-js/issues/5",
    reported="Fast bodies pass through thin ones, since there is no continuous detection; smaller steps are advised.",
    made="The thread has no scene. All sizes are chosen here: the ball moves five times its reach in a step.",
)
def _matter_js_5() -> Staged:
    """A fast ball meets a thin wall."""
    return _at_a_wall(33 + 2j, 0.1, _slab(0.02, 4.0))


@misses(
    thread="https://github.com/schteppe/p2.js/issues/136",
    reported="A thrown circle passes through a wall of one polygon 32 pixels thick; a wall made of tiles holds.",
    made="The thickness is from the thread, at 100 pixels a metre; the rest is chosen here.",
)
def _p2_136() -> Staged:
    """A fast ball meets a solid wall a third of a metre thick."""
    return _at_a_wall(45 + 5j, 0.3, _slab(0.32, 6.0))


@misses(
    thread="https://github.com/schteppe/p2.js/issues/264",
    reported="A ball sometimes passes through a box that serves as a wall; thicker walls or planes are advised.",
    made="The thread has no sizes; all are chosen here. The ball meets the walls of a room nineteen times.",
)
def _p2_264() -> Staged:
    """A ball bounces around in a room of thin walls."""
    return in_a_room(1.1 + 0.7j, 23 + 17j, 0.125, 5.0, 4.0, 2.0, half_width_m=0.02)


@misses(
    thread="https://github.com/schteppe/p2.js/issues/372",
    reported="A circle that is beyond the back of a box after one step is not detected; a slower circle is.",
    made="The thread shows a drawing; all sizes are chosen here.",
)
def _p2_372() -> Staged:
    """A ball meets a box so fast that it would be past the box within one step."""
    return _at_a_wall(27 - 4j, 0.1, _slab(0.15, 3.0))


@misses(
    thread="https://github.com/erincatto/box2d/issues/71",
    reported="Circles are easily pulled through chains of lines, probably where two lines meet, even as bullets.",
    made="The thread has no scene; all sizes are chosen here.",
)
def _box2d_71() -> Staged:
    """A fast ball meets a chain of lines where two of them meet at an angle."""
    wall = edges(1 - 3j, 0, 1 + 3j)
    return _at_a_point(40 + 3j, 0.2, 0j, unit(-5 + 0.5j), wall)


@misses(
    thread="https://github.com/godotengine/godot/issues/9071",
    reported="A fast circle enters or passes through static polygons, whatever continuous detection is chosen.",
    made="The thread names no sizes; all are chosen here.",
)
def _godot_9071() -> Staged:
    """A fast ball meets a thin triangle."""
    return _at_a_wall(30 + 8j, 0.15, _solid(-3j, 0.25, 3j))


@misses(
    thread="https://github.com/godotengine/godot/issues/72674",
    reported="A small fast body passes through a thin wall, with and without shape casts.",
    made="In the thread the body follows the mouse; all sizes are chosen here.",
)
def _godot_72674() -> Staged:
    """A small fast ball meets a wall without thickness."""
    return _at_a_wall(25 + 0j, 0.02, edges(-2j, 2j))


@misses(
    thread="https://github.com/godotengine/godot/issues/6664",
    reported="At some 1,000 pixels a second a ball passes through one in ten of the static walls that it meets.",
    made="Four walls and a velocity of (800, 1000) pixels a second are from the thread, at 100 pixels a metre. The "
    "rest is chosen here, and the moving paddle is left out.",
)
def _godot_6664() -> Staged:
    """A ball bounces around in a room of four walls."""
    return in_a_room(2.3 + 1.9j, 8 + 10j, 0.16, 10.24, 6.0, 2.0, half_width_m=0.05)


@complained(
    thread="https://github.com/godotengine/godot/issues/32138",
    reported="At high speed a ball bounces off a flat static body at a random angle, often back to where it came from.",
    made="All sizes are chosen here.",
)
def _godot_32138() -> Staged:
    """A fast ball meets a flat wall at 55 degrees."""
    return _at_a_wall(14 + 20j, 0.2, _slab(0.5, 6.0))


@complained(
    thread="https://github.com/viblo/pymunk/issues/111",
    reported="Circles roll along a static segment instead of bouncing off it, even with high elasticity.",
    made="The thread has no code; all sizes are chosen here.",
)
def _pymunk_111() -> Staged:
    """A ball glances off a thick segment."""
    return _at_a_wall(1.5 + 6j, 0.25, edges(0.05 - 4j, 0.05 + 4j, half_width_m=0.05), restitution=0.95)


@complained(
    thread="https://github.com/avianphysics/avian/issues/990",
    reported="A ball of 27 mm that falls half a millimetre off a wall is flung sideways as it passes the corner.",
    symptom=Symptom.INVENTS,
    made="Ball and gap are from the thread; height and wall are chosen here.",
)
def _avian_990() -> Staged:
    """A small ball falls past the corner of a wall without touching it."""
    pull, radius, end, start = 9.81, 0.0135, 0.25, 0.05
    wall = _solid(0, 0.1, 0.1 - 1j, -1j)
    scene = scene_of(
        [disc(complex(-radius - 0.0005, start), 0j, radius)],
        walls=[wall],
        gravity_m_s2=(0.0, -pull),
        duration_s=end,
    )
    final = complex(-radius - 0.0005, start - 0.5 * pull * end**2), -1j * pull * end
    return answered(scene, [], "Galileo: free fall; the ball stays half a millimetre away", final=[final])


@complained(
    thread="https://github.com/Scirra/Construct-bugs/issues/4905",
    reported="A bouncing bullet that hits the corner of a solid returns the way it came.",
    made="In the thread the bullet is a square; here it is a ball. All sizes are chosen here.",
)
def _construct_4905() -> Staged:
    """A ball whose centre is just outside of a box comes down on the corner of the box."""
    return _at_a_point(3 - 4j, 0.25, 0j, unit(-0.35 + 1j), _solid(0, 4, 4 - 2j, -2j))


@complained(
    thread="https://github.com/Scirra/Construct-bugs/issues/3443",
    reported="Bullets that hit the corner of an angled solid return the way they fell.",
    made="In the thread the bullets have square outlines; here they are one ball. All sizes are chosen here.",
)
def _construct_3443() -> Staged:
    """A ball falls straight down on the upper corner of a tilted box."""
    return _at_a_point(-5j, 0.2, 0j, unit(0.3 + 1j), _solid(0, 2 - 2j, -4j, -2 - 2j))


@complained(
    thread="https://github.com/Terri00/vrc8ball/issues/64",
    reported="A ball that is shot along the cushion hits the corner of the side pocket instead of passing it.",
    symptom=Symptom.INVENTS,
    made="All sizes are chosen here: a table of nine feet, and a gap of a millimetre.",
)
def _vrc8ball_64() -> Staged:
    """A ball moves along two cushions and past the pocket between them."""
    radius, jaw = 0.0286, 0.06
    walls = [
        edges(-1.2, -jaw, complex(-0.75 * jaw, -jaw)),
        edges(complex(0.75 * jaw, -jaw), jaw, 1.2),
    ]
    scene = scene_of([disc(complex(-1, radius + 0.001), 3 + 0j, radius)], walls=walls, duration_s=0.65)
    return answered(scene, [], "A straight line, a millimetre from all walls")


@complained(
    thread="https://github.com/Terri00/vrc8ball/issues/70",
    reported="A ball that hits the corner next to a side pocket jumps to the middle of the pocket.",
    made="All sizes are chosen here: those of a table of nine feet.",
)
def _vrc8ball_70() -> Staged:
    """A ball meets the jaw of a side pocket."""
    jaw = 0.06
    cushion = edges(complex(0.75 * jaw, -jaw), jaw, 1.2)
    return _at_a_point(2 - 0.75j, 0.0286, complex(jaw), unit(-0.6 + 1j), cushion)


@complained(
    thread="https://github.com/dulvui/ball2box/issues/10",
    reported="A ball that bounces on a box and drifts towards a corner is turned back near the corner.",
    made="All sizes are chosen here; no energy is lost.",
)
def _ball2box_10() -> Staged:
    """A ball bounces on a box twice, the second time a centimetre from the corner."""
    pull, radius, drift, fall = 10.0, 0.2, 0.25, 0.3
    box = _solid(0, -2, -2 - 1j, -1j)
    start = complex(-0.01 - 3 * fall * drift, radius + 0.5 * pull * fall**2)
    end = 3.5 * fall
    up = complex(drift, pull * fall)
    impacts = [impact(fall, 0, -1, up), impact(3 * fall, 0, -1, up)]
    left = end - 3 * fall
    final = complex(-0.01 + drift * left, radius + pull * fall * left - 0.5 * pull * left**2), up - 1j * pull * left
    scene = scene_of([disc(start, complex(drift), radius)], walls=[box], gravity_m_s2=(0.0, -pull), duration_s=end)
    return answered(scene, impacts, "Galileo: rise and fall take equal times; Newton's law on the box", final=[final])


@misses(
    thread="https://github.com/schteppe/cannon.js/issues/301",
    reported="Near one end of a height field spheres fall through, half a spacing from the edge.",
    made="All sizes are chosen here; the floor has a spacing of a metre.",
)
def _cannon_301() -> Staged:
    """A ball falls on a floor a quarter of a metre from its end."""
    pull, radius, height = 9.81, 0.3, 1.0
    time = math.sqrt(2 * height / pull)
    end, speed = 1.5 * time, pull * time
    floor = edges(-4, 0, pieces=4)
    scene = scene_of(
        [disc(complex(-0.25, radius + height), 0j, radius)],
        walls=[floor],
        gravity_m_s2=(0.0, -pull),
        duration_s=end,
    )
    left = end - time
    final = complex(-0.25, radius + speed * left - 0.5 * pull * left**2), 1j * (speed - pull * left)
    return answered(scene, [impact(time, 0, -1, 1j * speed)], f"Free fall; {_LAW}", final=[final])
