"""The page of hazards, `docs/results/hazards.md`, and the lines that one engine has in its tables."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from operator import itemgetter

from tests.hazards.measures import DRIVEN, GAS, GAS_STARTS, SPEEDS, STARTS, Figure
from tests.hazards.spread import OFF, Spread

from carom.catalogue.find_scenes import find_scenes
from carom.engines.api import Adapter
from carom.execution.job import Method
from carom.report.document import Column, Document, Section, Table
from carom.report.render.markdown import render_markdown
from carom.support.formatting import format_number, format_percent

#: What is nearer to another number than this is shown as that number: the tables are of hazards, not of roundings.
SHOWN_TO = 1e-6


def _format_value(value: float) -> str:
    whole = round(value)
    return format_number(float(whole) if abs(value - whole) < SHOWN_TO else value, 3)


def _format_range(spread: Spread) -> str:
    least, most = _format_value(spread.least), _format_value(spread.most)
    return least if least == most else f"{least} to {most}"


def _format_cell(figures: Mapping[tuple[str, str, Method], Figure], table: str, of: str, method: Method) -> str:
    figure = figures.get((table, of, method))
    if figure is None:
        return "-"
    if figure.spread is None:
        return "unsupported"
    return f"{figure.spread.share}: {_format_range(figure.spread)}"


def _build_table(table: str, columns: Sequence[tuple[str, str]], figures: Sequence[Figure]) -> Table:
    """Return a table with a row per method; a column is its heading and the scene or speed that it shows."""
    known = {(one.table, one.of, Method(one.engine, one.profile)): one for one in figures}
    first = [Column("method", lambda method: method.label)]
    return Table(
        first + [Column(head, partial(_format_cell, known, table, of)) for head, of in columns],
        list(dict.fromkeys(Method(figure.engine, figure.profile) for figure in figures if figure.table == table)),
    )


def _spread_columns(shown: Callable[[float], str]) -> list[Column]:
    """Return the columns of a spread: numbers, and at how many phases they are wrong."""

    def said(pick: str) -> Column:
        return Column(pick, lambda figure: shown(getattr(figure.spread, pick)), number=True)

    off = Column("phases with an error", lambda figure: figure.spread.share, number=True)
    return [*map(said, ("least", "median", "most")), off]


_METHOD = Column("method", lambda figure: Method(figure.engine, figure.profile).label)


def _build_findings_table(figures: Sequence[Figure]) -> Table:
    columns = [
        _METHOD,
        Column("figure", lambda figure: figure.of),
        Column("correct", lambda figure: _format_value(figure.spread.right), number=True),
    ]
    rows = [figure for figure in figures if figure.table == "findings"]
    return Table(columns + _spread_columns(_format_value), rows)


def _build_gas_table(figures: Sequence[Figure]) -> Table:
    return Table([_METHOD, *_spread_columns(format_percent)], [figure for figure in figures if figure.table == "gas"])


def _build_changes_table(adapters: Sequence[Adapter]) -> Table:
    rows = [
        (adapter.name, name, reason)
        for adapter in adapters
        for name, reason in adapter.profiles.get("default", adapter.profiles["tuned"]).changed.items()
    ]
    heads = ("engine", "changed setting", "value and reason")
    return Table([Column(head, itemgetter(k)) for k, head in enumerate(heads)], rows)


def build_tables(figures: Sequence[Figure]) -> dict[str, Table]:
    """Return the tables of figures by their headings on the page."""
    scenes = [entry.name for entry in find_scenes(["engines"]) if entry.name != GAS]
    return {
        "The group engines, as shipped": _build_table(
            "group", [(name.partition("/")[2], name) for name in scenes], figures
        ),
        "How slow discs still bounce": _build_table("bounces", [(f"{speed:g} m/s",) * 2 for speed in SPEEDS], figures),
        "What is driven": _build_table("driven", [(of, of) for of in DRIVEN], figures),
        "A gas": _build_gas_table(figures),
        "Findings": _build_findings_table(figures),
    }


def _render_rows(table: Table) -> list[str]:
    """Return the rows of a table in Markdown, without its head."""
    lines = render_markdown(Document("", (), (Section("", (table,)),))).splitlines()
    return [line for line in lines if line.startswith("| ")][2:]


def render_lines(figures: Sequence[Figure]) -> list[str]:
    """Return the rows that figures are on the page, without the tables' heads."""
    return [line for table in build_tables(figures).values() for line in _render_rows(table)]


def parse_ranges(text: str, heading: str) -> dict[str, tuple[float, float]]:
    """Return least and most of each row of a section of the page: of the gas by method, else by "method: figure"."""
    part = text.partition(f"## {heading}\n")[2].partition("\n## ")[0]
    rows = [[cell.strip().removesuffix(" %") for cell in line.split("|")[1:-1]] for line in part.splitlines()]
    whole = [row for row in rows if len(row) >= 5 and row[-1].partition(" of ")[0].isdigit()]
    return {": ".join(row[: len(row) - 4][:2]): (float(row[-4]), float(row[-2])) for row in whole}


#: What is said under each table.
NOTES = {
    "The group engines, as shipped": "A cell shows the velocity error at the end, divided by the greatest speed of "
    "the scene. Engines run with the profile default. Each scene has its own frame rate.",
    "How slow discs still bounce": "Two equal discs of radius 0.5 m meet head-on. A cell shows their speed after the "
    "impact divided by their speed before it. The correct value is 1.",
    "What is driven": "A driven edge strikes a disc head-on. A cell shows the disc's speed relative to the edge "
    "after the impact, divided by this speed before the impact. The correct value is 1. The edge of 1 m/s meets a disc "
    "of radius 0.5 m that approaches at 2 m/s. The edge of 65 m/s meets a disc of radius 2 m at rest. In the last test "
    "a disc of radius 0.25 m is between a wall and a piston that moves at 0.5 m/s, and after 3 s the gap is too small "
    "for the disc. The cells show the largest speed of the disc until 3.5 s, and how far the disc's centre is beyond "
    "the wall or the piston. The correct distance is 0.",
    "A gas": f"The table shows by how much the energy of the 25 discs of {GAS} changes in 20 s at 60 steps per "
    f"second, at {GAS_STARTS} phases. Because the scene is chaotic, another build of an engine gives other numbers "
    "of the same size.",
    "Findings": "Each row is one finding about an engine. The column 'correct' has the correct value, and the next "
    "three columns show the measured values over all phases.",
}


def render_page(figures: Sequence[Figure], adapters: Sequence[Adapter], versions: str) -> str:
    """Return the page; `versions` are of the engines measured."""
    lead = (
        "This page shows scenes in which engines go wrong. Each scene runs at many phases. A phase shifts the scene "
        f"by a fraction of a step. A cell shows at how many of {STARTS} phases the value is wrong by more than "
        f"{format_percent(OFF)}, and the smallest and largest value of all phases. Steps are 1/60 s unless stated "
        "otherwise. The rows 'pit' show PIT. All errors of PIT come from checking for overlap once per step. Values "
        f"within {format_number(SHOWN_TO)} of a whole number are shown as this number.",
        f"The measured versions are {versions}. 'make hazards' writes this page. "
        "'make test-engines' compares this page with new measurements.",
    )
    shown = build_tables(figures)
    sections = [Section(head, (table._replace(note=NOTES[head]),)) for head, table in shown.items()]
    changes = Section("What default changes", (_build_changes_table(adapters)._replace(note=CHANGES),))
    return render_markdown(Document("Hazards, over many phases", lead, (*sections, changes)))


CHANGES = (
    "The table lists everything that the profile default changes in the shipped settings. It does not list what "
    "describes the scene (shapes, masses, states, gravity). Tests read each shipped value from the engine, and compare "
    "the profile with the engine without Carom."
)
