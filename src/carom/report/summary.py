"""Short text of results, as printed in a Python session."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from itertools import islice
from typing import TYPE_CHECKING, Any

from carom.model.scene import Chain, Disc, Ring, Scene, Wall
from carom.model.trace import Trace, pair_name
from carom.report import formatting
from carom.report.engine_and_scene_lists import engine_lines
from carom.report.outcome_marks import mark_of, mark_of_grade
from carom.solvers.certified.result import proven_decimal

if TYPE_CHECKING:
    from carom.comparator import Score
    from carom.execution.results import Results
    from carom.solvers.certified.result import CertifiedTrace

#: Largest size of the text of one result, in lines and in characters.
MOST_LINES, WIDTH = 8, 100
_NAME_WIDTH = 40


def summary(thing: object) -> str:
    """Return a scene, trace, score, certified trace or results as a text of at most `MOST_LINES` lines of `WIDTH`.

    A list of engines has one line per engine.
    """
    lines = next(_OF[kind.__name__] for kind in type(thing).__mro__ if kind.__name__ in _OF)(thing)
    return "\n".join(printable(line, WIDTH) for line in lines)


def printable(text: str, width: int) -> str:
    """Return one line of text of limited width, with unprintable characters escaped."""
    line = "".join(letter if letter.isprintable() else ascii(letter)[1:-1] for letter in text)
    return line if len(line) <= width else f"{line[: width - 1]}…"


def _limited(heading: Sequence[str], parts: Iterable[str], count: int) -> list[str]:
    """Return a heading, as many parts as fit, and the number of omitted parts."""
    lines = [line for line in heading if line]
    room = MOST_LINES - len(lines)
    shown = list(islice(parts, room if count <= room else room - 1))
    lines += [f"  {part}" for part in shown]
    return lines if count <= len(shown) else [*lines, f"  and {count - len(shown)} more"]


def _n(value: float) -> str:
    return formatting.number(value, 6)


def _vector(vector: Sequence[float]) -> str:
    return f"({', '.join(map(_n, vector))})"


def _name(scene: Scene) -> str:
    return printable(repr(scene.name), _NAME_WIDTH)


def _of_scene(scene: Scene) -> list[str]:
    size = formatting.count(len(scene.discs), "disc")
    if scene.walls:
        size += f", {formatting.count(len(scene.walls), 'wall')}"
    laws = [f"restitution {_n(scene.restitution)}"]
    if scene.walls:
        laws.append(f"wall restitution {_n(scene.wall_restitution)}")
    rough = ["friction", "wall_friction", "tangential_restitution", "wall_tangential_restitution"]
    rough.append("wall_rolling_resistance")
    laws += [f"{name.replace('_', ' ')} {_n(value)}" for name in rough if (value := getattr(scene, name))]
    if any(scene.gravity_m_s2):
        laws.append(f"gravity {_vector(scene.gravity_m_s2)} m/s²")
    if scene.damping_per_s:
        laws.append(f"damping {_n(scene.damping_per_s)} /s")
    if scene.table_deceleration_m_s2:
        laws.append(f"table deceleration {_n(scene.table_deceleration_m_s2)} m/s²")
    heading = (
        f"Scene {_name(scene)}: {size}; {_n(scene.duration_s)} s at {_n(scene.frame_rate_hz)} frames a second",
        f"  {', '.join(laws)}",
    )
    bodies = [f"disc {k}: {_of_disc(disc)}" for k, disc in enumerate(scene.discs[:MOST_LINES])]
    bodies += [f"wall {k}: {_of_wall(wall)}" for k, wall in enumerate(scene.walls[:MOST_LINES])]
    return _limited(heading, bodies, len(scene.discs) + len(scene.walls))


def _of_disc(disc: Disc) -> str:
    mass = "driven" if disc.driven else "immovable" if disc.immovable else f"{_n(disc.mass_kg)} kg"
    spin = f", spin {_n(disc.spin_rad_s)} rad/s" if disc.spin_rad_s else ""
    inertia = f", inertia factor {_n(disc.inertia_factor)}" if disc.inertia_factor != 0.5 else ""
    moves = f"at {_vector(disc.position_m)} m, {_velocity(disc)}{spin}"
    return f"{moves}, radius {_n(disc.radius_m)} m, {mass}{inertia}"


def _of_wall(wall: Wall | Chain | Ring) -> str:
    own = [
        f", {name} {_n(value)}" for name in ("restitution", "friction") if (value := getattr(wall, name)) is not None
    ]
    drive = f", driven at {_velocity(wall)}" if wall.driven else ""
    belt = f", its surface at {_n(wall.surface_speed_m_s)} m/s" if wall.surface_speed_m_s else ""
    return f"{_shape_of(wall)}{drive}{belt}{''.join(own)}"


def _velocity(body: Disc | Wall | Chain | Ring) -> str:
    first = f"{_vector(body.drive.velocity_at(0.0))} m/s"
    return f"{first} at first, in {formatting.count(len(body.legs), 'leg')}" if len(body.legs) > 1 else first


def _shape_of(wall: Wall | Chain | Ring) -> str:
    if isinstance(wall, Wall):
        return f"through {_vector(wall.point_m)} m, free towards {_vector(wall.normal)}"
    width = f", half width {_n(wall.half_width_m)} m" if wall.half_width_m else ""
    if isinstance(wall, Ring):
        return f"a circle at {_vector(wall.centre_m)} m, radius {_n(wall.radius_m)} m{width}"
    edges = wall.outline.edges
    arcs = sum(edge.bulge != 0.0 for edge in edges)
    shape = f"{'solid ' if wall.solid else ''}{'closed ' if wall.closed else ''}chain"
    bent = f", {formatting.count(arcs, 'of them an arc', 'of them arcs')}" if arcs else ""
    return f"a {shape} of {formatting.count(len(edges), 'edge')}{bent}, from {_vector(wall.points_m[0])} m{width}"


def _of_trace(trace: Trace) -> list[str]:
    method = trace.method + (f" ({trace.profile_shown})" if trace.profile_shown else "")
    at = f" at {formatting.step(trace.dt_s)}" if trace.dt_s else ""
    heading = (
        f"Trace of {_name(trace.scene)} by {printable(method, _NAME_WIDTH)}{at}:"
        f" {formatting.count(len(trace.impacts), 'impact')}",
        f"  until {_n(trace.end_time_s)} s: {trace.outcome.value}",
        f"  warning: {'; '.join(trace.notes)}" if trace.notes else "",
    )
    impacts = (
        f"{_n(float(impact['time_s']))} s: {pair_name(impact)}, then at {_vector(impact['velocity_first_after'])}"
        f" and {_vector(impact['velocity_second_after'])} m/s"
        for impact in trace.impacts
    )
    return _limited(heading, impacts, len(trace.impacts))


def _of_score(score: Score) -> list[str]:
    total, expected = score.total, formatting.count(score.expected, "impact")
    found = f"{len(score.errors)} of {expected} found, {len(score.missed)} missed, {len(score.spurious)} invented"
    undecided = f", {len(score.undecided)} undecided" if score.undecided else ""
    beyond = f", {score.beyond_horizon} not compared" if score.beyond_horizon else ""
    spin = "" if math.isnan(total.spin) else f", spin {_n(total.spin)}"
    heading = (
        f"Score: {mark_of_grade(score.grade, score.float_bits).word}",
        f"  {found}{undecided}{beyond}",
        f"  largest errors: velocity {_n(total.velocity)}{spin}, time {formatting.seconds(total.time_s)}, final "
        f"position {_n(total.final_position)}, energy {_n(total.energy)}",
        f"  error / PIT's: {_n(score.price_paid)}",
        _of_steps(score),
    )
    return _limited(
        heading, (f"{found.verdict.value} ({found.reason})" for found in score.findings), len(score.findings)
    )


def _of_steps(score: Score) -> str:
    """Return the stepwise score of all steps in one line."""
    local = score.local_truth
    if local is None:
        return ""
    passed = f"{local.missed} missed (PIT {local.missed_by_pit} of these), {local.invented} invented"
    return f"  each step from the run's own state: {local.due} impacts due, {passed}, {local.early} early"


def _of_results(results: Results) -> list[str]:
    tally: dict[str, Counter[str]] = {}
    for row in results.rows:
        tally.setdefault(row.job.method.name, Counter())[mark_of(row).word] += 1
    scenes = len({row.job.scene.name for row in results.rows})
    heading = (
        f"Results: {formatting.count(len(results.rows), 'run')} of {formatting.count(scenes, 'scene')} by"
        f" {formatting.count(len(tally), 'method')}, in {formatting.seconds(results.elapsed_s)}",
    )
    methods = (
        f"{method}: {', '.join(f'{n} {became}' for became, n in counted.most_common())}"
        for method, counted in tally.items()
    )
    return _limited(heading, methods, len(tally))


def _of_certified(certified: CertifiedTrace) -> list[str]:
    trace = certified.trace
    heading = (
        f"CertifiedTrace of {_name(trace.scene)}: {formatting.count(len(trace.impacts), 'impact')},"
        f" {certified.digits} digits requested",
        f"  until {_n(trace.end_time_s)} s: {certified.ending.value}",
        f"  {certified.degeneracy}" if certified.degeneracy else "",
    )
    times = (
        certified.decimals[k][0]
        if certified.decimals
        else proven_decimal(float(trace.impacts["time_s"][k]), float(certified.radii["time_s"][k]))
        for k in range(len(trace.impacts))
    )
    impacts = (f"{time} s: {pair_name(impact)}" for time, impact in zip(times, trace.impacts, strict=True))
    return _limited(heading, impacts, len(trace.impacts))


_OF: dict[str, Callable[[Any], list[str]]] = {
    "EngineList": engine_lines,
    "Scene": _of_scene,
    "Trace": _of_trace,
    "Score": _of_score,
    "Results": _of_results,
    "CertifiedTrace": _of_certified,
}
