"""Attack Carom for a number of minutes, and print the table of all attempts: ``python -m tests.attacks``.

Counts add up from call to call in ``reports/attacks/``. Each attack gets its share of the time, those whose goal is not
met first. Exit code 1 means that something was lost; each loss is printed and kept.
"""

import argparse
import inspect
import json
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, field, fields
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
    """One kind of attack: the attempts that it plans, and a function whose docstring says what it does."""

    goal: int
    tries: Tries

    @property
    def what(self) -> str:
        """What is attacked, and how."""
        return self._read_docstring()[0]

    @property
    def held(self) -> str:
        """What must hold."""
        return self._read_docstring()[1]

    def _read_docstring(self) -> list[str]:
        """Return both sentences of the docstring, as they are written in a cell of a table."""
        sentences = [text.removesuffix(".") for text in (inspect.getdoc(self.tries) or "").split("\n\n")]
        return [text if text.startswith("Carom ") else text[0].lower() + text[1:] for text in sentences]


@dataclass
class Count:
    """What an attack has tried and found."""

    tried: int = 0
    lost: int = 0
    findings: list[str] = field(default_factory=list)


ATTACKS = {
    "scenes": Attack(100_000, scenes.attack),
    "known-failures": Attack(5_000, known_failures.attack),
    "journal-cuts": Attack(4_000, journals.attack_by_cuts),
    "journal-garbage": Attack(2_000, journals.attack_by_garbage),
    "journal-types": Attack(2_000, results.journals),
    "results": Attack(5_000, results.results),
    "reports": Attack(500, reports.attack),
    "options": Attack(2_000, options.attack),
    "kills": Attack(200, kills.attack),
    "clocks": Attack(500, clocks.attack),
    "clusters": Attack(30, clusters.attack),
    "wild-numbers": Attack(2_000, extreme_numbers.attack),
    "disks": Attack(6, disks.attack),
    "imports": Attack(5_000, imports.attack),
    "programs": Attack(2_000, programs.attack),
    "play": Attack(1_000, play.attack),
    "overlays": Attack(1_000, overlays.attack),
    "sizes": Attack(50, sizes.attack),
    "surroundings": Attack(300, environments.attack),
}


def main() -> int:
    """Return 1 where anything was ever lost, 130 after Ctrl-C, else 0."""
    parser = argparse.ArgumentParser("python -m tests.attacks", description=__doc__)
    parser.add_argument("--minutes", type=float, default=1.0, help="how long (1)")
    parser.add_argument("--only", action="append", choices=[*ATTACKS], help="one attack alone; repeatable")
    parser.add_argument(
        "--state", type=Path, default=Path("reports/attacks"), help="folder of counts, corpus and findings"
    )
    parser.add_argument("--write", type=Path, help="put the table into this page, between its two marks")
    chosen = parser.parse_args()
    state = chosen.state.absolute()
    state.mkdir(parents=True, exist_ok=True)
    names = chosen.only or [*ATTACKS]
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
            lost = next(under_way[name])
            count.tried += 1
            if lost:
                count.lost += 1
                count.findings = [*count.findings, lost][:KEPT]
                print(f"{name}: {lost}", flush=True)
        part = state / name / "part"
        part.write_text(json.dumps(asdict(count), indent=1))
        part.replace(state / name / COUNT)


def _count(folder: Path) -> Count:
    path = folder / COUNT
    found = json.loads(path.read_text()) if path.exists() else {}
    return Count(**{one.name: found[one.name] for one in fields(Count) if one.name in found})


def _table(counts: dict[str, Count]) -> str:
    rows = ["| attack | attempts | goal | failed | what must hold |", "| --- | ---: | ---: | ---: | --- |"]
    rows += [
        f"| {one.what} | {counts[name].tried:,} | {one.goal:,} | {counts[name].lost:,} | {one.held} |"
        for name, one in ATTACKS.items()
    ]
    return "\n".join(rows) + "\n"


if __name__ == "__main__":
    sys.exit(main())
