"""The tables of the engines' pages: `python docs/figures/engine_pages.py` writes them into `docs/engines/*.md`.

Sources: `measured.json` (`make atlas`), and the pages of `docs/results`: `hazards.md` (`make hazards`),
`determinism.md` (`make determinism`), `history.md` (`make history`) and `walls.md` (`make walls`). Text between
`<!-- made by ...: NAME -->` and `<!-- end -->` is generated, the rest is written by hand.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path
from typing import Any

from carom.catalogue import all_scenes
from carom.engines.registry import load_adapter
from carom.support.formatting import join_words

DOCS = Path(__file__).resolve().parents[1]
PAGES = DOCS / "engines"
MEASURED = DOCS / "figures" / "measured.json"
HAZARDS = DOCS / "results" / "hazards.md"
HISTORY = DOCS / "results" / "history.md"
DETERMINISM = DOCS / "results" / "determinism.md"
WALLS = DOCS / "results" / "walls.md"

_PART = re.compile(r"(<!-- made by docs/figures/engine_pages\.py: (\w+) -->\n)(?s:.*?)(<!-- end -->)")
#: Beginning of a cell in `docs/results/hazards.md` if no phase has an error.
_NONE_OFF = re.compile(r"0 of \d+: ")

Row = Sequence[str]
#: Number of phases of each scene in the tables of hazards.
PHASES = 32


def rows_of(heads: Row, rows: Sequence[Row]) -> str:
    """Return a table in Markdown."""
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n"


def table(data: dict[str, Any]) -> str:
    """Return a table of `measured.json` with its note."""
    note = f"\n{data['note']}\n" if data["note"] else ""
    return rows_of(data["heads"], data["rows"]) + note


@cache
def measured() -> dict[str, Any]:
    """Return the results of `make atlas`."""
    found: dict[str, Any] = json.loads(MEASURED.read_text(encoding="utf-8"))
    return found


@cache
def hazards() -> dict[str, tuple[Row, tuple[Row, ...]]]:
    """Read the tables of the page of hazards.

    The keys are the headings of sections; a value has column heads and rows.
    """
    found: dict[str, tuple[Row, tuple[Row, ...]]] = {}
    for part in HAZARDS.read_text(encoding="utf-8").split("\n## ")[1:]:
        lines = [tuple(cell.strip() for cell in line.split("|")[1:-1]) for line in part.splitlines() if line[:1] == "|"]
        found[part.partition("\n")[0]] = (lines[0], tuple(lines[2:]))
    return found


def _cells(heading: str, engine: str) -> Iterator[tuple[str, str, str]]:
    """Yield the name of each quantity in a table of hazards, the engine's default result, and PIT's result."""
    heads, rows = hazards()[heading]
    pit = next(row for row in rows if row[0] == "pit")
    for row in (row for row in rows if row[0] == f"{engine} default"):
        yield from zip(heads[1:], row[1:], pit[1:], strict=True)


def hazards_of(engine: str) -> str:
    """Return a text that lists scenes with and without errors of an engine with default settings."""
    scenes = list(_cells("The group engines, as shipped", engine))
    bounces = list(_cells("How slow discs still bounce", engine))
    lines = [(f"`engines/{of}`: {all_scenes()[f'engines/{of}'].shows}", cell, pit) for of, cell, pit in scenes]
    parts = "speed after the impact divided by the speed before it (1 is correct)"
    lines += [(f"head-on impact at {of}: {parts}", cell, pit) for of, cell, pit in bounces]
    off = [(what, *cell.partition(": ")[::2], pit) for what, cell, pit in lines if not _NONE_OFF.match(cell)]
    rows = [(what, phases, spread or "-", "-" if _NONE_OFF.match(pit) else pit) for what, phases, spread, pit in off]
    text = rows_of(("scene", "phases with an error", "smallest to largest error", "PIT: phases and errors"), rows)
    lead = (
        "With default settings the engine computes the following scenes with an error above 1 %, at some or all of "
        f"{PHASES} [phases](../reference/glossary.md)."
    )
    text = f"{lead}\n\n{text}"
    text += (
        "\nErrors of scenes are velocity errors at the end, divided by the scene's greatest speed. All errors of PIT "
        "come from checking for overlap only once per step.\n"
    )
    fine = [f"`{of}`" for of, cell, _ in scenes if _NONE_OFF.match(cell)]
    speeds = [of.removesuffix(" m/s") for of, cell, _ in bounces if _NONE_OFF.match(cell)]
    fine += [f"head-on impacts at {join_words(speeds)} m/s"] if speeds else []
    if fine:
        text += f"\nThe error is at most 1 % at every phase in {join_words(fine)}.\n"
    gas = [row for row in hazards()["A gas"][1] if row[0].split()[0] == engine]
    spans = [
        f"{least} to {most} with `{method.split()[1]}` (by more than 1 % at {off} phases)"
        for method, least, _, most, off in gas
    ]
    return (
        text + f"\nIn a box of 25 discs, the energy changes in 20 s, depending on the phase, by {join_words(spans)}.\n"
    )


def profiles_of(engine: str) -> str:
    """Return the table of an engine's profiles."""
    made = table(measured()["engines"][engine]["profiles"])
    return f"The page [Engines](README.md#what-the-columns-mean) explains the columns.\n\n{made}"


def settings_of(engine: str) -> str:
    """Return the settings of an engine to copy."""
    own = measured()["engines"][engine]
    command = f"carom engines {engine} --show {own['profile']}"
    printed = f"`{command}` prints these settings as code ([settings to paste](../how-to/settings.md))."
    return f"These are the settings of the profile `{own['profile']}`. {printed}\n\n```text\n{own['settings']}\n```\n"


def history_of(engine: str) -> str:
    """Return the sentences about an engine's releases above its tables on the page of histories."""
    name = load_adapter(engine).engine.name
    part = HISTORY.read_text(encoding="utf-8").partition(f"\n## {name}\n")[2]
    said = [text for text in part.partition("\n### ")[0].split("\n\n") if text.strip()]
    anchor = re.sub(r"[^a-z0-9-]", "", name.lower().replace(" ", "-"))
    tables = f"The page [Releases](../results/history.md#{anchor}) has the tables."
    return f"{' '.join(text.strip() for text in said)} {tables}\n"


def walls_of(engine: str) -> str:
    """Return an engine's rows of the tables of walls."""
    name, text = load_adapter(engine).engine.name, WALLS.read_text(encoding="utf-8")
    made = []
    for part in re.findall(r"<!-- made by docs/figures/walls\.py: \w+ -->\n(.*?)<!-- end -->", text, re.DOTALL):
        lines = [[cell.strip() for cell in line.split("|")[1:-1]] for line in part.splitlines() if line[:1] == "|"]
        made.append(rows_of(lines[0][1:], [line[1:] for line in lines[2:] if line[0] == name]))
    said = (
        "The page [Walls in engines](../results/walls.md) describes the tests. The first table shows at how many of "
        "32 phases a disc passes through a thin wall. In one step the disc moves by q times the sum of its radius and "
        "the wall's half width.",
        "The next table compares 48 flights over a floor of ten pieces with the same flights over a floor of one "
        "piece. The columns *flights* count the flights that end with different velocities on the two floors. "
        "Differences and errors are in "
        "m/s.",
        "The last table shows the median and the largest direction error of 16 phases at the end of a wall, in "
        "degrees, and the largest velocity error in a corner, in m/s.",
    )
    if not any(line[:1] == "|" and line[2:5] != "---" for table in made for line in table.splitlines()[2:]):
        return "Walls of this engine were not measured.\n"
    return "\n".join(f"{sentence}\n\n{made_table}" for sentence, made_table in zip(said, made, strict=True))


def _same_bits() -> Iterator[dict[str, str]]:
    """Yield the rows of the page on determinism. Each row maps column heads to cells."""
    lines = [line for line in DETERMINISM.read_text(encoding="utf-8").splitlines() if line.startswith("| ")]
    heads, _, *rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in lines]
    yield from (dict(zip(heads, row, strict=True)) for row in rows)


def _not_same(row: dict[str, str]) -> str:
    """Return the tests in which a run was not bit-identical, except for the test with another order of discs."""
    counted = (name for name, word in row.items() if word in {"other", "ended"} and name != "order")
    return join_words(list(counted)) or "none"


def determinism_of(engine: str) -> str:
    """Return a sentence per profile, which states whether an engine is deterministic."""
    rows = [row for row in _same_bits() if row["engine"] == engine]
    if not rows:
        return "This engine was not measured ([method](../results/determinism.md)).\n"
    turned = {"same": "is also bit-identical", "other": "differs"}
    said = []
    for row in rows:
        same, _, ways = row["score"].partition(" of ")
        where = (
            f"in all {ways} tests"
            if same == ways
            else f"in {same} of {ways} tests, but not in the test *{_not_same(row)}*"
        )
        said.append(
            f"With `{row['profile']}` settings a repeated run is bit-identical {where}. If the discs are listed in the "
            f"opposite order, the result with these settings {turned[row['order']]}. "
        )
    return "".join(said) + "The page [Determinism](../results/determinism.md) describes the tests.\n"


def same_bits() -> str:
    """Return the table of all engines: tests passed, tests failed, and whether the order of discs has an effect."""
    heads = ("method", "bit-identical in", "not in", "discs in the opposite order give")
    return rows_of(
        heads,
        [
            (
                f"{row['engine']} {row['profile']}".rstrip(),
                f"{row['score']} tests",
                _not_same(row),
                f"the {row['order']} result" if row["order"] == "same" else "another result",
            )
            for row in _same_bits()
        ],
    )


def version() -> str:
    """Return the date, the machine and the versions of the measurement."""
    here = measured()["measured"]
    versions = join_words([f"{name} {version}" for name, version in here["versions"].items()])
    alone, joined = (
        join_words([f"{name} ({when})" for name, when in measured().get(key, {}).items()])
        for key in ("alone", "joined")
    )
    later = f"These engines were measured later on the same scenes, without run times: {joined}.\n" if joined else ""
    later += (
        f"This engine was measured without other engines and is not in the tables that rank engines: {alone}.\n"
        if alone
        else ""
    )
    return (
        f"The tables were measured on {here['date'][:10]} with Carom {here['carom']}, {here['python']}, "
        f"{here['processor']}, {here['system']}, on {here['scenes']} scenes. The versions were {versions}. Run times "
        f"were measured on {here['timed']}.\n{later}"
    )


def commands() -> str:
    """Return the commands that make all measurements."""
    return "```text\n" + "\n".join(measured()["commands"]) + "\n```\n"


#: Blocks of the page of all engines, and of the page of an engine.
SHARED = {
    "version": version,
    "needs": lambda: table(measured()["needs"]),
    "crowd": lambda: table(measured()["crowd"]),
    "limits": lambda: table(measured()["limits"]),
    "same_bits": same_bits,
    "commands": commands,
}
OWN = {
    "hazards": hazards_of,
    "profiles": profiles_of,
    "settings": settings_of,
    "history": history_of,
    "determinism": determinism_of,
    "walls": walls_of,
}


def filled(page: Path) -> str:
    """Return a page with new generated parts."""

    def part(found: re.Match[str]) -> str:
        name = found[2]
        made = SHARED[name]() if name in SHARED else OWN[name](page.stem)
        return f"{found[1]}{made}{found[3]}"

    return _PART.sub(part, page.read_text(encoding="utf-8"))


if __name__ == "__main__":
    for page in sorted(PAGES.glob("*.md")):
        page.write_text(filled(page), encoding="utf-8")
