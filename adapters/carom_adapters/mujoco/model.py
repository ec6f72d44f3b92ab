"""Model of a scene in MuJoCo: geoms, joints, and contacts with their parameters."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from itertools import combinations

from carom.engines.api import Chain, Ring, Scene, Setting, reach, wall_body, wall_index
from carom_adapters.mujoco.limits import FLAG_SETTINGS, OPTION_SETTINGS, does_list_pairs, does_solve_in_turn
from carom_adapters.shared.walls import compute_thickness, cut_chain

#: MuJoCo's function `mju_QCQP2` limits friction by Coulomb's law. The function returns no friction if a determinant is
#: below 1e-10, and accepts errors of 1e-10 N^2. The determinant of a contact is at least friction^4 / mass^2. In the
#: chosen unit of mass, the heaviest disc has a mass of at most 1, and of at most `MASS_OVER_FRICTION_SQUARED` times
#: friction^2.
MASS_OVER_FRICTION_SQUARED = 1e4

#: The impedance of contacts with the profile `tuned`: the first number in its setting ``solimp``.
IMPEDANCE = 0.9999

#: Moment of inertia of a cylinder about a diameter, divided by mass times radius squared: 1/4 + 1/3, if the height
#: equals the diameter.
CYLINDER_TIPS = 7 / 12


#: In MuJoCo, impacts change the velocity of every moving body (except `mocap` bodies, which contacts treat as at rest).
#: So driven bodies have a huge mass: `DRIVEN_MASS` times the heaviest disc's mass. An impact then changes a driven
#: body's velocity by only 1e-13 times the closing speed.
DRIVEN_MASS = 2.0**44
#: Smaller ratio that replaces `DRIVEN_MASS` if the solver stops at a tolerance. From a ratio of 2^34 on, rounding
#: errors of the quantity that the solver minimises exceed the tolerance. With a ratio of 2^44, the error of a disc's
#: velocity is 1.3 times the closing speed.
DRIVEN_MASS_IN_TOLERANCE = 2.0**28


def _compute_solref(stiffness: float, restitution: float, dt_s: float) -> tuple[float, float]:
    """Return a contact's ``solref`` for a coefficient of restitution, in the form (-stiffness, -damping).

    MuJoCo aims at the acceleration ``-damping * v - stiffness * depth`` along the normal, for any masses. Without
    stiffness, and with a damping of ``(1 + restitution) / dt``, an Euler step changes the velocity ``v`` to
    ``-restitution * v``, so an impact takes one step. With stiffness, the contact is an oscillator that ends after half
    a period with ``restitution = exp(-pi z / sqrt(1 - z**2))``, where z is the damping ratio. The formula assumes that
    the contact also pulls the bodies together shortly before they separate.
    """
    if stiffness == 0:
        return 0.0, -(1.0 + restitution) / dt_s
    loss = -math.log(restitution) if restitution > 0 else math.inf
    ratio = 1.0 if math.isinf(loss) else loss / math.hypot(math.pi, loss)
    return -stiffness, -2.0 * ratio * math.sqrt(stiffness)


def _compute_solreffriction(scene: Scene, discs: tuple[int, ...], dt_s: float) -> tuple[float, float]:
    """Return the ``solreffriction`` of a contact that ends the slip (sliding) of two discs within one step.

    Without `solreffriction`, MuJoCo applies `solref` also to friction, and a sliding speed u becomes ``-restitution *
    u`` instead of 0. MuJoCo regularises friction and the normal force alike, by ``(1 - d) / d`` times the inverse mass
    along the normal. In the direction of sliding, the inverse mass is larger, because the discs can turn. The quotient
    of the two inverse masses compensates for this difference. For the normal force, MuJoCo itself compensates for the
    regularisation.
    """
    inverse = [1.0 / scene.discs[i].mass_kg for i in discs]
    slip = [(1.0 + 1.0 / scene.discs[i].inertia_factor) / scene.discs[i].mass_kg for i in discs]
    return 0.0, -(IMPEDANCE + (1.0 - IMPEDANCE) * sum(inverse) / sum(slip)) / dt_s


def choose_mass_unit(scene: Scene, settings: Mapping[str, Setting]) -> float:
    """Return the number of the model's mass units per kilogram: 1, or a power of two if friction needs another unit."""
    if not does_solve_in_turn(scene, settings):
        return 1.0
    frictions = [scene.friction] * scene.arrays.has_disc_friction + [wall.friction for wall in scene.arrays.materials]
    least_friction = min(friction for friction in frictions if friction > 0)
    return 2.0 ** math.floor(
        math.log2(min(1.0, MASS_OVER_FRICTION_SQUARED * least_friction**2) / _find_heaviest(scene))
    )


def _format_attributes(**values: object) -> str:
    # repr keeps every bit of a float.
    return " ".join(f'{name}="{value if isinstance(value, str) else repr(value)}"' for name, value in values.items())


def build_mjcf(scene: Scene, settings: Mapping[str, Setting]) -> str:
    """Return the model as MJCF.

    The name of each geom (shape) is the number of its body, which identifies the bodies of contacts. Driven bodies are
    last.
    """
    dt_s, stiffness = float(settings["dt_s"]), float(settings["stiffness"])
    listed = {"contype": "0", "conaffinity": "0"} if does_list_pairs(scene, settings) else {}
    shared = listed | ({"solimp": str(settings["solimp"])} if "solimp" in settings else {})
    unit = choose_mass_unit(scene, settings)
    # Static bodies collide only with movable bodies, so that driven bodies pass through walls.
    fixed_attributes = {"contype": "0"} if scene.arrays.driven and not listed else {}

    def format_geom(name: str | int, restitution: float, friction: float, **values: object) -> str:
        solref = "{!r} {!r}".format(*_compute_solref(stiffness, restitution, dt_s))
        # Condim 1 means a contact without friction, and condim 3 means a contact with sliding friction.
        rubbing = {"condim": "3", "friction": f"{friction!r} 0 0"} if friction > 0 else {"condim": "1"}
        return f"<geom {_format_attributes(name=str(name), solref=solref, **rubbing, **shared, **values)}/>"

    def format_disc(i: int) -> str:
        body = scene.discs[i]
        place = "{!r} {!r} 0".format(*body.position_m)
        shape: dict[str, object] = {"type": "sphere", "size": body.radius_m}
        if settings.get("shape", "sphere") == "cylinder":
            shape = {"type": "cylinder", "size": f"{body.radius_m!r} {body.radius_m!r}"}
        friction = scene.friction if scene.arrays.turns else 0.0
        if body.immovable:
            place = "0 0 0" if body.driven else place
            geom = format_geom(i, scene.restitution, friction, pos=place, **shape, **fixed_attributes)
            turns = scene.arrays.turns
            return f"{_format_driven_start(scene, settings, turns=turns)}{geom}</body>" if body.driven else geom
        geom = format_geom(i, scene.restitution, friction, **shape)
        if scene.arrays.turns:
            return f"<body>{_format_turning(scene, settings, i, unit)}{geom}</body>"
        damped = _format_damping(scene, body.mass_kg)
        if settings["joints"] == "slide":
            # The disc can't turn, so its moments of inertia have no effect. The moments are 1 here, because MuJoCo
            # refuses the tiny moments of a small disc.
            return (
                f'<body><inertial pos="0 0 0" mass="{body.mass_kg!r}" diaginertia="1 1 1"/>'
                f'<joint type="slide" axis="1 0 0"{damped}/><joint type="slide" axis="0 1 0"{damped}/>{geom}</body>'
            )
        geom = format_geom(i, scene.restitution, friction, mass=body.mass_kg, **shape)
        return f"<body>{_format_free_joint(damped)}{geom}</body>"

    def format_wall(k: int) -> str:
        material = scene.arrays.materials[k]
        geom = "".join(
            # With the priority 1, MuJoCo uses only the wall's parameters. Without the priority, MuJoCo would use the
            # larger damping and friction of disc and wall.
            format_geom(name, material.restitution, material.friction, **shape, priority="1", **fixed_attributes)
            for name, shape in zip(list_wall_names(scene, k), _list_wall_shapes(scene, k, dt_s), strict=True)
        )
        return f"{_format_driven_start(scene, settings)}{geom}</body>" if scene.walls[k].driven else geom

    bodies = "\n".join(format_disc(body) if body >= 0 else format_wall(wall_index(body)) for body in sort_bodies(scene))
    world = f"{_format_option(scene, settings)}<worldbody>\n{bodies}\n</worldbody>"
    if does_list_pairs(scene, settings):
        world += f"<contact>\n{_format_pairs(scene, settings)}\n</contact>"
    return f"<mujoco>{world}</mujoco>"


def sort_bodies(scene: Scene) -> list[int]:
    """Return the numbers of all discs and walls in the order of the model. Driven bodies are last."""
    bodies = [*range(len(scene.discs)), *map(wall_body, range(len(scene.walls)))]
    return sorted(bodies, key=lambda body: (scene.discs[body] if body >= 0 else scene.walls[wall_index(body)]).driven)


def parse_body(geom: str) -> int:
    """Return the number of the body to which a geom belongs, given the geom's name."""
    return int(geom.partition("/")[0])


def list_wall_names(scene: Scene, k: int) -> list[str]:
    """Return the names of a wall's geoms: the wall's number, or ``number/piece`` if the wall has several pieces."""
    wall, number = scene.walls[k], str(wall_body(k))
    pieces = len(cut_chain(wall)) if isinstance(wall, Chain) else 1
    return [number] if pieces == 1 else [f"{number}/{piece}" for piece in range(pieces)]


def _list_wall_shapes(scene: Scene, k: int, dt_s: float) -> list[dict[str, object]]:
    """Return the geoms of a wall: a plane, a capsule for each piece of a chain, or a sphere for a circle."""
    wall = scene.walls[k]
    if isinstance(wall, Ring):
        return [{"type": "sphere", "size": compute_thickness(scene, wall), "pos": "{!r} {!r} 0".format(*wall.centre_m)}]
    if isinstance(wall, Chain):
        ends = ["{!r} {!r} 0 {!r} {!r} 0".format(*a, *b) for a, b in cut_chain(wall)]
        return [{"type": "capsule", "size": compute_thickness(scene, wall), "fromto": end} for end in ends]
    facing = {"zaxis": "{!r} {!r} 0".format(*wall.normal)}
    if not wall.driven:
        # a size of 0 means infinite
        return [{"type": "plane", "size": "0 0 1", "pos": "{!r} {!r} 0".format(*wall.point_m), **facing}]
    # In MuJoCo, a plane can't move. So a driven half-plane is a large box, of which discs can reach only the face that
    # acts as the half-plane.
    centre, radius = reach(scene, dt_s)
    drift = wall.drive.fastest * (scene.duration_s + dt_s)
    half = 2.0 * (radius + drift + math.dist(centre, wall.point_m))
    (x, y), (nx, ny) = wall.point_m, wall.normal
    place = f"{x - half * nx!r} {y - half * ny!r} 0"
    return [{"type": "box", "size": f"{half!r} {half!r} {half!r}", "pos": place, **facing}]


def _find_heaviest(scene: Scene) -> float:
    return max((disc.mass_kg for disc in scene.discs if not disc.immovable), default=1.0)


def _format_driven_start(scene: Scene, settings: Mapping[str, Setting], *, turns: bool = False) -> str:
    """Return the first MJCF lines of a driven body: joints, and a mass so large that impacts hardly move the body."""
    ratio = DRIVEN_MASS if settings.get("tolerance") == 0 else DRIVEN_MASS_IN_TOLERANCE
    mass = ratio * choose_mass_unit(scene, settings) * _find_heaviest(scene)
    inertia = mass * max(disc.radius_m for disc in scene.discs) ** 2
    hinge = '<joint type="hinge" axis="0 0 1"/>' if turns else ""
    return (
        f'<body gravcomp="1"><inertial pos="0 0 0" mass="{mass!r}" diaginertia="{" ".join([repr(inertia)] * 3)}"/>'
        f'<joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/>{hinge}'
    )


def _format_option(scene: Scene, settings: Mapping[str, Setting]) -> str:
    # With one iteration and without a warm start, the solver computes each contact's normal force before its friction.
    one_pass: dict[str, Setting] = {"cone": "elliptic", "solver": "PGS", "iterations": 1, "warmstart": False}
    values = (one_pass if does_solve_in_turn(scene, settings) else {}) | dict(settings)
    option = _format_attributes(
        timestep=float(values["dt_s"]),
        gravity="{!r} {!r} 0".format(*scene.gravity_m_s2),
        **{k: v for k, v in values.items() if k in OPTION_SETTINGS},
    )
    flag = _format_attributes(**{k: "enable" if v else "disable" for k, v in values.items() if k in FLAG_SETTINGS})
    return f"<option {option}><flag {flag}/></option>"


def _format_turning(scene: Scene, settings: Mapping[str, Setting], i: int, unit: float) -> str:
    """Return inertia and joints of a disc that may turn."""
    body = scene.discs[i]
    mass, turns = body.mass_kg * unit, math.isfinite(body.inertia_factor)
    factor = body.inertia_factor if turns else 1.0  # a disc without a hinge can't turn, so its inertia has no effect
    free = turns and settings["joints"] == "free"
    tips = CYLINDER_TIPS if free and settings.get("shape", "sphere") == "cylinder" else factor
    moments = " ".join(repr(moment * mass * body.radius_m**2) for moment in (tips, tips, factor))
    inertial = f'<inertial pos="0 0 0" mass="{mass!r}" diaginertia="{moments}"/>'
    if free:
        return f"{inertial}{_format_free_joint(_format_damping(scene, mass))}"
    # No force acts along z. The third slide is needed since MuJoCo uses the mean inverse mass over all three axes.
    damped = _format_damping(scene, mass)
    slides = "".join(f'<joint type="slide" axis="{axis}"{damped}/>' for axis in ("1 0 0", "0 1 0", "0 0 1"))
    about = _format_damping(scene, factor * mass * body.radius_m**2)
    return f"{inertial}{slides}" + (f'<joint type="hinge" axis="0 0 1"{about}/>' if turns else "")


def _format_damping(scene: Scene, inertia: float) -> str:
    """Return the damping attribute of a joint: the rate of damping times the mass or the moment of inertia."""
    return f' damping="{scene.damping_per_s * inertia!r}"' if scene.damping_per_s else ""


def _format_free_joint(damped: str) -> str:
    return f'<joint type="free"{damped}/>' if damped else "<freejoint/>"


def list_axis_dampings(scene: Scene, settings: Mapping[str, Setting], inertia: Sequence[float]) -> list[float] | None:
    """Return the damping of the three rotations of a free joint; None to keep the damping that MJCF sets.

    `inertia` contains the moments of inertia of the body.
    In MJCF, all six axes of a free joint have the same damping, which is right only for translations.
    """
    if not (scene.damping_per_s and scene.arrays.turns and settings["joints"] == "free"):
        return None
    return [scene.damping_per_s * moment for moment in inertia]


def _format_pairs(scene: Scene, settings: Mapping[str, Setting]) -> str:
    """Return the contact parameters, as MJCF, of each pair of a disc and another body, unless both are immovable."""
    dt_s, stiffness, discs = float(settings["dt_s"]), float(settings["stiffness"]), scene.discs
    solimp = {"solimp": str(settings["solimp"])} if "solimp" in settings else {}
    pairs: list[tuple[int, str | int, float, float]] = [
        (i, j, scene.restitution, scene.friction)
        for i, j in combinations(range(len(discs)), 2)
        if not (discs[i].immovable and discs[j].immovable)
    ]
    walls = [
        (name, material) for k, material in enumerate(scene.arrays.materials) for name in list_wall_names(scene, k)
    ]
    movable = [i for i, disc in enumerate(discs) if not disc.immovable]
    pairs += [(i, name, material.restitution, material.friction) for i in movable for name, material in walls]

    def format_pair(i: int, j: str | int, restitution: float, friction: float) -> str:
        rubs: dict[str, object] = {"condim": "1"}
        if friction > 0:
            rubs = {"condim": "3", "friction": f"{friction!r} {friction!r} 0 0 0"}
            if does_solve_in_turn(scene, settings):
                disc_numbers = (i, j) if isinstance(j, int) else (i,)
                rubs["solreffriction"] = "{!r} {!r}".format(*_compute_solreffriction(scene, disc_numbers, dt_s))
        solref = "{!r} {!r}".format(*_compute_solref(stiffness, restitution, dt_s))
        return f"<pair {_format_attributes(geom1=str(i), geom2=str(j), solref=solref, **rubs, **solimp)}/>"

    return "\n".join(itertools.starmap(format_pair, pairs))
