"""Tables of the engines' pages from the results of `make atlas`: `docs/figures/measured.json`.

It reads `results.jsonl` of a cross-check of all scenes with all engines, of one of a few scenes that was timed,
`stress.json` of a stress campaign, and the figures over many starts of `make hazards`. Every number of these tables is
reduced from them here; what is not finite is null there, and left out. `engine_pages.py` puts them into the pages.
`atlas.py --alone REPORT HAZARDS` takes up engines that were measured after that, alone: into their own tables, and
into none of those that rank all.
"""

from __future__ import annotations

import json
import math
import statistics
import sys
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from carom.catalogue import all_scenes
from carom.comparator.thresholds import THRESHOLDS
from carom.model.trace import profile_shown
from carom.report.document import Column, Table
from carom.report.formatting import number, percent
from carom.report.results_file.file import raw_records

ROOT = Path(__file__).resolve().parents[2]
MEASURED = ROOT / "docs" / "figures" / "measured.json"

#: The best grade first.
GRADES = ("exact", "close", "sampled", "inaccurate", "parted", "parted inaccurate", "wrong")
#: Carom's own methods: what engines are compared with, and nothing to choose.
OWN = ("pic", "pit")
#: Profiles that no program can paste: their steps are cut by Carom.
CUT = ("located",)
#: Profiles that give a disc another shape: what they find is no answer for who has spheres.
RESHAPED = ("cylinder", "cylinder-plain")
#: Attacks of the stress campaign that the atlas tells of, with the heading of their column.
ATTACKS = {
    "tunnelling": "passes through discs from speed x dt / radius",
    "slow": "slow impacts do not bounce below, m/s",
    "mass-ratio": "mass ratio",
    "grazing": "misses grazes from 1 - b/R",
    "duration": "number of impacts before errors grow too large",
}
RIGHT_ANGLE = math.degrees(1.0)
#: Chaotic within the run: what one start gives is one of many figures, so that it is shown as a range over starts.
CHAOTIC = "engines/gas-of-25"

Row = dict[str, Any]


@dataclass(frozen=True)
class Method:
    """An engine with a profile, and its rows.

    Attributes:
        engine: Name of the adapter.
        profile: Name of the profile.
        rows: All its rows.
        ratio: Run time over PIT's at the same step, median over the scenes that were timed; None where none was.
        gas: Its figures over many starts of the scene `CHAOTIC`; None where there are none.
    """

    engine: str
    profile: str
    rows: tuple[Row, ...]
    ratio: float | None
    gas: Row | None = None

    @property
    def name(self) -> str:
        """The name shown."""
        return f"{self.engine} {profile_shown(self.engine, self.profile, {})}".rstrip()

    @property
    def coarse(self) -> list[Row]:
        """Rows at each scene's own frame rate."""
        return [row for row in self.rows if row["refinement"] == 0]


@dataclass(frozen=True)
class Need:
    """Something that a user needs.

    Attributes:
        what: The need, in the user's words.
        scenes: Patterns of the names of the scenes that show it.
        met: Whether a row meets it.
    """

    what: str
    scenes: Callable[[str], bool]
    met: Callable[[Row], bool]


def _of(*names: str) -> Callable[[str], bool]:
    return lambda scene: scene.startswith(names)


def _fast(scene: str) -> bool:
    return "fast" in all_scenes()[scene].tags and "no-impact" not in all_scenes()[scene].tags


def _whole(row: Row) -> bool:
    return not row["missed"] and not row["spurious"]


def _within(kind: str, limit: float) -> Callable[[Row], bool]:
    return lambda row: _whole(row) and row["total"][kind] is not None and abs(row["total"][kind]) <= limit


NEEDS = (
    Need(
        "times and velocities right except for rounding", _of("paper", "classics"), lambda row: row["grade"] == "exact"
    ),
    Need("directions right to one degree", _of("paper", "classics"), _within("direction_rad", math.radians(1.0))),
    Need("no fast disc passes through another", _fast, _whole),
    Need(
        "slow impacts bounce, with errors of at most 1 % of the speed",
        _of("engines/slow", "engines/crawl"),
        _within("velocity", 0.01),
    ),
    Need("no impact is invented", _of("classics/miss", "engines/near-miss"), _whole),
    Need(
        "energy of many discs right to one in a million",
        _of("classics/gas", "engines/gas-of-25"),
        lambda row: _kept(row, 1e-6),
    ),
    Need("balls that fall and bounce", _of("gravity"), lambda row: row["grade"] in {"exact", "close", "sampled"}),
)


def _kept(row: Row, limit: float) -> bool:
    return row["total"] is not None and row["total"]["energy"] is not None and abs(row["total"]["energy"]) <= limit


def methods_of(rows: Sequence[Row], timed: Sequence[Row], hazards: Sequence[Row] = ()) -> list[Method]:
    """Return the methods in the order of the rows, Carom's own among them."""
    gas = {(row["engine"], row["profile"]): row for row in hazards if row["table"] == "gas" and "refused" not in row}
    own: dict[tuple[str, str], list[Row]] = {}
    ratios: dict[tuple[str, str], list[float]] = {}
    for row in rows:
        own.setdefault((row["engine"], row["profile"]), []).append(row)
    for row in timed:
        if row["time_ratio"] is not None:
            ratios.setdefault((row["engine"], row["profile"]), []).append(row["time_ratio"])
    return [
        Method(*name, tuple(of), statistics.median(ratios[name]) if name in ratios else None, gas.get(name))
        for name, of in own.items()
    ]


def _numbers(rows: Sequence[Row], value: Callable[[Row], float | None]) -> list[float]:
    """Return a number of the rows that found every impact, without nulls, which are numbers that are not finite."""
    said = (value(row) for row in rows if row["total"] is not None)
    return [one for one in said if one is not None]


def _spread(values: Sequence[float], say: Callable[[float], str] = number) -> str:
    """Return median and largest."""
    return f"{say(statistics.median(values))}, at most {say(max(values))}" if values else "-"


def grades(method: Method) -> str:
    """Return the numbers of scenes by grade at their own frame rate."""
    tally = Counter(row["grade"] if row["status"] == "ran" else row["status"] for row in method.coarse)
    named = {grade: grade.replace(" ", "_") for grade in GRADES}
    known = [f"{tally.pop(name)} {grade}" for grade, name in named.items() if tally[name]]
    return ", ".join(known + [f"{n} {word.replace('_', ' ')}" for word, n in tally.items() if n])


def _total(kind: str, over: Callable[[Row], float] = lambda _: 1.0) -> Callable[[Row], float | None]:
    def value(row: Row) -> float | None:
        said = row["total"][kind]
        return None if said is None else abs(said) / over(row)

    return value


def _conserves(row: Row) -> bool:
    scene = all_scenes()[row["scene"]].scene
    return not any(scene.gravity_m_s2) and scene.restitution == 1.0 == scene.wall_restitution


def energy(method: Method) -> str:
    """Return the largest loss and gain in a scene that keeps its energy and is not chaotic, as parts of the start's."""
    kept = [row for row in method.coarse if _conserves(row) and row["scene"] != CHAOTIC]
    change = _numbers(kept, lambda row: row["total"]["energy"])
    lost, gained = -min(change, default=0.0), max(change, default=0.0)
    return f"{percent(max(lost, 0.0))} lost, {percent(max(gained, 0.0))} made" if change else "-"


def gas(method: Method) -> str:
    """Return by which part the energy of a gas changes, over many starts of it."""
    if method.gas is None:
        return "-"
    return f"{percent(method.gas['least'])} to {percent(method.gas['most'])} in {method.gas['starts']} starts"


def impacts(method: Method) -> str:
    """Return the numbers of missed and invented impacts."""
    scored = [row for row in method.coarse if row["missed"] is not None]
    return f"{sum(len(row['missed']) for row in scored)} / {sum(len(row['spurious']) for row in scored)}"


def speed(method: Method) -> str:
    """Return the run time over PIT's."""
    return "-" if method.ratio is None else f"{number(method.ratio)} x"


def breaking(stress: dict[str, Any], attack: str, method: Method) -> str:
    """Return the size at which a method fails a stress test of the campaign."""
    lines = {line["name"]: line for line in stress["lines"]}
    columns = [(one["engine"], one["profile"]) for one in stress["methods"]]
    if attack not in lines or (method.engine, method.profile) not in columns:
        return "-"
    cell = lines[attack]["cells"][columns.index((method.engine, method.profile))]
    value = "" if cell["value"] is None else number(cell["value"])
    said = {"gives_way": value, "stands": f"passes to {value}", "never_stood": f"from {value}"}
    return said.get(cell["ending"]) or str(cell["reason"]).partition(":")[0]


def choices(need: Need, methods: Sequence[Method]) -> list[str]:
    """Return in words, the best first, of each engine the method and step that meet a need in the most scenes.

    Among equals the coarsest step comes first, then the least run time over PIT's.
    """
    found: dict[str, tuple[tuple[float, ...], str]] = {}
    for method in methods:
        for refinement in sorted({row["refinement"] for row in method.rows}):
            rows = [row for row in method.rows if row["refinement"] == refinement and need.scenes(row["scene"])]
            if not rows:
                continue
            met = sum(row["status"] == "ran" and row["total"] is not None and need.met(row) for row in rows)
            rank = (-met, refinement, math.inf if method.ratio is None else method.ratio)
            part = f"1/{4**refinement} frame" if refinement else "1 frame"
            said = f"{method.name}, {part}: {met} of {len(rows)}, {speed(method)}"
            if met and (method.engine not in found or rank < found[method.engine][0]):
                found[method.engine] = (rank, said)
    return [said for _, said in sorted(found.values())]


def best(methods: Sequence[Method]) -> Method | None:
    """Return the profile of an engine to paste: the fewest scenes wrong, then the most exact, close and sampled ones.

    Among equals one that somebody tuned comes before what is shipped; None where each is cut or reshaped.
    """

    def rank(method: Method) -> tuple[int | bool, ...]:
        tally = Counter(row["grade"] for row in method.coarse)
        return (tally["wrong"], *(-tally[grade] for grade in GRADES[:3]), method.profile == "default")

    pasted = [method for method in methods if method.profile not in (*CUT, *RESHAPED)]
    return min(pasted, key=rank) if pasted else None


def settings(method: Method) -> str:
    """Return the settings that a profile used everywhere, and those that depend on the scene, as a table of TOML."""
    used = [row["settings"] for row in method.coarse if row["settings"]]
    names = dict.fromkeys(name for one in used for name in one if name != "dt_s")
    values = {name: {json.dumps(one[name]) for one in used if name in one} for name in names}
    return "\n".join(
        f"{name} = {next(iter(said))}" if len(said) == 1 else f"# {name} depends on the scene and the step"
        for name, said in values.items()
    )


def measured(
    head: dict[str, Any],
    rows: Sequence[Row],
    timed: Sequence[Row],
    stress: dict[str, Any],
    hazards: Sequence[Row],
    commands: Sequence[str],
    timed_on: str = "",
) -> dict[str, Any]:
    """Return the tables as data, with what was measured when.

    The commands are those of the cross-check, of the one that was timed, and of the campaign.
    """
    return tables_of(methods_of(rows, timed, hazards), stress) | {
        "measured": {
            name: head["environment"][name] for name in ("date", "carom", "python", "processor", "system", "versions")
        }
        | {"timed": timed_on or head["environment"]["date"][:10], "scenes": len(head["scenes"])},
        "commands": list(commands),
    }


def with_alone(known: dict[str, Any], head: dict[str, Any], rows: Sequence[Row], hazards: Sequence[Row]) -> None:
    """Put engines into the data that were measured without the others: into tables of their own, and when that was."""
    here = head["environment"]
    methods = [one for one in methods_of(rows, (), hazards) if one.engine not in OWN]
    versions = {name: version for name, version in here["versions"].items() if name != "numpy"}
    known["engines"] |= tables_of(methods, {"lines": [], "methods": []})["engines"]
    known["alone"] = known.get("alone", {}) | dict.fromkeys(
        (f"{name} {version}" for name, version in versions.items()),
        f"{here['date'][:10]} on {len(head['scenes'])} scenes",
    )


def tables_of(methods: Sequence[Method], stress: dict[str, Any]) -> dict[str, Any]:
    """Return all tables: which engine for which need, a crowd, where each fails, and an engine's own."""
    engines: dict[str, list[Method]] = {}
    for method in methods:
        if method.engine not in OWN:
            engines.setdefault(method.engine, []).append(method)
    return {
        "needs": data(_needs(methods)),
        "crowd": data(crowd_table(methods)),
        "limits": data(_limits(stress, methods)),
        "engines": {engine: _engine(own) for engine, own in engines.items()},
    }


def data(table: Table) -> dict[str, Any]:
    """Return a table as data: headings, rows of texts, and what is said under it."""
    return {
        "heads": [column.line for column in table.columns],
        "rows": [[column.cell(item).line for column in table.columns] for item in table.items],
        "note": table.note,
    }


def _needs(methods: Sequence[Method]) -> Table:
    ranked = {need.what: choices(need, [one for one in methods if one.engine not in OWN]) for need in NEEDS}

    def say(place: int, need: Need) -> str:
        return ranked[need.what][place] if place < len(ranked[need.what]) else "-"

    heads = ("first choice", "second", "third")
    return Table(
        [
            Column("need", lambda need: need.what),
            *(Column(head, partial(say, place)) for place, head in enumerate(heads)),
        ],
        NEEDS,
        note="Each cell names an engine with its best profile for the need, and the time step in frames of the "
        "scene. A cell with *19 of 26* means that the need is met in 19 of 26 scenes. The last number, such as "
        "*179 x*, is the "
        "run time with one step per frame, divided by PIT's. If several are equally good, larger steps come first, "
        "then shorter run times. The profile `located` "
        "takes about 48 steps per impact.",
    )


def crowd(methods: Sequence[Method]) -> list[tuple[Method, Row]]:
    """Return the methods that ran the chaotic scene, PIC apart, with their rows, the best first as in a report."""
    played = [method for method in methods if method.engine != "pic"]
    ran = [(method, row) for method in played for row in method.coarse if row["scene"] == CHAOTIC]
    return sorted(((method, row) for method, row in ran if row["local_truth"] is not None), key=_rank)


def _rank(found: tuple[Method, Row]) -> tuple[bool, int, int, int, float, float]:
    """Order of merit; a worst error that is not finite, null in a row, is the worst, and rounding decides nothing."""
    _, row = found
    steps = row["local_truth"]
    ratio, energy = steps["ratio"][1], steps["energy"]
    return (
        row["outcome"] != "completed",
        max(steps["missed_within"], steps["missed"] - steps["missed_by_pit"]),
        steps["invented"],
        steps["early"] + steps["ahead"],
        math.inf if ratio is None else float(f"{ratio:.3e}"),
        math.inf if energy is None else energy if energy > THRESHOLDS.energy else 0.0,
    )


def crowd_table(methods: Sequence[Method]) -> Table:
    """Return the ranking of a crowd: what each step shows from the run's own state."""

    def of(say: Callable[[Row], str]) -> Callable[[tuple[Method, Row]], str]:
        return lambda found: say(found[1]["local_truth"])

    def not_finite(value: float | None) -> str:
        return "not bounded" if value is None else number(value)

    return Table(
        [
            Column("method", lambda found: found[0].name),
            Column("grade", lambda found: found[1]["grade"].replace("_", " ")),
            Column("grade of steps", of(lambda steps: steps["grade"])),
            Column("impacts due", of(lambda steps: str(steps["due"])), number=True),
            Column(
                "missed (also by PIT)", of(lambda steps: f"{steps['missed']} ({steps['missed_by_pit']})"), number=True
            ),
            Column("invented", of(lambda steps: str(steps["invented"])), number=True),
            Column("early", of(lambda steps: str(steps["early"] + steps["ahead"])), number=True),
            Column("median lateness, steps", of(lambda steps: not_finite(steps["late_steps"][0])), number=True),
            Column("worst error / PIT's", of(lambda steps: not_finite(steps["ratio"][1])), number=True),
            Column("energy error", of(lambda steps: not_finite(steps["energy"])), number=True),
            Column("run ended at, s", of(lambda steps: number(steps["until_s"])), number=True),
        ],
        crowd(methods),
        note=f"The scene is `{CHAOTIC}` at its own frame rate, from one start: 25 discs in a box for 20 s. It is "
        "chaotic, so another build gives other numbers. Trajectories differ from any reference within a second, "
        "so each step is "
        "compared with PIC from the run's own state. *Missed*: two discs passed through each other; in brackets is how "
        "many of these impacts PIT also misses from the same state. *Worst error / PIT's*: up to 1, checking once per "
        "step explains the error. *Energy error*: energy gained or lost in addition to PIT's steps, divided by the "
        "energy of the scene. The best method is first. The rank depends on misses that PIT does not have, then on "
        "invented impacts, early impacts, the worst error, and energy errors above a millionth. Runs that ended early "
        "are last.",
    )


def _limits(stress: dict[str, Any], methods: Sequence[Method]) -> Table:
    def say(attack: str, method: Method) -> str:
        return breaking(stress, attack, method)

    shown = {(one["engine"], one["profile"]) for one in stress["methods"]}
    return Table(
        [Column("method", lambda method: method.name)]
        + [Column(head, partial(say, attack), number=True) for attack, head in ATTACKS.items()],
        [method for method in methods if (method.engine, method.profile) in shown],
        note="Each cell is the value at which the method first fails. *Passes to* means that it passes up to the most "
        "extreme value tested. *From* means that it fails at the harmless end already.",
    )


def _engine(own: Sequence[Method]) -> dict[str, Any]:
    """Return the table of an engine's profiles, and the settings of the one to paste."""
    columns = [
        Column("profile", lambda method: method.profile),
        Column("scenes with each grade", grades),
        Column("impacts missed / invented", impacts, number=True),
        Column(
            "time error, steps",
            lambda method: _spread(_numbers(method.coarse, _total("time_s", lambda row: row["dt_s"]))),
        ),
        Column(
            "direction error, degrees",
            lambda method: _spread(_numbers(method.coarse, _total("direction_rad", lambda _: 1 / RIGHT_ANGLE))),
        ),
        Column("energy error", energy),
        Column("energy error of 25 discs after 20 s", gas),
        Column("run time / PIT's", speed, number=True),
    ]
    chosen = best(own)
    return {
        "profiles": data(Table(columns, own)),
        "profile": chosen.profile if chosen else "",
        "settings": settings(chosen) if chosen else "",
    }


def main() -> None:
    """Write the data from the three folders and the file named."""
    if sys.argv[1] == "--alone":
        report, figures = map(Path, sys.argv[2:4])
        known = json.loads(MEASURED.read_text(encoding="utf-8"))
        with_alone(known, *raw_records(report / "results.jsonl"), json.loads(figures.read_text(encoding="utf-8")))
        _write(known)
        return
    report, speeds, campaign, figures = map(Path, sys.argv[1:5])
    head, rows = raw_records(report / "results.jsonl")
    timing, timed = raw_records(speeds / "results.jsonl")
    stress = json.loads((campaign / "stress.json").read_text(encoding="utf-8"))
    commands = (head["command"], timing["command"], stress["command"])
    hazards = json.loads(figures.read_text(encoding="utf-8"))
    found = measured(head, rows, timed, stress, hazards, commands, timing["environment"]["date"][:10])
    _write(found)


def _write(found: dict[str, Any]) -> None:
    MEASURED.write_text(json.dumps(found, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
