"""Writes a scene and settings as an MJCF model, which MuJoCo loads without Carom.

The model's keyframe is the scene's initial state.
"""

from __future__ import annotations

from collections.abc import Mapping
from xml.etree import ElementTree

from carom.engines.api import AdapterError, Scene, Setting, wall_index
from carom_adapters.mujoco.limits import does_solve_in_turn, require_usable
from carom_adapters.mujoco.model import build_mjcf, choose_mass_unit, sort_bodies
from carom_adapters.shared.legs import has_legs
from carom_adapters.shared.settings_code import count_steps, format_comment


def write_code(scene: Scene, settings: Mapping[str, Setting], heading: str) -> str:
    """Return the model of `build_mjcf` in a readable form.

    Attributes that are the same for all geoms, or for all pairs, are moved into the model's defaults.
    """
    require_usable(scene, settings)
    if has_legs(scene):
        raise AdapterError("MuJoCo: the velocity of a body changes between steps, which a model can't describe")
    # The text contains only numbers, and words that the adapter has checked.
    model = ElementTree.fromstring(build_mjcf(scene, settings))  # noqa: S314 - the adapter itself has written this text
    _share_attributes(model)
    _add_keyframe(model, scene, settings)
    ElementTree.indent(model)
    sentences = [heading, f"The scene takes {count_steps(scene, settings)} steps from the keyframe."]
    if not float(settings["stiffness"]):
        sentences.append("solref is 0 and -(1 + restitution) / timestep: if you change timestep, also change solref.")
    if (unit := choose_mass_unit(scene, settings)) != 1.0:
        sentences.append(f"A kilogram is {unit!r} units of mass in this model. The unit does not affect the motion.")
    if does_solve_in_turn(scene, settings):
        sentences.append(
            "The model lists each pair of bodies, because solreffriction, a setting for friction, depends on masses."
        )
    if scene.damping_per_s and scene.arrays.turns and settings["joints"] == "free":
        sentences.append(
            "MJCF has one damping for all axes of a free joint. After loading, set dof_damping of its rotations to "
            f"{scene.damping_per_s!r} times body_inertia."
        )
    text = format_comment(
        "\n".join(sentences).replace("--", "- -"), "     "
    ).lstrip()  # a comment can't contain two hyphens
    return f"<!-- {text} -->\n{ElementTree.tostring(model, encoding='unicode')}\n"


def _share_attributes(model: ElementTree.Element) -> None:
    """Move attributes that all geoms, or all pairs, share into the model's defaults."""
    defaults = ElementTree.Element("default")
    for tag in ("geom", "pair"):
        several = model.findall(f".//{tag}")
        shared = set.intersection(*(set(element.attrib.items()) for element in several)) if len(several) > 1 else set()
        if not shared:
            continue
        ElementTree.SubElement(defaults, tag, {k: v for k, v in several[0].attrib.items() if (k, v) in shared})
        for element in several:
            element.attrib = {k: v for k, v in element.attrib.items() if (k, v) not in shared}
    if len(defaults):
        model.insert(1, defaults)  # the first element is the option


def _add_keyframe(model: ElementTree.Element, scene: Scene, settings: Mapping[str, Setting]) -> None:
    """Add the keyframe from which the model starts: the coordinates and velocities of each moving body's joints."""
    places: list[float] = []
    speeds: list[float] = []
    for number in sort_bodies(scene):
        if number < 0:
            wall = scene.walls[wall_index(number)]
            places += [0.0, 0.0] * wall.driven
            speeds += [*wall.velocity_m_s] * wall.driven
            continue
        disc = scene.discs[number]
        if disc.driven:
            places += [*disc.position_m, *([0.0] * scene.arrays.turns)]
            speeds += [*disc.velocity_m_s, *([disc.spin_rad_s] * scene.arrays.turns)]
        if disc.immovable:
            continue
        x, y, vx, vy, turns = *disc.position_m, *disc.velocity_m_s, disc.inertia_factor < float("inf")
        # The joints are the same as in `_format_turning` and `build_mjcf`.
        free = settings["joints"] == "free" and (turns or not scene.arrays.turns)
        if free:
            places += [x, y, 0.0, 1.0, 0.0, 0.0, 0.0]
            speeds += [vx, vy, 0.0, 0.0, 0.0, disc.spin_rad_s]
        elif scene.arrays.turns:
            places += [x, y, 0.0, *([0.0] if turns else [])]
            speeds += [vx, vy, 0.0, *([disc.spin_rad_s] if turns else [])]
        else:
            places += [x, y]
            speeds += [vx, vy]
    if places:
        start = {"name": "start", "qpos": " ".join(map(repr, places)), "qvel": " ".join(map(repr, speeds))}
        ElementTree.SubElement(ElementTree.SubElement(model, "keyframe"), "key", start)
