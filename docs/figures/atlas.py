"""Tables of the engines' pages from the results of `make atlas`: `docs/figures/measured.json`.

The sources are `results.jsonl` of a cross-check of all scenes with all engines, `results.jsonl` of a timed cross-check
of a few scenes, `stress.json` of a stress campaign, and the results over many phases of `make hazards`. This module
computes every number of the tables from these files. Infinite and undefined numbers are null in these files, and are
left out here. `engine_pages.py` inserts the tables into the pages. `python -m docs.figures.atlas --alone REPORT
HAZARDS` adds engines that were measured later, without other engines. Such engines have their own tables, and are not
in the tables that rank all engines.
"""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from docs.figures.atlas_methods import (
    ATTACKS,
    CHAOTIC,
    NEEDS,
    OWN,
    RIGHT_ANGLE,
    Method,
    Need,
    Row,
    best,
    breaking,
    choices,
    energy,
    gas,
    grades,
    impacts,
    methods_of,
    numbers,
    settings,
    speed,
    spread,
    total,
)
from docs.figures.raw_records import read_raw_records

from carom.comparator.thresholds import THRESHOLDS
from carom.report.document import Column, Table
from carom.support.formatting import format_number

ROOT = Path(__file__).resolve().parents[2]
MEASURED = ROOT / "docs" / "figures" / "measured.json"


def measured(
    head: dict[str, Any],
    rows: Sequence[Row],
    timed: Sequence[Row],
    stress: dict[str, Any],
    hazards: Sequence[Row],
    commands: Sequence[str],
    timed_on: str = "",
) -> dict[str, Any]:
    """Return the tables as data, with the dates and versions of the measurements.

    `commands` are the commands that ran the cross-check, the timed cross-check and the stress campaign.
    """
    return tables_of(methods_of(rows, timed, hazards), stress) | {
        "measured": {
            name: head["environment"][name] for name in ("date", "carom", "python", "processor", "system", "versions")
        }
        | {"timed": timed_on or head["environment"]["date"][:10], "scenes": len(head["scenes"])},
        "commands": list(commands),
    }


def with_alone(known: dict[str, Any], head: dict[str, Any], rows: Sequence[Row], hazards: Sequence[Row]) -> None:
    """Add the tables of engines that were measured alone, and the date of the measurement."""
    here = head["environment"]
    methods = [one for one in methods_of(rows, (), hazards) if one.engine not in OWN]
    versions = {name: version for name, version in here["versions"].items() if name != "numpy"}
    known["engines"] |= tables_of(methods, {"lines": [], "methods": []})["engines"]
    known["alone"] = known.get("alone", {}) | dict.fromkeys(
        (f"{name} {version}" for name, version in versions.items()),
        f"{here['date'][:10]} on {len(head['scenes'])} scenes",
    )


def tables_of(methods: Sequence[Method], stress: dict[str, Any]) -> dict[str, Any]:
    """Return all tables: engines for each need, the ranking with many discs, limits of engines, tables per engine."""
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
    """Return a table as data: headings, rows of texts, and the note below the table."""
    return {
        "heads": [column.line for column in table.columns],
        "rows": [[column.build_cell(item).line for column in table.columns] for item in table.items],
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
        note="Each cell names an engine, its best profile for the need, and the step size in frames of the scene. "
        "*19 of 26* means that the engine meets the need in 19 of 26 scenes. The last number, such as *179 x*, is the "
        "run time with one step per frame, divided by PIT's run time. Equally good engines are sorted by step size, "
        "largest first, and then by run time. The profile `located` needs about "
        "48 steps per impact.",
    )


def crowd(methods: Sequence[Method]) -> list[tuple[Method, Row]]:
    """Return the methods except PIC that ran the chaotic scene, with their rows; the best method is first."""
    played = [method for method in methods if method.engine != "pic"]
    ran = [(method, row) for method in played for row in method.coarse if row["scene"] == CHAOTIC]
    return sorted(((method, row) for method, row in ran if row["local_truth"] is not None), key=_rank)


def _rank(found: tuple[Method, Row]) -> tuple[bool, int, int, int, float, float]:
    """Return the sort key of a row.

    A largest error of null (infinite or undefined) is the worst. Rounding errors have no effect on the order.
    """
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
    """Return the ranking of methods in a scene with many discs, where Carom compares single steps with PIC."""

    def of(say: Callable[[Row], str]) -> Callable[[tuple[Method, Row]], str]:
        return lambda found: say(found[1]["local_truth"])

    def not_finite(value: float | None) -> str:
        return "not bounded" if value is None else format_number(value)

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
            Column("run ended at, s", of(lambda steps: format_number(steps["until_s"])), number=True),
        ],
        crowd(methods),
        note=f"The scene is `{CHAOTIC}` at its own frame rate, at one phase: 25 discs in a box for 20 s. "
        "The scene is chaotic, so another build of the same engine computes different results. "
        "After a second no trajectory agrees with "
        "PIC's, so Carom compares each single step with a step of PIC that starts from the engine's state. The column "
        "*missed* counts impacts in which two discs passed through each other. The number in brackets counts "
        "the impacts that PIT also misses from the same state. If the value in the column "
        "*worst error / PIT's* is at most 1, "
        "checking once per step explains the error. The column *energy error* shows the energy gained or lost beyond "
        "what PIT gains or loses in the same steps, divided by the energy of the scene. Methods are sorted from best "
        "to worst: by the number of impacts that the method misses but PIT finds, then by invented impacts, early "
        "impacts, the worst error, and energy errors above a millionth. Runs that ended early are last.",
    )


def _limits(stress: dict[str, Any], methods: Sequence[Method]) -> Table:
    def say(attack: str, method: Method) -> str:
        return breaking(stress, attack, method)

    shown = {(one["engine"], one["profile"]) for one in stress["methods"]}
    return Table(
        [Column("method", lambda method: method.name)]
        + [Column(head, partial(say, attack), number=True) for attack, head in ATTACKS.items()],
        [method for method in methods if (method.engine, method.profile) in shown],
        note="Each cell is the value at which the method first fails. *Passes to* means that the method passes even "
        "at the most extreme value tested, which is shown. *From* means that the method fails even at the least "
        "extreme value, which is shown.",
    )


def _engine(own: Sequence[Method]) -> dict[str, Any]:
    """Return the table of an engine's profiles, and the settings of the profile to copy."""
    columns = [
        Column("profile", lambda method: method.profile),
        Column("scenes with each grade", grades),
        Column("impacts missed / invented", impacts, number=True),
        Column(
            "time error, steps",
            lambda method: spread(numbers(method.coarse, total("time_s", lambda row: row["dt_s"]))),
        ),
        Column(
            "direction error, degrees",
            lambda method: spread(numbers(method.coarse, total("direction_rad", lambda _: 1 / RIGHT_ANGLE))),
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
    """Read the folders and the file that the command line names, and write the data of the tables."""
    if sys.argv[1] == "--alone":
        report, figures = map(Path, sys.argv[2:4])
        known = json.loads(MEASURED.read_text(encoding="utf-8"))
        with_alone(known, *read_raw_records(report / "results.jsonl"), json.loads(figures.read_text(encoding="utf-8")))
        _write(known)
        return
    report, speeds, campaign, figures = map(Path, sys.argv[1:5])
    head, rows = read_raw_records(report / "results.jsonl")
    timing, timed = read_raw_records(speeds / "results.jsonl")
    stress = json.loads((campaign / "stress.json").read_text(encoding="utf-8"))
    commands = (head["command"], timing["command"], stress["command"])
    hazards = json.loads(figures.read_text(encoding="utf-8"))
    found = measured(head, rows, timed, stress, hazards, commands, timing["environment"]["date"][:10])
    _write(found)


def _write(found: dict[str, Any]) -> None:
    MEASURED.write_text(json.dumps(found, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
