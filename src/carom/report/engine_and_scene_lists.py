"""Lists of engines, scenes and groups of scenes, and the description of one engine."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from operator import itemgetter

from carom.catalogue import BugReport, CatalogueScene, all_scenes
from carom.engines.api import Capabilities, ContactTimes, Knob, Stamp
from carom.engines.registry import EngineInfo
from carom.report.document import Block, Column, Document, Facts, Lines, Media, Section, Table
from carom.support import formatting


def format_engine_lines(infos: Sequence[EngineInfo]) -> list[str]:
    """Return the lines of a table of engines."""
    rows = {info.name: _build_engine_row(info, info.capabilities) for info in infos if info.capabilities is not None}
    heading, *lines = _align_columns([("name", "version", "swept in", "friction", "spin", "floats"), *rows.values()])
    line_of = dict(zip(rows, lines, strict=True))
    # If an engine is unavailable, its adapter has no capabilities, and only the reason is shown.
    return [heading, *(line_of.get(info.name, f"{info.name}  unavailable: {info.unavailable}") for info in infos)]


def _build_engine_row(info: EngineInfo, capabilities: Capabilities) -> tuple[str, ...]:
    # The profile `tuned` has the adapter's general capabilities.
    kinds = {"tuned": capabilities, **info.own}
    return (
        info.name,
        info.version or "unavailable",
        ", ".join(name for name, one in kinds.items() if one.continuous_detection) or "no",
        "yes" if capabilities.friction[1] > 0 else "no",
        "yes" if capabilities.spin else "no",
        f"{capabilities.float_bits} bits",
    )


#: Topic of each group of scenes.
_GROUPS = {
    "paper": "scenes of the paper that defines PIC and PIT",
    "classics": "textbook collisions with known answers",
    "gravity": "falling discs",
    "issues": "bugs reported by users of engines",
    "spin": "friction and spin",
    "tables": "tables with straight and curved walls",
    "driven": "walls and discs that move at given velocities",
    "contact": "sliding, rolling and resting",
    "engines": "limits and known weaknesses of engines",
}


def format_group_lines(entries: Sequence[CatalogueScene]) -> list[str]:
    """Return a table of groups and how many scenes each contains, and a line with the commands that list scenes."""
    counts = Counter(entry.group for entry in entries)
    rows = [("group", "scenes", "content"), *((name, str(n), _GROUPS.get(name, "")) for name, n in counts.items())]
    commands = "List one group: carom scenes GROUP. List every scene: carom scenes --all."
    return [*_align_columns(rows, numbers=(1,)), "", commands]


def format_scene_lines(entries: Sequence[CatalogueScene]) -> list[str]:
    """Return a table of scenes. The last column contains descriptions, because terminals may cut off ends of lines."""
    rows = [("name", "discs", "impacts", "topic")]
    for entry in entries:
        count = entry.known.count
        rows.append((entry.name, str(len(entry.scene.discs)), "" if count is None else str(count), entry.shows))
    return _align_columns(rows, numbers=(1, 2))


def _align_columns(rows: Sequence[tuple[str, ...]], numbers: tuple[int, ...] = ()) -> list[str]:
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return [
        "  ".join(
            cell.rjust(width) if k in numbers else cell.ljust(width)
            for k, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in rows
    ]


def build_engine_document(info: EngineInfo) -> Document:
    """Return a document of everything that an adapter declares about its engine, and of the engine's reported bugs."""
    sections = [Section(info.name, (Facts(tuple(_list_facts(info)), only=Media.EVERYWHERE),))]
    if info.profiles:
        columns = (Column("profile", itemgetter(0)), Column("meaning", itemgetter(1)))
        sections.append(Section("Profiles", (Table(columns, list(info.profiles.items())),)))
    if info.knobs:
        columns = (Column("setting", itemgetter(0)), Column("range", lambda item: _format_range(item[1])))
        knobs = Table(columns, list(info.knobs.items()), note=f"To find the best values: carom tune {info.name}.")
        sections.append(Section("Settings that carom tune can change", (knobs,)))
    if info.capabilities is not None:
        sections.append(_build_capabilities({"value": info.capabilities, **info.own}))
    sections.append(_build_hazards(info))
    availability = f"has {formatting.format_count(len(info.profiles), 'profile')}"
    if info.unavailable:
        availability = f"is not available: {info.unavailable}"
    engine = " ".join(filter(None, (info.engine, info.version)))
    return Document(f"Carom: {info.name}", (f"{engine} {availability}.",), tuple(sections))


def _list_facts(info: EngineInfo) -> Iterator[tuple[str, str]]:
    facts = {
        "engine": f"{info.engine} {info.version}".rstrip(),
        "unavailable": info.unavailable,
        "install": info.install,
        "adapter": info.distribution,
        "settings to paste": f"carom engines {info.name} --show tuned" if info.code else "",
    }
    yield from ((name, value) for name, value in facts.items() if value)


#: Fields of `Capabilities` that are displayed, each with its displayed name and its unit.
_SAID = {
    "walls": ("walls", ""),
    "segments": ("walls of straight edges", ""),
    "arcs": ("walls of arcs and circles", ""),
    "posts": ("posts (circles hit from outside)", ""),
    "wall_materials": ("restitution or friction per wall", ""),
    "immovable_discs": ("immovable discs", ""),
    "driven_walls": ("driven walls", ""),
    "driven_discs": ("driven discs", ""),
    "legs": ("driven bodies whose velocity changes", ""),
    "belts": ("conveyor walls", ""),
    "edge_belts": ("conveyor edges and circles", ""),
    "gravity": ("gravity", ""),
    "damping": ("damping", ""),
    "rolling_resistance": ("rolling resistance", ""),
    "table_friction": ("table deceleration", ""),
    "spin": ("spin", ""),
    "restitution": ("restitution", ""),
    "restitution_threshold_m_s": ("impacts are inelastic up to", " m/s"),
    "friction": ("friction", ""),
    "tangential_restitution": ("tangential restitution", ""),
    "continuous_detection": ("continuous collision detection between discs", ""),
    "contact_times": ("contact times", ""),
    "stamp": ("contact time stamp", ""),
    "max_speed_m_s": ("greatest speed", " m/s"),
    "max_spin_rad_s": ("greatest spin", " rad/s"),
    "max_move_m": ("greatest displacement per step", " m"),
    "max_turn_rad": ("greatest rotation per step", " rad"),
    "min_radius_m": ("least radius", " m"),
    "max_radius_m": ("greatest radius", " m"),
    "min_mass_kg": ("least mass", " kg"),
    "max_mass_kg": ("greatest mass", " kg"),
    "max_coordinate_m": ("greatest distance from the origin", " m"),
    "min_inertia_factor": ("least inertia factor", ""),
    "float_bits": ("bits per float", ""),
    "dimensions": ("dimensions", ""),
    "deterministic": ("deterministic", ""),
}


def _build_capabilities(kinds: Mapping[str, Capabilities]) -> Section:
    """Return a table of capabilities, with a column for the engine and one for each profile that differs from it.

    Limits that no profile has are omitted.
    """
    rows = []
    for name, (word, unit) in _SAID.items():
        values = [getattr(capabilities, name) for capabilities in kinds.values()]
        if all(value in (math.inf, 0.0) and not isinstance(value, bool) for value in values):
            continue  # no limit
        rows.append((word, *(_format_value(value, unit) for value in values)))

    columns = [Column(head, itemgetter(k)) for k, head in enumerate(("capability", *kinds))]
    return Section("Capabilities", (Table(columns, rows),))


def _format_value(value: object, unit: str) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, ContactTimes | Stamp):
        return str(value.value)
    if isinstance(value, tuple):
        low, high = value
        return f"{low:g}" if low == high else f"{low:g} to {high:g}"
    return "no limit" if value == math.inf else f"{value:g}{unit}"


def _format_range(knob: Knob) -> str:
    if knob.choices:
        return ", ".join(map(str, knob.choices))
    return f"{knob.low:g} to {knob.high:g}"


def _build_hazards(info: EngineInfo) -> Section:
    """Return the reported bugs of an engine, each with a scene that reproduces it."""
    found = [entry for entry in all_scenes().values() if isinstance(entry, BugReport) and entry.engine == info.name]
    blocks: list[Block] = []
    if found:
        columns = (Column("scene", lambda entry: entry.name), Column("what was reported", lambda entry: entry.summary))
        blocks.append(Table(columns, found, note=f"To check your version: carom run SCENE -e {info.name}."))
    measured = "Measured hazards: docs/results/hazards.md."
    blocks.append(Lines((measured,) if found else (f"No bug report in the catalogue. {measured}",)))
    return Section("Known hazards", tuple(blocks))
