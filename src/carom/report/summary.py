"""Short text of results, as printed in a Python session."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from itertools import islice
from typing import Any

from carom.comparator import Score
from carom.execution.results import Results
from carom.model.scene import Chain, Disc, Ring, Scene, Wall
from carom.model.trace import Trace, pair_name
from carom.report.certified import list_decimals
from carom.report.engine_and_scene_lists import format_engine_lines
from carom.report.outcome_marks import mark_of, mark_of_grade
from carom.solvers.certified.result import CertifiedTrace
from carom.support.formatting import format_count, format_number, format_seconds, format_step

#: Largest number of lines in the text of one result, and of characters in a line.
MOST_LINES, WIDTH = 8, 100
_NAME_WIDTH = 40


def summary(result: object) -> str:
    """Describe a scene, trace, score, certified trace or results in at most `MOST_LINES` lines of text.

    A line has at most `WIDTH` characters. A list of engines has one line per engine.
    """
    lines = next(_OF[kind.__name__] for kind in type(result).__mro__ if kind.__name__ in _OF)(result)
    return "\n".join(format_printable(line, WIDTH) for line in lines)


def format_printable(text: str, width: int) -> str:
    """Shorten text to one line of limited width, and escape unprintable characters."""
    line = "".join(letter if letter.isprintable() else ascii(letter)[1:-1] for letter in text)
    return line if len(line) <= width else f"{line[: width - 1]}…"


def _limit_lines(heading: Sequence[str], parts: Iterable[str], count: int) -> list[str]:
    """Return a heading, as many parts as fit, and a line with the number of omitted parts."""
    lines = [line for line in heading if line]
    room = MOST_LINES - len(lines)
    shown_parts = list(islice(parts, room if count <= room else room - 1))
    lines += [f"  {part}" for part in shown_parts]
    return lines if count <= len(shown_parts) else [*lines, f"  and {count - len(shown_parts)} more"]


def _format_number(value: float) -> str:
    return format_number(value, 6)


def _format_vector(vector: Sequence[float]) -> str:
    return f"({', '.join(map(_format_number, vector))})"


def _format_name(scene: Scene) -> str:
    return format_printable(repr(scene.name), _NAME_WIDTH)


def _format_scene(scene: Scene) -> list[str]:
    size = format_count(len(scene.discs), "disc")
    if scene.walls:
        size += f", {format_count(len(scene.walls), 'wall')}"
    laws = [f"restitution {_format_number(scene.restitution)}"]
    if scene.walls:
        laws.append(f"wall restitution {_format_number(scene.wall_restitution)}")
    rough = ["friction", "wall_friction", "tangential_restitution", "wall_tangential_restitution"]
    rough.append("wall_rolling_resistance")
    laws += [f"{name.replace('_', ' ')} {_format_number(value)}" for name in rough if (value := getattr(scene, name))]
    if any(scene.gravity_m_s2):
        laws.append(f"gravity {_format_vector(scene.gravity_m_s2)} m/s²")
    if scene.damping_per_s:
        laws.append(f"damping {_format_number(scene.damping_per_s)} /s")
    if scene.table_deceleration_m_s2:
        laws.append(f"table deceleration {_format_number(scene.table_deceleration_m_s2)} m/s²")
    heading = (
        f"Scene {_format_name(scene)}: {size}; {_format_number(scene.duration_s)} s at "
        f"{_format_number(scene.frame_rate_hz)} frames a second",
        f"  {', '.join(laws)}",
    )
    bodies = [f"disc {k}: {_format_disc(disc)}" for k, disc in enumerate(scene.discs[:MOST_LINES])]
    bodies += [f"wall {k}: {_format_wall(wall)}" for k, wall in enumerate(scene.walls[:MOST_LINES])]
    return _limit_lines(heading, bodies, len(scene.discs) + len(scene.walls))


def _format_disc(disc: Disc) -> str:
    mass = f"{_format_number(disc.mass_kg)} kg"
    if disc.immovable:
        mass = "driven" if disc.driven else "immovable"
    spin = f", spin {_format_number(disc.spin_rad_s)} rad/s" if disc.spin_rad_s else ""
    inertia = f", inertia factor {_format_number(disc.inertia_factor)}" if disc.inertia_factor != 0.5 else ""
    moves = f"at {_format_vector(disc.position_m)} m, {_format_velocity(disc)}{spin}"
    return f"{moves}, radius {_format_number(disc.radius_m)} m, {mass}{inertia}"


def _format_wall(wall: Wall | Chain | Ring) -> str:
    coefficients = [
        f", {name} {_format_number(value)}"
        for name in ("restitution", "friction")
        if (value := getattr(wall, name)) is not None
    ]
    drive = f", driven at {_format_velocity(wall)}" if wall.driven else ""
    belt = f", surface speed {_format_number(wall.surface_speed_m_s)} m/s" if wall.surface_speed_m_s else ""
    return f"{_format_shape(wall)}{drive}{belt}{''.join(coefficients)}"


def _format_velocity(body: Disc | Wall | Chain | Ring) -> str:
    first = f"{_format_vector(body.drive.velocity_at(0.0))} m/s"
    return f"{first} at first, in {format_count(len(body.legs), 'leg')}" if len(body.legs) > 1 else first


def _format_shape(wall: Wall | Chain | Ring) -> str:
    if isinstance(wall, Wall):
        return f"through {_format_vector(wall.point_m)} m, normal {_format_vector(wall.normal)} towards discs"
    width = f", half width {_format_number(wall.half_width_m)} m" if wall.half_width_m else ""
    if isinstance(wall, Ring):
        return f"a circle at {_format_vector(wall.centre_m)} m, radius {_format_number(wall.radius_m)} m{width}"
    edges = wall.outline.edges
    arcs = sum(edge.bulge != 0.0 for edge in edges)
    shape = f"{'solid ' if wall.solid else ''}{'closed ' if wall.closed else ''}chain"
    bent = f", {format_count(arcs, 'of them an arc', 'of them arcs')}" if arcs else ""
    return f"a {shape} of {format_count(len(edges), 'edge')}{bent}, from {_format_vector(wall.points_m[0])} m{width}"


def _format_trace(trace: Trace) -> list[str]:
    method = trace.method + (f" ({trace.profile_shown})" if trace.profile_shown else "")
    step_text = f" at {format_step(trace.dt_s)}" if trace.dt_s else ""
    heading = (
        f"Trace of {_format_name(trace.scene)} by {format_printable(method, _NAME_WIDTH)}{step_text}:"
        f" {format_count(len(trace.impacts), 'impact')}",
        f"  until {_format_number(trace.end_time_s)} s: {trace.outcome.value}",
        f"  warning: {'; '.join(trace.notes)}" if trace.notes else "",
    )
    impacts = (
        f"{_format_number(float(impact['time_s']))} s: {pair_name(impact)}, then at "
        f"{_format_vector(impact['velocity_first_after'])} and {_format_vector(impact['velocity_second_after'])} m/s"
        for impact in trace.impacts
    )
    return _limit_lines(heading, impacts, len(trace.impacts))


def _format_score(score: Score) -> list[str]:
    total, expected = score.total, format_count(score.expected, "impact")
    counts = f"{len(score.errors)} of {expected} found, {len(score.missed)} missed, {len(score.spurious)} invented"
    undecided = f", {len(score.undecided)} undecided" if score.undecided else ""
    beyond = f", {score.beyond_horizon} not compared" if score.beyond_horizon else ""
    spin = "" if math.isnan(total.spin) else f", spin {_format_number(total.spin)}"
    heading = (
        f"Score: {mark_of_grade(score.grade, score.float_bits).word}",
        f"  {counts}{undecided}{beyond}",
        f"  largest errors: velocity {_format_number(total.velocity)}{spin}, time {format_seconds(total.time_s)}, "
        f"final position {_format_number(total.final_position)}, energy {_format_number(total.energy)}",
        f"  error / PIT's: {_format_number(score.price_paid)}",
        _format_steps(score),
    )
    return _limit_lines(
        heading, (f"{finding.verdict.value} ({finding.reason})" for finding in score.findings), len(score.findings)
    )


def _format_steps(score: Score) -> str:
    """Return the score of the single steps as one line."""
    local = score.local_truth
    if local is None:
        return ""
    passed = f"{local.missed} missed ({local.missed_by_pit} of these also by PIT), {local.invented} invented"
    return f"  each step from the run's own state: {local.due} impacts due, {passed}, {local.early} early"


def _format_results(results: Results) -> list[str]:
    tally: dict[str, Counter[str]] = {}
    for row in results.rows:
        tally.setdefault(row.job.method.name, Counter())[mark_of(row).word] += 1
    scenes = len({row.job.scene.name for row in results.rows})
    heading = (
        f"Results: {format_count(len(results.rows), 'run')} of {format_count(scenes, 'scene')} by "
        f"{format_count(len(tally), 'method')}, in {format_seconds(results.elapsed_s)}",
    )
    methods = (
        f"{method}: {', '.join(f'{n} {became}' for became, n in counted.most_common())}"
        for method, counted in tally.items()
    )
    return _limit_lines(heading, methods, len(tally))


def _format_certified(certified: CertifiedTrace) -> list[str]:
    trace = certified.trace
    heading = (
        f"CertifiedTrace of {_format_name(trace.scene)}: {format_count(len(trace.impacts), 'impact')},"
        f" {certified.digits} digits requested",
        f"  until {_format_number(trace.end_time_s)} s: {certified.ending.value}",
        f"  {certified.degeneracy}" if certified.degeneracy else "",
    )
    impacts = (f"{list_decimals(certified, k)[0]} s: {pair_name(impact)}" for k, impact in enumerate(trace.impacts))
    return _limit_lines(heading, impacts, len(trace.impacts))


_OF: dict[str, Callable[[Any], list[str]]] = {
    "EngineList": format_engine_lines,
    "Scene": _format_scene,
    "Trace": _format_trace,
    "Score": _format_score,
    "Results": _format_results,
    "CertifiedTrace": _format_certified,
}
