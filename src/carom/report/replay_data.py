"""Data with which a page animates a run next to its reference, and explains each impact.

The data of a scene and of all its runs are one packed JSON block. The page's script unpacks the block when a reader
opens one of the runs.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import tomli_w

from carom.comparator import Score
from carom.execution.job import Job
from carom.execution.results import Row
from carom.model.scene import Chain, Need, Ring, Scene, Wall
from carom.model.trace import Mode, Trace, format_setting
from carom.report.impact_rows import NEAR_STEPS, Json, build_impact_rows
from carom.report.outcome_marks import mark_of
from carom.report.picture import ARC_PARTS
from carom.report.provenance import format_command
from carom.report.results_file.lines import build_line, list_reasons
from carom.report.tracks import (
    Track,
    build_observed_tracks,
    build_reference_tracks,
    compute_extent,
    compute_turnings,
    list_flight_pulls,
)
from carom.support import formatting
from carom.support.escaping import escape_controls

#: Number of stored decimal digits of positions, relative to the scene's extent. One unit of the last digit is a tenth
#: of the largest error of a drawn path.
_SHARP = 6
#: Largest error of a drawn path while a disc slides, rolls or rests, divided by the scene's extent. The error is a
#: hundredth of a pixel in a picture of a hundred pixels. The path is drawn as many pieces of constant acceleration.
_NEAR_IN_CONTACT = 1e-4

_MODES = {
    Mode.FLIGHT: "flies",
    Mode.SLIDE: "slides",
    Mode.ROLL: "rolls",
    Mode.REST: "rests",
    Mode.BLOCK: "slides without turning",
}

#: Largest number of discs on the play page. A replay of a scene with more discs does not show a `carom play` command.
_MOST_THROWN = 10


def format_run_command(scene: str, job: Job) -> str:
    """Return the command that repeats a job. `scene` is the name or file of the scene."""
    overrides = (word for name, value in job.method.overrides for word in ("--set", f"{name}={format_setting(value)}"))
    return format_command(("run", scene), job.method, *overrides, "--dt", repr(job.dt_s))


def describe_run(row: Row, engine: str, key: str, command: str) -> Json:
    """Describe a run for its replay: method, outcome, verdicts, and the command that repeats the run."""
    mark = mark_of(row)
    return {
        "engine": engine,
        "profile": row.job.method.profile_shown,
        "key": key,
        "word": mark.word,
        "symbol": mark.symbol,
        "css": mark.css,
        "said": [formatting.capitalise(reason) + "." for reason in list_reasons(build_line(row))],
        "command": command,
    }


def build_replay_data(reference: Trace, runs: Iterable[tuple[Trace, Score, Mapping[str, Any]]]) -> Json:
    """Return a scene, its reference and its runs as plain data.

    Args:
        reference: The reference trace.
        runs: Each run with its score and its description.
    """
    scene, extent_m = reference.scene, compute_extent(reference)
    places = _SHARP - math.floor(math.log10(extent_m))
    contact_points = list(list_contact_points(reference))
    return {
        **_build_scene(scene),
        "reference": [
            _build_track(track.convert_to_pull(pull, _NEAR_IN_CONTACT * extent_m), None)
            for track, pull in zip(build_reference_tracks(reference), list_flight_pulls(scene), strict=True)
        ],
        "turned": _build_turnings(reference),
        "modes": _build_modes(reference),
        "impacts": [
            [float(impact["time_s"]), int(impact["first"]), int(impact["second"])] for impact in reference.impacts
        ],
        "meetings": [
            [round(x, places), round(y, places), None if overlap_s is None else float(f"{overlap_s:.6g}")]
            for x, y, overlap_s in contact_points
        ],
        "runs": [
            {**description, **_build_run(reference, contact_points, trace, score, extent_m, places)}
            for trace, score, description in runs
        ],
    }


def _build_run(
    reference: Trace, contact_points: Sequence[ContactPoint], trace: Trace, score: Score, extent_m: float, places: int
) -> Json:
    return {
        "dt": trace.dt_s or 1.0 / trace.scene.frame_rate_hz,
        "sampled": trace.dt_s > 0.0,
        "end": trace.end_time_s,
        "tracks": [_build_track(track, places) for track in build_observed_tracks(trace, extent_m)],
        "turned": _build_turnings(trace),
        "modes": _build_modes(trace),
        "sampler": _build_sampler(reference, trace),
        **_build_impacts(reference, contact_points, trace, score),
        "settings": {name: formatting.format_setting(value) for name, value in trace.settings.items()},
    }


def _build_sampler(reference: Trace, trace: Trace) -> Json | None:
    """Return data with which the page runs PIT at other step sizes; None if the method or the scene does not allow it.

    The page can run scenes of two discs without walls, in which the discs fly straight and have a single impact without
    friction.
    """
    scene = trace.scene
    curved = {Need.GRAVITY, Need.DAMPING, Need.TABLE_FRICTION, Need.DRIVEN_DISCS}
    rough = {Need.FRICTION, Need.TANGENTIAL_RESTITUTION}
    plain = not (scene.walls or scene.needs & (curved | rough))
    if trace.method != "pit" or len(scene.discs) != 2 or len(reference.impacts) != 1 or not plain:
        return None
    sampled: Json = scene.model_dump(mode="json", exclude={"name", "description"})
    return sampled


class ContactPoint(NamedTuple):
    """The contact point of an impact, and how long the bodies would overlap without the impact.

    Attributes:
        x_m: The x coordinate of the contact point.
        y_m: The y coordinate of the contact point.
        overlap_s: How long the bodies would overlap, in seconds. In the first half of this time, the bodies approach.
            None for impacts on walls, for scenes that slow discs down, and if gravity accelerates only one of the two
            discs.
    """

    x_m: float
    y_m: float
    overlap_s: float | None


def list_contact_points(reference: Trace) -> Iterator[ContactPoint]:
    """Yield the contact point of each impact, and how long its bodies would overlap without the impact."""
    scene, tracks = reference.scene, build_reference_tracks(reference)
    for impact in reference.impacts:
        first, second = int(impact["first"]), int(impact["second"])
        one, normal = scene.discs[first], impact["normal"]
        x, y = tracks[first].positions_at(impact["time_s"][None])[0] + one.radius_m * normal
        yield ContactPoint(float(x), float(y), _compute_overlap_time(scene, impact, first, second))


def _compute_overlap_time(scene: Scene, impact: np.void, first: int, second: int) -> float | None:
    if second < 0:
        return None
    one, other = scene.discs[first], scene.discs[second]
    slowed = scene.damping_per_s or scene.table_deceleration_m_s2
    if slowed or (any(scene.gravity_m_s2) and one.immovable != other.immovable):
        return None
    passing = impact["velocity_second_before"] - impact["velocity_first_before"]
    speed = math.hypot(*passing.tolist())
    inwards = abs(float(impact["normal"] @ passing))
    overlap_s = 2.0 * (inwards / speed) * ((one.radius_m + other.radius_m) / speed) if speed > 0.0 else math.inf
    return overlap_s if math.isfinite(overlap_s) else None


def _build_impacts(reference: Trace, contact_points: Sequence[ContactPoint], trace: Trace, score: Score) -> Json:
    rows = list(build_impact_rows(reference, trace, score))
    k = find_first_fault(rows)
    if k is None:
        return {"impacts": rows, "fault": None}
    meeting = rows[k].get("at")
    overlap_s = None if meeting is None else contact_points[meeting].overlap_s
    description, moment_s = _describe_fault(rows[k], overlap_s, trace.dt_s), find_pause_time(rows[k], overlap_s, trace)
    return {"impacts": rows, "fault": {"row": k, "said": description, "moment": moment_s}}


def find_pause_time(row: Json, overlap_s: float | None, trace: Trace) -> float:
    """Return the time at which a replay pauses to show a fault, in seconds.

    The replay pauses at the time that the run reports or, for a missed impact, when the miss is most visible.

    A miss is most visible in the middle of the overlap, when the bodies overlap most. But the pause is at most one step
    after the exact impact, because PIT never misses bodies that overlap and approach for longer than a step.
    """
    if row.get("reported") is not None:
        return float(row["reported"])
    dt_s = trace.dt_s or 1.0 / trace.scene.frame_rate_hz
    return float(min(row["true"] + min(overlap_s or 0.0, NEAR_STEPS * dt_s) / 2.0, trace.scene.duration_s))


def find_first_fault(rows: list[Json]) -> int | None:
    """Return the index of the impact at which a replay pauses: the first missed or invented impact.

    If there is none, return the late or early impact with the largest velocity error, because the error of the first
    one may be hardly visible. Return None if no impact is missed, invented, late or early.
    """
    for k, row in enumerate(rows):
        if row["flag"] == "missed" or (row["flag"] == "invented" and row["reported"] is not None):
            return k
    inexact_rows = [k for k, row in enumerate(rows) if row["flag"] in {"late", "early"}]
    return max(inexact_rows, key=lambda k: rows[k]["velocity"] or 0.0, default=None)


def _describe_fault(row: Json, overlap_s: float | None, dt_s: float) -> str:
    why = f" ({row['cause']})" if row["cause"] else ""
    became = f"{row['became']}{why}."
    if overlap_s is None or not dt_s:
        return f"{formatting.capitalise(row['pair'])}: {became}"
    approach = f"overlap and approach each other for {formatting.format_number(500.0 * overlap_s, 3)} ms"
    step = f"a step lasts {formatting.format_number(1000.0 * dt_s, 3)} ms"
    return f"{formatting.capitalise(row['pair'])} {approach}, and {step}: {became}"


def _build_scene(scene: Scene) -> Json:
    is_playable = len(scene.discs) <= _MOST_THROWN and not scene.table_deceleration_m_s2
    return {
        "name": escape_controls(scene.name),
        "description": scene.description,
        "duration": scene.duration_s,
        "frame": 1.0 / scene.frame_rate_hz,
        "gravity": list(scene.gravity_m_s2),
        "discs": [[disc.radius_m, disc.immovable] for disc in scene.discs],
        "walls": [_build_wall(wall) for wall in scene.walls],
        "thrown": "carom play scene.toml" if is_playable else "",
        "file": tomli_w.dumps(scene.model_dump(mode="python")),
    }


def _build_wall(wall: Wall | Chain | Ring) -> list[float] | Json:
    moves = {"legs": [[leg.begin_s, *leg.moved, *leg.velocity] for leg in wall.drive.legs]} if wall.driven else {}
    if isinstance(wall, Wall):
        plane = [*wall.point_m, *wall.normal]
        return {"plane": plane, **moves} if moves else plane
    line = [list(point) for point in wall.outline.build_polyline(ARC_PARTS)]
    return {"line": line, "half_width": wall.half_width_m, **moves}


def _build_track(track: Track, places: int | None) -> list[list[float]]:
    columns = (track.time_s, *track.position_m.T)
    if places is None:
        return [column.tolist() for column in columns]
    # NumPy's rounding is not used, because it first multiplies, and a large number would overflow.
    return [columns[0].tolist(), *([round(value, places) for value in column.tolist()] for column in columns[1:])]


def _build_turnings(trace: Trace) -> list[list[list[float]]]:
    return [[turning.time_s.tolist(), turning.angle_rad.tolist()] for turning in compute_turnings(trace)]


def _build_modes(trace: Trace) -> list[tuple[int, list[tuple[float, str]]]]:
    """Return each disc with lasting contact, and the times at which the disc begins to fly, slide, roll or rest."""
    if trace.modes is None:
        return []
    changes: dict[int, list[tuple[float, str]]] = {}
    for mode in trace.modes:
        of_disc = changes.setdefault(int(mode["disc"]), [(0.0, _MODES[Mode(mode["before"])])])
        if float(mode["time_s"]) == of_disc[-1][0]:  # omit states without a duration
            of_disc.pop()
        of_disc.append((float(mode["time_s"]), _MODES[Mode(mode["after"])]))
    return [(disc, [*of_disc, (trace.end_time_s, "")]) for disc, of_disc in sorted(changes.items())]
