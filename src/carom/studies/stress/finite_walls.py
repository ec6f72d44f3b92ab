"""Attacks with a disc and a finite wall: speed of disc and wall, thinness, ends, seams, legs and corners."""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable
from decimal import Decimal
from typing import Any

from carom.catalogue.closed_forms import disc
from carom.catalogue.walled import edges
from carom.model.scene import Chain, Scene, Wall
from carom.model.walls import Leg, drive_of
from carom.studies.stress.attack import Attack, Trial, attack, closed_form_judge, velocity_judge
from carom.studies.stress.pairs import PHASES, RATE_HZ, STEPS_BEFORE, attacked
from carom.studies.stress.truth import true_motion
from carom.support.formatting import metres, number

_DT_S = 1.0 / RATE_HZ
_RADIUS_M = 0.25
#: A hundredth of a diameter a step, as in `carom.studies.stress.pairs`.
_SPEED_M_S = 0.01 * 2 * _RADIUS_M * RATE_HZ
#: Half the length of a wall; discs reach its ends only in attacks on the ends.
_HALF_LENGTH_M = 4.0
#: Initial distance of a disc from a corner, and its speed: it is back after 30 steps, and moves an eighth of its radius
#: in each.
_CORNER_M, _CORNER_SPEED_M_S = 0.5, 2 * 0.5 / (30 * _DT_S)

_HEAD_ON = "the normal is known without rounding: the velocity along it is turned round"
_VELOCITY = "a final velocity wrong by more than a tenth of what the impact changes: a miss is wrong by all of it"


def _met(
    axis: str, ends: tuple[float, float], truth: str, gives_way: str = _VELOCITY, **more: Any
) -> Callable[[Callable[..., Any]], Attack]:
    """Return a decorator that turns a function that stages one impact into an attack, at every phase."""
    return attack(axis, ends, truth, gives_way, phases=PHASES, **more)


def _upright(**fields: Any) -> Chain:
    return edges(-1j * _HALF_LENGTH_M, 1j * _HALF_LENGTH_M, **fields)


def _scene(name: str, shows: str, phase: float, start: complex, velocity: complex, wall: Chain) -> Scene:
    said = f"{shows} Phase {phase:g} of a step."
    return attacked(name, said, [disc(start, velocity, _RADIUS_M)], walls=[wall])


def _once(scene: Scene, after: complex) -> Trial:
    """Judge a disc that meets a wall once by the velocity that it must have then."""
    changed = after - complex(*scene.discs[0].velocity_m_s)
    return Trial(scene, closed_form_judge(scene, [(after.real, after.imag)], 1, [abs(changed)]))


def _until(phase: float) -> float:
    """Return the time of the impact, seconds."""
    return (STEPS_BEFORE + phase) * _DT_S


@_met("speed x dt / radius, at a wall without thickness", (0.01, 1e4), _HEAD_ON)
def _thin_wall(value: float, phase: float) -> Trial:
    speed = value * _RADIUS_M * RATE_HZ
    scene = _scene(
        "thin-wall",
        f"A disc that moves {number(value, 3)} radii a step meets a wall without thickness head-on.",
        phase,
        complex(-_RADIUS_M - speed * _until(phase), 0.0),
        complex(speed),
        _upright(),
    )
    return _once(scene, complex(-speed))


@_met(
    "speed x dt / radius of a driven wall without thickness, at a disc at rest",
    (0.01, 1e4),
    "Newton's law as seen from the wall: a disc at rest gets twice the wall's velocity",
)
def _paddle(value: float, phase: float) -> Trial:
    speed = value * _RADIUS_M * RATE_HZ
    scene = _scene(
        "paddle",
        f"A wall without thickness is driven, {number(value, 3)} radii a step, head-on at a disc at rest.",
        phase,
        complex(_RADIUS_M + speed * _until(phase)),
        0j,
        _upright(velocity_m_s=(speed, 0.0)),
    )
    return _once(scene, complex(2.0 * speed))


@_met("half width of a wall, metres", (0.1, 1e-12), _HEAD_ON, last=0.0)
def _wall_width(value: float, phase: float) -> Trial:
    scene = _scene(
        "wall-width",
        f"A disc meets a wall of half width {metres(value)} head-on.",
        phase,
        complex(-value - _RADIUS_M - _SPEED_M_S * _until(phase), 0.0),
        complex(_SPEED_M_S),
        _upright(half_width_m=value),
    )
    return _once(scene, complex(-_SPEED_M_S))


@_met(
    "1 - b/R, how far from a miss of the end of a wall",
    (0.1, 1e-15),
    "the normal at an end is from it to the centre: s off, (2 s² - 1, 2 s √(1 - s²)), in 28 decimal digits "
    "from the scene as stored",
)
def _wall_end(value: float, phase: float) -> Trial:
    """Stage a disc that flies along the line across a wall's end; the normal there is from the end to the centre."""
    height = _RADIUS_M * (1.0 - value)
    offset = Decimal(height) / Decimal(_RADIUS_M)  # of the scene as stored
    along = (1 - offset * offset).sqrt()
    after = complex(float(2 * offset * offset - 1), float(2 * offset * along)) * _SPEED_M_S
    scene = _scene(
        "wall-end",
        f"A disc grazes the end of a thin wall; 1 - b/R is {number(value, 3)}.",
        phase,
        complex(-_RADIUS_M * float(along) - _SPEED_M_S * _until(phase), height),
        complex(_SPEED_M_S),
        edges(-1j * _HALF_LENGTH_M, 0j),
    )
    return _once(scene, after)


@_met(
    "pieces of a floor of 8 m",
    (2.0, 1000.0),
    "a seam is no wall of its own: the velocity is mirrored at the floor",
    f"{_VELOCITY}; a catch at a seam turns the way that the disc goes",
    whole=True,
)
def _seam(value: float, phase: float) -> Trial:
    pieces = int(value)
    joint = _HALF_LENGTH_M * (2 * (pieces // 2) / pieces - 1)
    velocity = _SPEED_M_S * (4 - 1j)
    scene = _scene(
        "seam",
        f"A disc strikes a floor of {pieces} pieces at a slant, where two of them meet.",
        phase,
        complex(joint, _RADIUS_M) - velocity * _until(phase),
        velocity,
        edges(-_HALF_LENGTH_M, _HALF_LENGTH_M, pieces=pieces),
    )
    return _once(scene, velocity.conjugate())


@_met(
    "degrees of a corner",
    (90.0, 1.0),
    "the half-planes through its sides, in 240 decimal digits: the corner itself is out of the disc's reach",
    "a final velocity wrong by more than a tenth of the greatest change that one of its impacts makes",
)
def _corner(value: float, phase: float) -> Trial:
    """Stage a disc that is thrown into a corner past its apex; the half-planes through the sides give its motion."""
    angle = math.radians(value)
    inwards = cmath.exp(0.5j * angle)
    # The centre moves in a corner of its own, a radius from both sides.
    apex = _RADIUS_M / math.sin(0.5 * angle) * inwards
    start = apex + (_CORNER_M + phase * _CORNER_SPEED_M_S * _DT_S) * inwards
    # The disc aims an eighth of the angle past the apex, so it never meets both sides at once.
    velocity = -_CORNER_SPEED_M_S * inwards * cmath.exp(0.125j * angle)
    side = abs(apex) + _HALF_LENGTH_M
    scene = _scene(
        "corner",
        f"A disc is thrown into a corner of {number(value, 3)} degrees.",
        phase,
        start,
        velocity,
        edges(side, 0j, side * cmath.exp(1j * angle)),
    )
    across = -1j * cmath.exp(1j * angle)
    sides = [Wall(point_m=(0.0, 0.0), normal=normal) for normal in ((0.0, 1.0), (across.real, across.imag))]
    return Trial(scene, velocity_judge(true_motion(scene.model_copy(update={"walls": tuple(sides)})), scene))


@_met(
    "legs of a driven wall's path",
    (1.0, 1000.0),
    "Newton's law as seen from the wall on its last leg: a disc at rest gets twice the wall's velocity",
    whole=True,
)
def _legs(value: float, phase: float) -> Trial:
    """Stage a wall that moves to and fro, three steps on and one back, and strikes a disc at rest on its last leg.

    Half of the last leg leads beyond where the wall has been before.
    """
    legs, until_s = int(value), _until(phase)
    lasts = until_s / (legs - 0.5)
    speeds = [_SPEED_M_S * (3.0 if (legs - k) % 2 else -1.0) for k in range(legs)]
    path = tuple(Leg(from_s=k * lasts, velocity_m_s=(speed, 0.0)) for k, speed in enumerate(speeds))
    moved, _ = drive_of(path, (0.0, 0.0)).moved_at(until_s)
    scene = _scene(
        "legs",
        f"A wall that turns {legs - 1} times strikes a disc at rest.",
        phase,
        complex(_RADIUS_M + moved),
        0j,
        _upright(legs=path),
    )
    return _once(scene, complex(2.0 * speeds[-1]))


def wall_attacks() -> list[Attack]:
    """Return the attacks with a disc and a finite wall."""
    return [_thin_wall, _wall_end, _seam, _wall_width, _paddle, _legs, _corner]
