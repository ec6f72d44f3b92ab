"""The model that a scene becomes, in MuJoCo's own language: geoms, joints, contacts, and how these are answered."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence

from carom.adapter import Scene, Setting, wall_body
from carom_adapters.mujoco.limits import ENABLE_SETTINGS, FLAG_SETTINGS, OPTION_SETTINGS, answers_in_turn, lists_pairs

__all__ = ["dampings_about", "mass_unit", "mjcf"]

#: `mju_QCQP2`, which fits friction into its cone, gives none where its determinant, friction**4 / mass**2 of a contact
#: or more, is below 1e-10, and takes for exact what is wrong by 1e-10 N^2. In units in which the heaviest disc has this
#: times the square of the friction, and no more than 1, the first is kept away from, and the second is little.
MASS_OVER_FRICTION_SQUARED = 1e4

#: The impedance of contacts in `tuned`, the first number of its ``solimp``.
IMPEDANCE = 0.9999

#: Moment of a cylinder as high as it is wide about an axis across its own, over mass times radius squared: 1/4 + 1/3.
CYLINDER_TIPS = 7 / 12


def _solref(stiffness: float, restitution: float, dt_s: float) -> tuple[float, float]:
    """Return a contact's ``solref`` in the form (-stiffness, -damping) for this coefficient of restitution.

    MuJoCo aims at the acceleration ``-damping * v - stiffness * depth`` along the normal, whatever the masses. Without
    stiffness, and with a damping of ``(1 + restitution) / dt``, the Euler step makes ``-restitution * v`` of ``v``: an
    impact, over in one step. With stiffness, the contact is an oscillator that leaves after half a period with
    ``restitution = exp(-pi z / sqrt(1 - z**2))``, z being its damping ratio, if it may pull at the end.
    """
    if stiffness == 0:
        return 0.0, -(1.0 + restitution) / dt_s
    loss = -math.log(restitution) if restitution > 0 else math.inf
    ratio = 1.0 if math.isinf(loss) else loss / math.hypot(math.pi, loss)
    return -stiffness, -2.0 * ratio * math.sqrt(stiffness)


def _solreffriction(scene: Scene, discs: tuple[int, ...], dt_s: float) -> tuple[float, float]:
    """Return a contact's ``solreffriction`` that ends the slip of these discs within the step.

    Left out, friction takes the bounce of ``solref`` for its own, and gives ``restitution`` of the slip back. MuJoCo
    regularises friction as it does the push, by ``(1 - d) / d`` of the inverse mass along the normal, where that along
    the slip is larger by the inertia: the quotient makes up for it, as MuJoCo itself does for the push.
    """
    inverse = [1.0 / scene.discs[i].mass_kg for i in discs]
    slip = [(1.0 + 1.0 / scene.discs[i].inertia_factor) / scene.discs[i].mass_kg for i in discs]
    return 0.0, -(IMPEDANCE + (1.0 - IMPEDANCE) * sum(inverse) / sum(slip)) / dt_s


def mass_unit(scene: Scene, settings: Mapping[str, Setting]) -> float:
    """Return how many of the model's units of mass a kilogram is: 1, or a power of two where friction needs another."""
    if not answers_in_turn(scene, settings):
        return 1.0
    heaviest = max(disc.mass_kg for disc in scene.discs if not disc.immovable)
    rubbing = [(scene.arrays.rubs_discs, scene.friction), (scene.arrays.rubs_walls, scene.wall_friction)]
    least = min(friction for rubs, friction in rubbing if rubs)
    return 2.0 ** math.floor(math.log2(min(1.0, MASS_OVER_FRICTION_SQUARED * least**2) / heaviest))


def _attributes(**values: object) -> str:
    # repr keeps every bit of a float.
    return " ".join(f'{name}="{value if isinstance(value, str) else repr(value)}"' for name, value in values.items())


def _friction(friction: float) -> dict[str, object]:
    """Return what a geom says of it: condim 1 is a contact without friction, 3 one that slides but does not roll."""
    return {"condim": "3", "friction": f"{friction!r} 0 0"} if friction > 0 else {"condim": "1"}


def mjcf(scene: Scene, settings: Mapping[str, Setting]) -> str:
    """Return the model. A geom is named by its body's number, which is how contacts find their bodies again."""
    dt_s, stiffness = float(settings["dt_s"]), float(settings["stiffness"])
    listed = {"contype": "0", "conaffinity": "0"} if lists_pairs(scene, settings) else {}
    shared = listed | ({"solimp": str(settings["solimp"])} if "solimp" in settings else {})
    unit = mass_unit(scene, settings)

    def geom(number: int, restitution: float, friction: float, **values: object) -> str:
        solref = "{!r} {!r}".format(*_solref(stiffness, restitution, dt_s))
        return f"<geom {_attributes(name=str(number), solref=solref, **_friction(friction), **shared, **values)}/>"

    def disc(i: int) -> str:
        body = scene.discs[i]
        place = "{!r} {!r} 0".format(*body.position_m)
        shape: dict[str, object] = {"type": "sphere", "size": body.radius_m}
        if settings.get("shape", "sphere") == "cylinder":
            shape = {"type": "cylinder", "size": f"{body.radius_m!r} {body.radius_m!r}"}
        friction = scene.friction if scene.arrays.turns else 0.0
        if body.immovable:
            return geom(i, scene.restitution, friction, pos=place, **shape)
        made = geom(i, scene.restitution, friction, **shape)
        if scene.arrays.turns:
            return f"<body>{_turning(scene, settings, i, unit)}{made}</body>"
        damped = _damping(scene, body.mass_kg)
        if settings["joints"] == "slide":
            # Its inertia about any axis is of no effect, so it is not left to a small disc to have too little of it.
            return (
                f'<body><inertial pos="0 0 0" mass="{body.mass_kg!r}" diaginertia="1 1 1"/>'
                f'<joint type="slide" axis="1 0 0"{damped}/><joint type="slide" axis="0 1 0"{damped}/>{made}</body>'
            )
        made = geom(i, scene.restitution, friction, mass=body.mass_kg, **shape)
        return f"<body>{_free_joint(damped)}{made}</body>"

    planes = scene.half_planes()

    def wall(k: int) -> str:
        half_plane = planes[k]
        return geom(
            wall_body(k),
            scene.wall_restitution,
            scene.wall_friction,
            type="plane",
            size="0 0 1",  # infinite
            pos="{!r} {!r} 0".format(*half_plane.point_m),
            zaxis="{!r} {!r} 0".format(*half_plane.normal),
            # The geom of higher priority decides alone; MuJoCo would take the larger damping, and friction, of the two
            # otherwise.
            priority="1",
        )

    bodies = "\n".join([*map(disc, range(len(scene.discs))), *map(wall, range(len(scene.walls)))])
    world = f"{_option(scene, settings)}<worldbody>\n{bodies}\n</worldbody>"
    if lists_pairs(scene, settings):
        world += f"<contact>\n{_pairs(scene, settings)}\n</contact>"
    return f"<mujoco>{world}</mujoco>"


def _option(scene: Scene, settings: Mapping[str, Setting]) -> str:
    # Of one pass without a warm start, each contact's push comes first, and friction within its bounds then.
    one_pass: dict[str, Setting] = {"cone": "elliptic", "solver": "PGS", "iterations": 1, "warmstart": False}
    asked = (one_pass if answers_in_turn(scene, settings) else {}) | dict(settings)
    option = _attributes(
        timestep=float(asked["dt_s"]),
        gravity="{!r} {!r} 0".format(*scene.gravity_m_s2),
        **{k: v for k, v in asked.items() if k in OPTION_SETTINGS},
    )
    flag = _attributes(
        **{k: "enable" if v else "disable" for k, v in asked.items() if k in FLAG_SETTINGS + ENABLE_SETTINGS}
    )
    return f"<option {option}><flag {flag}/></option>"


def _turning(scene: Scene, settings: Mapping[str, Setting], i: int, unit: float) -> str:
    """Return inertia and joints of a disc that may turn."""
    body = scene.discs[i]
    mass, turns = body.mass_kg * unit, math.isfinite(body.inertia_factor)
    factor = body.inertia_factor if turns else 1.0  # of no effect without a hinge
    free = turns and settings["joints"] == "free"
    tips = CYLINDER_TIPS if free and settings.get("shape", "sphere") == "cylinder" else factor
    moments = " ".join(repr(moment * mass * body.radius_m**2) for moment in (tips, tips, factor))
    inertial = f'<inertial pos="0 0 0" mass="{mass!r}" diaginertia="{moments}"/>'
    if free:
        return f"{inertial}{_free_joint(_damping(scene, mass))}"
    # The third slide, along which nothing pushes, makes MuJoCo's mean of the inverse masses along all axes that of one.
    damped = _damping(scene, mass)
    slides = "".join(f'<joint type="slide" axis="{axis}"{damped}/>' for axis in ("1 0 0", "0 1 0", "0 0 1"))
    about = _damping(scene, factor * mass * body.radius_m**2)
    return f"{inertial}{slides}" + (f'<joint type="hinge" axis="0 0 1"{about}/>' if turns else "")


def _damping(scene: Scene, inertia: float) -> str:
    """Return a joint's attribute, which is a force over a velocity: the rate times the mass or moment of inertia."""
    return f' damping="{scene.damping_per_s * inertia!r}"' if scene.damping_per_s else ""


def _free_joint(damped: str) -> str:
    return f'<joint type="free"{damped}/>' if damped else "<freejoint/>"


def dampings_about(scene: Scene, settings: Mapping[str, Setting], inertia: Sequence[float]) -> list[float] | None:
    """Return the damping about the axes of a free joint with these moments of inertia; None where MJCF has said it.

    MJCF has one damping for all six axes of a free joint, and that along them is the mass's.
    """
    if not (scene.damping_per_s and scene.arrays.turns and settings["joints"] == "free"):
        return None
    return [scene.damping_per_s * moment for moment in inertia]


def _pairs(scene: Scene, settings: Mapping[str, Setting]) -> str:
    """Return every pair of a disc with another body, not both immovable, with a contact of its own."""
    dt_s, stiffness, discs = float(settings["dt_s"]), float(settings["stiffness"]), scene.discs
    solimp = {"solimp": str(settings["solimp"])} if "solimp" in settings else {}
    pairs = [
        (i, j, scene.restitution, scene.friction)
        for i in range(len(discs))
        for j in range(i + 1, len(discs))
        if not (discs[i].immovable and discs[j].immovable)
    ]
    pairs += [
        (i, wall_body(k), scene.wall_restitution, scene.wall_friction)
        for i in range(len(discs))
        for k in range(len(scene.walls))
        if not discs[i].immovable
    ]

    def pair(i: int, j: int, restitution: float, friction: float) -> str:
        rubs: dict[str, object] = {"condim": "1"}
        if friction > 0:
            rubs = {"condim": "3", "friction": f"{friction!r} {friction!r} 0 0 0"}
            if answers_in_turn(scene, settings):
                met = tuple(body for body in (i, j) if body >= 0)
                rubs["solreffriction"] = "{!r} {!r}".format(*_solreffriction(scene, met, dt_s))
        solref = "{!r} {!r}".format(*_solref(stiffness, restitution, dt_s))
        return f"<pair {_attributes(geom1=str(i), geom2=str(j), solref=solref, **rubs, **solimp)}/>"

    return "\n".join(itertools.starmap(pair, pairs))
