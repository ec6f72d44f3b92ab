"""`make contact`: measures how discs slide, roll and rest in engines, for the tables of `docs/results/contact.md`.

The module runs every scene of the group `contact` with gravity and one infinite floor or slope, at 240 steps per
second. Each scene runs from eight initial states with slightly different speeds (by less than a fiftieth), and with
different heights if the disc is in the air or moves down. The rows of engines that are not installed do not change.
"""

from __future__ import annotations

import json
import math
from collections import defaultdict
from itertools import groupby
from pathlib import Path
from typing import Any

import carom
from carom.catalogue import find_scenes
from carom.engines.registry import load_adapter
from carom.execution.job import Method
from carom.execution.results import Row
from carom.model.scene import Disc, Scene, Wall
from carom.report.outcome_marks import Mark, mark_of

HERE = Path(__file__).resolve().parent
PAGE, FIGURES = HERE.parent / "results" / "contact.md", HERE / "contact.json"
DT_S, STARTS = 1 / 240, 8
PROFILES = ("default", "tuned", "resting")  # Only Box2D has the profile "resting".
#: The only measured scene without friction.
SMOOTH = "drop"

#: Results of an engine with a profile: for each scene, the largest error over all initial states.
Figure = dict[str, Any]


def started(scene: Scene, start: int) -> Scene:
    """Return a scene whose discs are faster, and higher if they are in the air or move down."""
    wall = scene.walls[0]
    if not isinstance(wall, Wall):
        raise TypeError(f"{scene.name} has a wall that is not a half-plane")
    (nx, ny), part = wall.normal, start / STARTS

    def moved(disc: Disc) -> Disc:
        (x, y), (vx, vy) = disc.position_m, disc.velocity_m_s
        up = (x - wall.point_m[0]) * nx + (y - wall.point_m[1]) * ny - disc.radius_m
        lift = 0.03 * part if up > 1e-9 or vx * nx + vy * ny < 0.0 else 0.0
        faster = 1.0 + 0.02 * part
        return disc.model_copy(
            update={
                "position_m": (x + lift * nx, y + lift * ny),
                "velocity_m_s": (faster * vx, faster * vy),
                "spin_rad_s": faster * disc.spin_rad_s,
            }
        )

    discs = tuple(moved(disc) for disc in scene.discs)
    return scene.model_copy(update={"name": f"{scene.name} {start}", "discs": discs})


def scenes_started() -> list[str]:
    """Return the scenes of the group with a single infinite floor or slope and a unique answer."""
    return [
        entry.name
        for entry in find_scenes(["contact"])
        if any(entry.scene.gravity_m_s2)
        and len(entry.scene.walls) == 1
        and isinstance(entry.scene.walls[0], Wall)
        and not entry.known.convention
    ]


def figure_of(engine: str, version: str, profile: str, rows: list[tuple[str, Row]]) -> Figure:
    """Return, for each scene, an engine's largest error over all initial states."""
    scenes: dict[str, Any] = {}
    for name, of_scene in groupby(sorted(rows, key=lambda row: row[0]), key=lambda row: row[0]):
        scored = [row.score for _, row in of_scene if row.score is not None]
        contacts = [score.contact for score in scored if score.contact is not None]
        if len(contacts) < STARTS:
            continue
        marks = {Mark[contact.grade.name] for contact in contacts}
        rests = [contact.rest_m_s for contact in contacts if not math.isnan(contact.rest_m_s)]
        momenta = [contact.momentum_m_s for contact in contacts if not math.isnan(contact.momentum_m_s)]
        scenes[name] = {
            "place_m": max(contact.errors.place_m for contact in contacts),
            "grades": sorted((mark.symbol for mark in marks), key=[mark.symbol for mark in Mark].index),
            "rest_m_s": max(rests, default=None),
            "momentum_m_s": max(momenta, default=None),
        }
    return {"engine": engine, "version": version, "profile": profile, "scenes": scenes}


def measured() -> list[Figure]:
    """Run every scene from every initial state on the installed engines."""
    names = scenes_started()
    bare = {f"{name} {start}": name.partition("/")[2] for name in names for start in range(STARTS)}
    scenes = [started(carom.scene(name), start) for name in names for start in range(STARTS)]
    results = carom.cross_check(scenes, profiles=PROFILES, dts=[DT_S], timing=False, jobs=1)
    found: dict[tuple[str, str], list[tuple[str, Row]]] = defaultdict(list)
    for row in results.rows:
        if mark_of(row) is not Mark.UNSUPPORTED and row.job.engine != "pic":
            found[row.job.engine, row.job.profile].append((bare[row.job.scene.name], row))
    versions = results.environment.versions
    figures = [
        figure_of(engine, versions.get(load_adapter(engine).engine.name, ""), profile, rows)
        for (engine, profile), rows in sorted(found.items())
    ]
    return [figure for figure in figures if figure["scenes"]]


def millimetres(value: float | None) -> str:
    """Format a length or a speed in thousandths, with two digits; a dash for None."""
    if value is None:
        return "-"
    return "0" if value < 1e-9 else f"{1000.0 * value:.2g}" if value < 0.1 else f"{1000.0 * value:.0f}"


def lines_of(heads: list[str], rows: list[list[str]]) -> str:
    """Return a table in Markdown."""
    lines = [heads, ["---"] * len(heads), *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def cell(known: Figure | None) -> str:
    """Return the grades and the largest position error of a scene; a dash if the engine can't run the scene."""
    return "-" if known is None else f"{''.join(known['grades'])} {millimetres(known['place_m'])}"


def table(figures: list[Figure]) -> str:
    """Return the table of scenes with friction: a row per engine and profile, and a column per scene."""
    rubs = [figure for figure in figures if set(figure["scenes"]) - {SMOOTH}]
    names = sorted({name for figure in rubs for name in figure["scenes"]} - {SMOOTH})
    return lines_of(["engine", *names], [[titled(f), *(cell(f["scenes"].get(name)) for name in names)] for f in rubs])


def smooth_table(figures: list[Figure]) -> str:
    """Return the table of the scene without friction, a scene that most engines can run."""
    smooth = [figure for figure in figures if SMOOTH in figure["scenes"]]
    return lines_of(["engine", SMOOTH], [[titled(figure), cell(figure["scenes"][SMOOTH])] for figure in smooth])


def rest_table(figures: list[Figure]) -> str:
    """Return the table of the greatest speed of discs that should be at rest, and of the error of angular momentum."""
    rows = []
    for figure in figures:
        scenes = figure["scenes"].values()
        rest = max((s["rest_m_s"] for s in scenes if s["rest_m_s"] is not None), default=None)
        momentum = max((s["momentum_m_s"] for s in scenes if s["momentum_m_s"] is not None), default=None)
        if rest is not None or momentum is not None:
            rows.append([titled(figure), millimetres(rest), millimetres(momentum)])
    return lines_of(["engine", "speed at rest, mm/s", "change of angular momentum, mm/s"], rows)


def titled(figure: Figure) -> str:
    """Return the name of a row: the engine, its release and the profile."""
    profile = Method(figure["engine"], figure["profile"]).profile_shown
    return " ".join(filter(None, (figure["engine"], figure["version"], f"`{profile}`" if profile else "")))


def filled(page: str, figures: list[Figure]) -> str:
    """Return the page with new tables.

    Raises:
        ValueError: The page does not have exactly one pair of marks for a table.
    """
    tables = {"places": table(figures), "smooth": smooth_table(figures), "rest": rest_table(figures)}
    for name, text in tables.items():
        begins, ends = f"<!-- {name}: make contact -->\n", f"<!-- end of {name} -->\n"
        if page.count(begins) != 1 or page.count(ends) != 1:
            raise ValueError(
                f"{PAGE.name} has {page.count(begins)} marks of the table {name}, but must have exactly one"
            )
        head, _, rest = page.partition(begins)
        page = head + begins + text + ends + rest.partition(ends)[2]
    return page


def main() -> None:
    """Measure, and write the figures and the page."""
    known = json.loads(FIGURES.read_text(encoding="utf-8")) if FIGURES.exists() else []
    kept = {(row["engine"], row["profile"]): row for row in known}
    kept |= {(row["engine"], row["profile"]): row for row in measured()}
    figures = [kept[key] for key in sorted(kept)]
    FIGURES.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")
    PAGE.write_text(filled(PAGE.read_text(encoding="utf-8"), figures), encoding="utf-8")


if __name__ == "__main__":
    main()
