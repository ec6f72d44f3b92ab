"""`make walls`: tests thin walls, floors in pieces, ends and corners in engines, and writes `docs/results/walls.md`.

`walls_python.py` and `walls_npm.mjs` run flights of discs in the engines, without adapters, for each way to build a
wall. `walls.json` stores the figures. Run ``python docs/figures/walls.py [ENGINE...]`` (default: all engines). The rows
of engines that are not named or not installed do not change.
"""

from __future__ import annotations

import importlib.metadata
import importlib.util
import json
import math
import statistics
import subprocess
import sys
from pathlib import Path
from typing import Any, NamedTuple

HERE = Path(__file__).resolve().parent
PAGE, FIGURES = HERE.parent / "results" / "walls.md", HERE / "walls.json"
NPM = HERE.parents[1] / "adapters/carom_adapters/npm"

#: A row of figures: names of columns with values.
Row = dict[str, Any]
Flight = dict[str, Any]
End = list[float]


class Way(NamedTuple):
    """A way of building a wall in an engine."""

    engine: str
    package: str
    key: str
    words: str
    half_width_m: float = 0.0

    @property
    def rounded(self) -> bool:
        """Whether pieces of the wall end in half circles. The end of a box is flat."""
        return self.key.startswith("capsules")


#: Half the thickness of walls that consist of solid shapes, in metres.
HALF_M = 0.02

WAYS = (
    Way("Box2D", "Box2D", "edges", "edges"),
    Way("Box2D", "Box2D", "chain", "one chain"),
    Way("Box2D v3", "box2d3-wasm", "segments", "segments"),
    Way("Box2D v3", "box2d3-wasm", "chain", "one chain, with a ghost point at each end"),
    Way("cannon-es", "cannon-es", "boxes", "boxes", HALF_M),
    Way("DART", "dartpy", "boxes", "boxes", HALF_M),
    Way("DART", "dartpy", "capsules", "capsules", HALF_M),
    Way("Drake", "drake", "boxes", "boxes", HALF_M),
    Way("Drake", "drake", "capsules", "capsules", HALF_M),
    Way("Havok", "@babylonjs/havok", "boxes", "boxes", HALF_M),
    Way("Havok", "@babylonjs/havok", "capsules", "capsules", HALF_M),
    Way("Jolt", "jolt-physics", "boxes", "boxes", HALF_M),
    Way("Jolt", "jolt-physics", "boxes, cast", "boxes, the disc `LinearCast`", HALF_M),
    Way("Jolt", "jolt-physics", "compound, removal", "one compound, `mEnhancedInternalEdgeRemoval`", HALF_M),
    Way("matter.js", "matter-js", "rectangles", "rectangles", HALF_M),
    Way("MuJoCo", "mujoco", "boxes", "boxes", HALF_M),
    Way("MuJoCo", "mujoco", "capsules", "capsules", HALF_M),
    Way("Newton", "newton", "boxes", "boxes", HALF_M),
    Way("Newton", "newton", "boxes, ahead", "boxes, `speculative_contact_gap_max` 1 m", HALF_M),
    Way("Newton", "newton", "capsules", "capsules", HALF_M),
    Way("ODE", "panda3d", "boxes", "boxes", HALF_M),
    Way("ODE", "panda3d", "capsules", "capsules", HALF_M),
    Way("p2-es", "p2-es", "boxes", "boxes", HALF_M),
    Way("p2-es", "p2-es", "boxes, swept", "boxes, `ccdSpeedThreshold` 0", HALF_M),
    Way("p2-es", "p2-es", "lines", "lines"),
    Way("p2-es", "p2-es", "capsules", "capsules", HALF_M),
    Way("PhysX", "physx-js-webidl", "boxes", "boxes", HALF_M),
    Way("PhysX", "physx-js-webidl", "capsules", "capsules", HALF_M),
    Way("PhysX", "physx-js-webidl", "capsules, CCD", "capsules, `eENABLE_CCD`", HALF_M),
    Way("Planck", "planck", "edges", "edges"),
    Way("Planck", "planck", "chain", "one chain"),
    Way("PyBullet", "pybullet", "boxes", "boxes", HALF_M),
    Way("PyBullet", "pybullet", "capsules", "capsules", HALF_M),
    Way("PyBullet", "pybullet", "swept", "boxes, `ccdSweptSphereRadius` r/2", HALF_M),
    Way("PyBullet", "pybullet", "swept, maximal", "boxes, `ccdSweptSphereRadius` r/2, `useMaximalCoordinates`", HALF_M),
    Way("pymunk", "pymunk", "segments", "`Segment`"),
    Way("pymunk", "pymunk", "neighbours", "`Segment`, `set_neighbors`"),
    Way("Rapier 2D", "@dimforge/rapier2d-compat", "segments", "segments"),
    Way("Rapier 2D", "@dimforge/rapier2d-compat", "polyline", "one polyline"),
    Way("Rapier 2D", "@dimforge/rapier2d-compat", "boxes", "boxes", HALF_M),
    Way("Rapier", "rapier3d", "boxes", "boxes", HALF_M),
    Way("Rapier", "rapier3d", "capsules", "capsules", HALF_M),
)
#: Python packages, each with its module.
FROM_PYTHON = {
    "Box2D": "Box2D",
    "dartpy": "dartpy",
    "drake": "pydrake",
    "mujoco": "mujoco",
    "newton": "newton",
    "panda3d": "panda3d",
    "pybullet": "pybullet",
    "pymunk": "pymunk",
    "rapier3d": "rapier3d",
}

#: Thin walls: number of phases, radius of the disc, steps per second, and distances per step in *reaches*. A reach is
#: the sum of the disc's radius and the wall's half width.
THIN_PHASES, THIN_RADIUS_M, THIN_HZ = 32, 0.1, 60
SPEEDS = (0.9, 1.1, 1.5, 2.1, 3.0, 5.0, 20.0)
#: A bounce off a thin wall is wrong if its velocity error exceeds this fraction of the speed.
WRONG = 0.01

#: The floor: radius and speed of the disc, approach speeds, number of start positions along a metre, landing time.
FLOOR_RADIUS_M, ALONG_M_S, APPROACHES_M_S, PHASES, LANDS_S = 0.25, 5.0, (0.01, 0.5, 2.0), 16, 0.3
FLOOR_HZ = (60, 240)
#: Velocities count as different if they differ by more than this value. Rounding to 32-bit floats causes differences
#: of about 1e-6 m/s per step.
OTHER_M_S = 1e-3

#: Ends of walls: offsets of the disc's path, in reaches. Ends and corners: seconds until the impact.
OFFSETS, MEETS_S = (0.5, 0.95), 0.3


def at_a_thin_wall(q: float, phase: float, half_width_m: float) -> Flight:
    """Return a head-on flight of q reaches per step (a reach is the radius plus the wall's half width).

    The flight begins six steps and a fraction of a step before the wall.
    """
    reach = THIN_RADIUS_M + half_width_m
    step_m = q * reach
    return {
        "dt_s": 1 / THIN_HZ,
        "steps": 12,
        "position_m": [-reach - (6 + phase) * step_m, 0.0],
        "velocity_m_s": [step_m * THIN_HZ, 0.0],
        "radius_m": THIN_RADIUS_M,
        "points_m": [[0.0, -2.0], [0.0, 2.0]],
        "half_width_m": half_width_m,
    }


def along_a_floor(pieces: int, hz: int, approach_m_s: float, phase: float, half_width_m: float) -> Flight:
    """Return a flight of a second to a floor of ten metres that consists of pieces.

    The floor is shifted left by `phase` metres.
    """
    return {
        "dt_s": 1 / hz,
        "steps": hz,
        "position_m": [-3.0 - phase, FLOOR_RADIUS_M + half_width_m + LANDS_S * approach_m_s],
        "velocity_m_s": [ALONG_M_S, -approach_m_s],
        "radius_m": FLOOR_RADIUS_M,
        "points_m": [[-5.0 + 10.0 * k / pieces, 0.0] for k in range(pieces + 1)],
        "half_width_m": half_width_m,
    }


def at_an_end(offset: float, hz: int, phase: float, half_width_m: float, *, rounded: bool) -> Flight:
    """Return a flight that hits the end of a wall, off centre by a fraction of the reach.

    The end is a half circle of the half width, or the near corner of a flat end.
    """
    reach = FLOOR_RADIUS_M + half_width_m * rounded
    meets_m = -half_width_m * (not rounded) - reach * math.sqrt(1 - offset**2)
    return {
        "dt_s": 1 / hz,
        "steps": hz * 3 // 4,
        "position_m": [meets_m - ALONG_M_S * (MEETS_S + phase / hz), offset * reach],
        "velocity_m_s": [ALONG_M_S, 0.0],
        "radius_m": FLOOR_RADIUS_M,
        "points_m": [[0.0, -2.0], [0.0, 0.0]],
        "half_width_m": half_width_m,
    }


def into_a_corner(hz: int, phase: float, half_width_m: float) -> Flight:
    """Return a flight along the bisector of a corner of 90 degrees, which hits both sides at one instant."""
    component = ALONG_M_S * math.sqrt(0.5)
    start = FLOOR_RADIUS_M + half_width_m + component * (MEETS_S + phase / hz)
    return {
        "dt_s": 1 / hz,
        "steps": hz * 3 // 4,
        "position_m": [start, start],
        "velocity_m_s": [-component, -component],
        "radius_m": FLOOR_RADIUS_M,
        "points_m": [[0.0, 4.0], [0.0, 0.0], [4.0, 0.0]],
        "half_width_m": half_width_m,
    }


def command_of(way: Way) -> tuple[list[str], Path]:
    """Return the command that runs flights at this kind of wall, and its working folder."""
    if way.package in FROM_PYTHON:
        return [sys.executable, str(HERE / "walls_python.py"), way.package, way.key], HERE
    # If Node receives a program as text, the program finds the packages that are in the working folder.
    program = (HERE / "walls_npm.mjs").read_text(encoding="utf-8")
    return ["node", "--input-type=module", "--eval", program, way.package, way.key], NPM


def version_of(way: Way) -> str | None:
    """Return the version that is installed, or None."""
    if way.package in FROM_PYTHON:
        return importlib.metadata.version(way.package) if importlib.util.find_spec(FROM_PYTHON[way.package]) else None
    manifest = NPM / "node_modules" / way.package / "package.json"
    return str(json.loads(manifest.read_text(encoding="utf-8"))["version"]) if manifest.exists() else None


def flown(way: Way, flights: list[Flight]) -> list[End]:
    """Return the final states of the flights: x, y and velocity.

    Raises:
        RuntimeError: The engine fails, or a final state is not finite. The message names the engine.
    """
    command, folder = command_of(way)
    done = subprocess.run(  # noqa: S603 - the programs of this folder
        command, cwd=folder, input=json.dumps(flights), capture_output=True, text=True, check=False, timeout=300
    )
    if done.returncode:
        raise RuntimeError(f"{way.engine}, {way.words}: {done.stderr.strip()[-500:]}")
    ends: list[End] = json.loads(done.stdout[done.stdout.rindex("[[") :])
    if len(ends) != len(flights) or not all(
        len(end) == 4 and all(value is not None and math.isfinite(value) for value in end) for end in ends
    ):
        raise RuntimeError(f"{way.engine}, {way.words}: a flight has no end, or its end is not finite")
    return ends


def thin(way: Way) -> Row:
    """Return, for each speed, the number of phases at which a disc passes through, and the number of wrong bounces."""
    flights = [at_a_thin_wall(q, k / THIN_PHASES, way.half_width_m) for q in SPEEDS for k in range(THIN_PHASES)]
    ends = flown(way, flights)
    through = [end[0] > 0 for end in ends]
    wrong = 0
    for flight, end, passed in zip(flights, ends, through, strict=True):
        speed = flight["velocity_m_s"][0]
        wrong += not passed and math.hypot(end[2] + speed, end[3]) > WRONG * speed
    return {"through": [sum(through[k : k + THIN_PHASES]) for k in range(0, len(through), THIN_PHASES)], "wrong": wrong}


def seams(way: Way) -> Row:
    """Return, for each step rate, how many flights end differently on ten pieces than on one piece.

    The result also contains the largest difference, and the largest velocity error on one piece, for each rate.
    """
    row: Row = {"other": [], "worst_m_s": [], "one_piece_m_s": []}
    cases = [(approach, k / PHASES) for approach in APPROACHES_M_S for k in range(PHASES)]
    for hz in FLOOR_HZ:
        flights = [along_a_floor(n, hz, *case, way.half_width_m) for n in (1, 10) for case in cases]
        ends = flown(way, flights)
        one, ten = ends[: len(cases)], ends[len(cases) :]
        apart = [math.dist(a[2:], b[2:]) for a, b in zip(one, ten, strict=True)]
        exact = [(ALONG_M_S, approach) for approach, _ in cases]
        row["other"].append(sum(gap > OTHER_M_S for gap in apart))
        row["worst_m_s"].append(max(apart))
        row["one_piece_m_s"].append(max(math.dist(a[2:], b) for a, b in zip(one, exact, strict=True)))
    return row


def ends(way: Way) -> Row:
    """Return the median and largest direction error after hitting an end, in degrees, for each rate and offset."""
    row: Row = {"median_deg": [], "worst_deg": []}
    for hz in FLOOR_HZ:
        for offset in OFFSETS:
            of: Flight = {"half_width_m": way.half_width_m, "rounded": way.rounded}
            found = flown(way, [at_an_end(offset, hz, k / PHASES, **of) for k in range(PHASES)])
            exact = math.pi - 2 * math.asin(offset)  # angle from the direction of flight, away from the wall
            off = [abs(math.degrees(math.remainder(math.atan2(end[3], end[2]) - exact, math.tau))) for end in found]
            row["median_deg"].append(statistics.median(off))
            row["worst_deg"].append(max(off))
    return row


def corners(way: Way) -> Row:
    """Return, for each rate, the largest velocity error after a corner. The corner must reverse the velocity."""
    row: Row = {"worst_m_s": []}
    for hz in FLOOR_HZ:
        flights = [into_a_corner(hz, k / PHASES, way.half_width_m) for k in range(PHASES)]
        back = [-value for value in flights[0]["velocity_m_s"]]
        row["worst_m_s"].append(max(math.dist(end[2:], back) for end in flown(way, flights)))
    return row


def measured(way: Way) -> Row | None:
    """Return the figures of a kind of wall, or None if its engine is not installed."""
    version = version_of(way)
    if version is None:
        return None
    named = {"engine": way.engine, "version": version, "way": way.words, "half_width_m": way.half_width_m}
    return named | {"thin": thin(way), "seams": seams(way), "ends": ends(way), "corners": corners(way)}


def small(value: float) -> str:
    """Format a difference of velocities for a cell."""
    if value == 0:
        return "0"
    return f"{value:.2f}" if value >= 0.01 else f"{value:.0e}".replace("e-0", "e-")


def degrees(value: float) -> str:
    """Format an angle for a cell."""
    return f"{value:.0f}" if value >= 10 else f"{value:.1f}" if value >= 0.1 else small(value)


def lines_of(heads: list[str], rows: list[list[str]]) -> str:
    """Return a table in Markdown. From the third column on, cells are aligned to the right."""
    rule = ["---", "---"] + ["---:"] * (len(heads) - 2)
    return "".join(f"| {' | '.join(line)} |\n" for line in [heads, rule, *rows])


def thin_table(rows: list[Row]) -> str:
    """Return the table of thin walls. The first row contains the values of the formula."""
    exact = [f"{THIN_PHASES * max(0.0, 1 - 1 / q):.1f}" for q in SPEEDS]
    heads = ["engine", "wall", *(f"q = {q:g}" for q in SPEEDS), "wrong velocity"]
    body = [[row["engine"], row["way"], *map(str, row["thin"]["through"]), str(row["thin"]["wrong"])] for row in rows]
    return lines_of(heads, [["*32 max(0, 1 - 1/q)*", "", *exact, ""], *body])


def seam_table(rows: list[Row]) -> str:
    """Return the table of floors in pieces."""
    heads = [
        "engine",
        "floor",
        *(f"{hz} Hz: {what}" for hz in FLOOR_HZ for what in ("flights", "largest difference", "error on one piece")),
    ]
    body = []
    for row in rows:
        found = row["seams"]
        cells = zip(found["other"], found["worst_m_s"], found["one_piece_m_s"], strict=True)
        body.append([row["engine"], row["way"], *(cell for n, *two in cells for cell in (str(n), *map(small, two)))])
    return lines_of(heads, body)


def end_table(rows: list[Row]) -> str:
    """Return the table of ends and corners."""
    heads = [
        "engine",
        "wall",
        *(f"{hz} Hz: end, offset {offset:g} r" for hz in FLOOR_HZ for offset in OFFSETS),
        *(f"{hz} Hz: corner" for hz in FLOOR_HZ),
    ]
    body = []
    for row in rows:
        off = zip(row["ends"]["median_deg"], row["ends"]["worst_deg"], strict=True)
        cells = [
            *(f"{degrees(median)} / {degrees(worst)}" for median, worst in off),
            *map(small, row["corners"]["worst_m_s"]),
        ]
        body.append([row["engine"], row["way"], *cells])
    return lines_of(heads, body)


def versions(rows: list[Row]) -> str:
    """Return a sentence with the measured releases."""
    named = dict.fromkeys(f"{row['engine']} ({row['version']})" for row in rows)
    return f"\nMeasured: {', '.join(named)}.\n"


def filled(page: str, rows: list[Row]) -> str:
    """Return the page with the tables of these rows between its marks."""
    tables = {"thin": thin_table(rows), "seams": seam_table(rows), "ends": end_table(rows) + versions(rows)}
    for name, table in tables.items():
        begins, ends = f"<!-- made by docs/figures/walls.py: {name} -->\n", "<!-- end -->"
        if page.count(begins) != 1:
            raise ValueError(
                f"{PAGE.name} has {page.count(begins)} marks of the table {name}, but must have exactly one"
            )
        before, after = page.split(begins)
        page = before + begins + table + ends + after.split(ends, 1)[1]
    return page


def main() -> None:
    """Measure the installed engines, and write the figures and the page. The rows of other engines do not change."""
    kept = {(row["engine"], row["way"]): row for row in json.loads(FIGURES.read_text(encoding="utf-8"))}
    asked = sys.argv[1:] or {way.engine for way in WAYS}
    for way in (way for way in WAYS if way.engine in asked):
        row = measured(way)
        sys.stdout.write(f"{way.engine}, {way.words}: {'not installed, its row is kept' if row is None else row}\n")
        if row is not None:
            kept[way.engine, way.words] = row
    rows = [kept[way.engine, way.words] for way in WAYS if (way.engine, way.words) in kept]
    FIGURES.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    PAGE.write_text(filled(PAGE.read_text(encoding="utf-8"), rows), encoding="utf-8")


if __name__ == "__main__":
    main()
