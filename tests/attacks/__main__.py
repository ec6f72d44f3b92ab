"""Attack Carom for a number of minutes, and print the table of all attempts: ``python -m tests.attacks``.

Counts add up from call to call in ``reports/attacks/``; `--anew` begins at nought. Each attack gets its share of the
time, those whose goal is not met first. Exit code 1 tells that something was lost: what, is printed and kept.
"""

import argparse
import json
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, field
from pathlib import Path
from random import Random

from tests.attacks import (
    clocks,
    clusters,
    disks,
    environments,
    extreme_numbers,
    imports,
    journals,
    kills,
    known_failures,
    options,
    overlays,
    play,
    programs,
    reports,
    results,
    scenes,
    sizes,
)

Tries = Callable[[Random, Path], Iterator[str]]

#: Seconds after which an attack is stopped for another.
TURN_S = 60.0
#: In the folder of each attack.
COUNT = "count.json"
#: Losses that are kept.
KEPT = 50
BEGIN, END = "<!-- attacks: begin -->", "<!-- attacks: end -->"


@dataclass(frozen=True)
class Attack:
    """One kind of attack."""

    what: str
    held: str
    goal: int
    tries: Tries


@dataclass
class Count:
    """What an attack has tried and found."""

    tried: int = 0
    lost: int = 0
    seconds: float = 0.0
    slowest_s: float = 0.0
    findings: list[str] = field(default_factory=list)


ATTACKS = {
    "scenes": Attack(
        "scene files with random changes",
        "a file is loaded, and saved without a difference, or refused with a message within 10 s",
        100_000,
        scenes.attack,
    ),
    "known-failures": Attack(
        "lists of known failures with random changes",
        "the file is read, or refused with a message",
        5_000,
        known_failures.attack,
    ),
    "journal-cuts": Attack(
        "journals cut at any byte",
        "every complete line is read, and the incomplete one is dropped",
        4_000,
        journals.attack_by_cuts,
    ),
    "journal-garbage": Attack(
        "journals with random bytes",
        "the journal is read, or refused with a message and not changed",
        2_000,
        journals.attack_by_garbage,
    ),
    "journal-types": Attack(
        "journals with values of wrong types", "the file is read, or refused with a message", 2_000, results.journals
    ),
    "results": Attack(
        "`results.jsonl` with values of wrong types",
        "the file is compared, or refused with a message",
        5_000,
        results.results,
    ),
    "reports": Attack(
        "`carom run` killed at each call that changes the disk",
        "the report is completely the old or the new one",
        500,
        reports.attack,
    ),
    "options": Attack(
        "random values of options",
        "the value is accepted, or refused with a message and exit code 2",
        2_000,
        options.attack,
    ),
    "kills": Attack(
        "commands killed at a random moment and resumed",
        "the final result is the same; no process and no folder remains",
        200,
        kills.attack,
    ),
    "clocks": Attack(
        "wrong clocks of engines", "Carom shows a time or a message, and times the other engines", 500, clocks.attack
    ),
    "clusters": Attack(
        "a cluster that loses its worker or its scheduler",
        "Carom finishes the work or shows a message; a resumed run has a bit-identical journal",
        30,
        clusters.attack,
    ),
    "wild-numbers": Attack(
        "engines that return extreme numbers",
        "only this engine's result is affected, and the report is strict JSON",
        2_000,
        extreme_numbers.attack,
    ),
    "disks": Attack(
        "a disk that becomes full while Carom writes",
        "Carom shows a message and exits with 2; with free space the final result is the same",
        6,
        disks.attack,
    ),
    "imports": Attack(
        "engine files with random changes: pickles, MJCF, dumps",
        "the result is a scene that loads without a difference, or a message; no program is started",
        5_000,
        imports.attack,
    ),
    "programs": Attack(
        "wrong answers of engine programs, wrong requests to `carom serve`",
        "the program's result is true, other results do not change, and each line gets an answer",
        2_000,
        programs.attack,
    ),
    "play": Attack(
        "hostile names and links, and damaged blocks, of the play page",
        "only Carom's script runs, and the page shows a scene or a message",
        1_000,
        play.attack,
    ),
    "overlays": Attack(
        "releases of `carom history` that are killed, damaged, or installed twice at once",
        "every release that is used is complete, and nothing unfinished remains",
        1_000,
        overlays.attack,
    ),
    "sizes": Attack(
        "scenes with 1e5 points, legs, discs or walls",
        "the command exits with a code from 0 to 4, within 2 minutes of processor time and 2 GB",
        50,
        sizes.attack,
    ),
    "surroundings": Attack(
        "closed streams, unusual arguments and environments, read-only and full disks, two commands in one folder",
        "the command exits with a code from 0 to 4 and shows a message",
        300,
        environments.attack,
    ),
}


def main() -> int:
    """Return 1 where anything was ever lost, 130 after Ctrl-C, else 0."""
    parser = argparse.ArgumentParser("python -m tests.attacks", description=__doc__)
    parser.add_argument("--minutes", type=float, default=1.0, help="how long (1)")
    parser.add_argument("--only", action="append", choices=[*ATTACKS], help="one attack alone; repeatable")
    parser.add_argument(
        "--state", type=Path, default=Path("reports/attacks"), help="folder of counts, corpus and findings"
    )
    parser.add_argument("--anew", action="store_true", help="begin the counts of these at nought; the corpus stays")
    parser.add_argument("--write", type=Path, help="put the table into this page, between its two marks")
    chosen = parser.parse_args()
    state = chosen.state.absolute()
    state.mkdir(parents=True, exist_ok=True)
    names = chosen.only or [*ATTACKS]
    if chosen.anew:
        for name in names:
            (state / name / COUNT).unlink(missing_ok=True)
    interrupted = False
    try:
        _attack(names, state, time.monotonic() + 60.0 * chosen.minutes)
    except KeyboardInterrupt:
        interrupted = True
    counts = {name: _count(state / name) for name in ATTACKS}
    table = _table(counts)
    print(table)
    for name, count in counts.items():
        for finding in count.findings:
            print(f"{name}: {finding}")
    if chosen.write:
        before, _, rest = chosen.write.read_text(encoding="utf-8").partition(BEGIN)
        chosen.write.write_text(f"{before}{BEGIN}\n{table}{END}{rest.partition(END)[2]}", encoding="utf-8")
    return 130 if interrupted else 1 if any(count.lost for count in counts.values()) else 0


def _attack(names: list[str], state: Path, until: float) -> None:
    """Give each attack its turns until the time is over. What another process attacks meanwhile is not touched."""
    under_way: dict[str, Iterator[str]] = {}
    counts = {name: _count(state / name) for name in names}
    while time.monotonic() < until:
        # Those that are farthest from their goal first.
        name = min(names, key=lambda name: (counts[name].tried / ATTACKS[name].goal, names.index(name)))
        count = counts[name]
        if name not in under_way:
            folder = state / name
            folder.mkdir(exist_ok=True)
            under_way[name] = ATTACKS[name].tries(Random(f"{name} {count.tried}"), folder)
        end = min(until, time.monotonic() + TURN_S)
        while time.monotonic() < end:
            before = time.monotonic()
            lost = next(under_way[name])
            took_s = time.monotonic() - before
            count.tried += 1
            count.seconds += took_s
            count.slowest_s = max(count.slowest_s, took_s)
            if lost:
                count.lost += 1
                count.findings = [*count.findings, lost][:KEPT]
                print(f"{name}: {lost}", flush=True)
        part = state / name / "part"
        part.write_text(json.dumps(asdict(count), indent=1))
        part.replace(state / name / COUNT)


def _count(folder: Path) -> Count:
    path = folder / COUNT
    return Count(**json.loads(path.read_text())) if path.exists() else Count()


def _table(counts: dict[str, Count]) -> str:
    rows = ["| attack | attempts | goal | failed | what must hold |", "| --- | ---: | ---: | ---: | --- |"]
    rows += [
        f"| {one.what} | {counts[name].tried:,} | {one.goal:,} | {counts[name].lost:,} | {one.held} |"
        for name, one in ATTACKS.items()
    ]
    return "\n".join(rows) + "\n"


if __name__ == "__main__":
    sys.exit(main())
