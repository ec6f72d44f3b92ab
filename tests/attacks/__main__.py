"""Attack Carom for a number of minutes, and print the table of all attempts: ``python -m tests.attacks``.

Counts add up from call to call in ``reports/attacks/``. The attack that is farthest from its goal gets the next
turn. Exit code 1 means that something was lost; each loss is printed and kept.
"""

import argparse
import inspect
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


@dataclass
class Count:
    """What an attack has tried and found."""

    tried: int = 0
    lost: int = 0
    findings: list[str] = field(default_factory=list)


#: The planned attempts, and a function whose docstring has two sentences: what it does, and what must hold.
ATTACKS: dict[str, tuple[int, Tries]] = {
    "scenes": (100_000, scenes.attack),
    "known-failures": (5_000, known_failures.attack),
    "journal-cuts": (4_000, journals.attack_by_cuts),
    "journal-garbage": (2_000, journals.attack_by_garbage),
    "journal-types": (2_000, results.journals),
    "results": (5_000, results.results),
    "reports": (500, reports.attack),
    "options": (2_000, options.attack),
    "kills": (200, kills.attack),
    "clocks": (500, clocks.attack),
    "clusters": (30, clusters.attack),
    "wild-numbers": (2_000, extreme_numbers.attack),
    "disks": (6, disks.attack),
    "imports": (5_000, imports.attack),
    "programs": (2_000, programs.attack),
    "play": (1_000, play.attack),
    "overlays": (1_000, overlays.attack),
    "sizes": (50, sizes.attack),
    "surroundings": (300, environments.attack),
}


def main() -> int:
    """Return 1 if any attack ever found a loss, else 0."""
    parser = argparse.ArgumentParser("python -m tests.attacks", description=__doc__)
    parser.add_argument("--minutes", type=float, default=1.0, help="how long (1)")
    parser.add_argument("--state", type=Path, default=Path("reports/attacks"), help="folder of counts and findings")
    parser.add_argument("--write", type=Path, help="put the table into this page, between its two marks")
    chosen = parser.parse_args()
    counts = _attack(chosen.state.absolute(), time.monotonic() + 60.0 * chosen.minutes)
    table = _format_table(counts)
    print(table)
    for name, count in counts.items():
        for finding in count.findings:
            print(f"{name}: {finding}")
    if chosen.write:
        before, _, rest = chosen.write.read_text(encoding="utf-8").partition(BEGIN)
        chosen.write.write_text(f"{before}{BEGIN}\n{table}{END}{rest.partition(END)[2]}", encoding="utf-8")
    return 1 if any(count.lost for count in counts.values()) else 0


def _attack(state: Path, until: float) -> dict[str, Count]:
    """Give each attack its turns until the time is over, and return all counts."""
    under_way: dict[str, Iterator[str]] = {}
    counts = {name: _read_count(state / name) for name in ATTACKS}
    while time.monotonic() < until:
        # Those that are farthest from their goal first.
        name = min(counts, key=lambda name: counts[name].tried / ATTACKS[name][0])
        folder, count = state / name, counts[name]
        if name not in under_way:
            folder.mkdir(parents=True, exist_ok=True)
            under_way[name] = ATTACKS[name][1](Random(f"{name} {count.tried}"), folder)
        end = min(until, time.monotonic() + TURN_S)
        while time.monotonic() < end:
            lost = next(under_way[name])
            count.tried += 1
            if lost:
                count.lost += 1
                count.findings = [*count.findings, lost][:KEPT]
                print(f"{name}: {lost}", flush=True)
        (folder / "part").write_text(json.dumps(asdict(count), indent=1))
        (folder / "part").replace(folder / COUNT)
    return counts


def _read_count(folder: Path) -> Count:
    path = folder / COUNT
    return Count(**json.loads(path.read_text())) if path.exists() else Count()


def _format_table(counts: dict[str, Count]) -> str:
    rows = ["| attack | attempts | goal | failed | what must hold |", "| --- | ---: | ---: | ---: | --- |"]
    for name, (goal, tries) in ATTACKS.items():
        what, rule = map(_format_cell, (inspect.getdoc(tries) or "").split("\n\n"))
        rows.append(f"| {what} | {counts[name].tried:,} | {goal:,} | {counts[name].lost:,} | {rule} |")
    return "\n".join(rows) + "\n"


def _format_cell(sentence: str) -> str:
    text = sentence.removesuffix(".")
    return text if text.startswith("Carom ") else text[0].lower() + text[1:]


if __name__ == "__main__":
    sys.exit(main())
