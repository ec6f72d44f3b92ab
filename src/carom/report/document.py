"""Document model of reports, independent of the medium: sections, tables, figures and lines.

The modules of `carom.studies` build documents; `carom.report.render` shows them as HTML, as Markdown and on a
terminal. What a medium leaves out on purpose is said in the document (`only`), so that nothing else can be missing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any


class Medium(Enum):
    """Where a document is shown."""

    PAGE = "HTML"
    MARKDOWN = "Markdown"
    TERMINAL = "terminal"
    DETAIL = "terminal, in full"


Media = frozenset[Medium]
EVERYWHERE: Media = frozenset(Medium)
PAGE: Media = frozenset({Medium.PAGE})
TERMINAL: Media = frozenset({Medium.TERMINAL})
DETAIL: Media = frozenset({Medium.DETAIL})
#: Media that are files, and media with more room than a terminal.
ON_PAPER: Media = frozenset({Medium.PAGE, Medium.MARKDOWN})
#: Media of the evidence: all except the short summary.
IN_FULL: Media = ON_PAPER | DETAIL


@dataclass(frozen=True)
class Share:
    """A part of a bar: its class on a page, its size, and the sign and style that a terminal draws it with."""

    css: str
    size: int
    symbol: str
    style: str = ""


@dataclass(frozen=True)
class Cell:
    """A cell of a table.

    Attributes:
        text: What it says.
        note: What stands smaller next to it: the number behind a word.
        short: What a terminal shows instead of text and note, where that is shorter.
        title: The whole story, which a page shows when it is pointed at.
        css: Class of its colours on a page.
        symbol: A sign before the text, so that colour is never the only one.
        style: Its colours on a terminal.
        link: Where the text leads on a page; empty for nowhere.
        shares: Parts of a bar below the text; a terminal shows it instead of the text.
        part: Length of a meter below the text, in parts of the longest; None for no meter.
        anchor: Its name within a page, for what leads to it; empty for none.
        corner: A sign that a page sets into the cell's corner; empty for none.
    """

    text: str
    note: str = ""
    short: str = ""
    title: str = ""
    css: str = ""
    symbol: str = ""
    style: str = ""
    link: str = ""
    shares: tuple[Share, ...] = ()
    part: float | None = None
    anchor: str = ""
    corner: str = ""

    @property
    def line(self) -> str:
        """The whole cell in one line of text."""
        return " ".join(filter(None, (self.symbol, self.text, self.note)))


@dataclass(frozen=True)
class Column:
    """A column of a table.

    Attributes:
        head: Its heading.
        say: What it says of the item of a row.
        under: A second line of the heading.
        number: Whether it holds numbers.
        only: The media that show it.
    """

    head: str
    say: Callable[[Any], Cell | str]
    under: str = ""
    number: bool = False
    only: Media = EVERYWHERE

    @property
    def line(self) -> str:
        """The heading in one line."""
        return f"{self.head} {self.under}".rstrip()

    def cell(self, item: object) -> Cell:
        """Return its cell in the row of an item."""
        said = self.say(item)
        return said if isinstance(said, Cell) else Cell(said)


@dataclass(frozen=True)
class Table:
    """A table; each item is a row, which its first column heads.

    Attributes:
        columns: What stands in them.
        items: What the rows are about.
        title: A heading of its own, where the section's is not enough.
        note: What its columns mean.
        folded: What a page shows of it until it is opened; empty where it is open.
        css: Class of its layout on a page.
        only: The media that show it.
        packed: Whether a page holds its rows compressed until it is opened: they are many, and say little each.
    """

    columns: Sequence[Column]
    items: Sequence[Any]
    title: str = ""
    note: str = ""
    folded: str = ""
    css: str = ""
    only: Media = EVERYWHERE
    packed: bool = False

    def shown(self, medium: Medium) -> tuple[list[Column], list[list[Cell]]]:
        """Return columns and rows as a medium shows them."""
        columns = [column for column in self.columns if medium in column.only]
        return columns, [[column.cell(item) for column in columns] for item in self.items]


@dataclass(frozen=True)
class Text:
    """A paragraph.

    Attributes:
        text: What it says.
        only: The media that show it.
        folded: Whether it is the answer to *How is this computed?*, which a page shows when it is asked for.
    """

    text: str
    only: Media = EVERYWHERE
    folded: bool = False


@dataclass(frozen=True)
class Lines:
    """A list of sentences.

    Attributes:
        items: They.
        only: The media that show it.
        folded: What a page shows of it until it is opened; empty where it is open.
    """

    items: tuple[str, ...]
    only: Media = EVERYWHERE
    folded: str = ""


@dataclass(frozen=True)
class Facts:
    """Names with their values."""

    items: tuple[tuple[str, str], ...]
    only: Media = ON_PAPER


@dataclass(frozen=True)
class Legend:
    """Meanings of the marks of a table, each with a cell of symbol and word."""

    items: tuple[tuple[Cell, str], ...]
    only: Media = EVERYWHERE


@dataclass(frozen=True)
class Code:
    """Text to type literally, such as a command."""

    text: str
    only: Media = EVERYWHERE


@dataclass(frozen=True)
class Figure:
    """A drawing, made as SVG when a page needs it.

    Attributes:
        draw: Makes it, or with the argument True its form for a phone.
        caption: Sentences below it.
        title: What stands above it, where neither the drawing nor the section says so.
    """

    draw: Callable[[bool], str]
    caption: str
    title: str = ""


@dataclass(frozen=True)
class Figures:
    """Drawings side by side, or large, one below the other; media without drawings show the tables."""

    items: tuple[Figure, ...]
    large: bool = False
    only: Media = PAGE


@dataclass(frozen=True)
class Pair:
    """Two drawings to the same scale.

    Attributes:
        heading: What they are of.
        badge: What came of it.
        sides: What each shows, in a few words.
        draw: Makes both.
        caption: Sentences below them.
    """

    heading: str
    badge: Cell
    sides: tuple[str, str]
    draw: Callable[[], tuple[str, str]]
    caption: tuple[str, ...]


@dataclass(frozen=True)
class Pairs:
    """Several pairs of drawings; in Markdown only their captions."""

    items: tuple[Pair, ...]
    only: Media = ON_PAPER


@dataclass(frozen=True)
class Replays:
    """Data for the replay script of a page, packed when a page needs it: the runs of each scene by name."""

    pack: Callable[[], Iterable[tuple[str, str]]]
    only: Media = PAGE


#: What leads to a folded text.
QUESTION = "How is this computed?"

Block = Table | Text | Lines | Facts | Legend | Code | Figures | Pairs | Replays


@dataclass(frozen=True)
class Section:
    """A part of a document.

    Attributes:
        heading: Its heading.
        blocks: What it holds, in order.
        level: 2, or 3 for a part of the section before it.
        only: The media that show it.
        short: What a list of the sections calls it, where the heading is long.
    """

    heading: str
    blocks: tuple[Block, ...]
    level: int = 2
    only: Media = EVERYWHERE
    short: str = ""

    def shown(self, medium: Medium) -> tuple[Block, ...]:
        """Return the blocks that a medium shows."""
        return tuple(block for block in self.blocks if medium in block.only)


@dataclass(frozen=True)
class Headline:
    """The first sentences of a document: the answer to the question of the study.

    Attributes:
        sentence: The answer; a terminal prints it on the first line.
        more: What else of it matters; a terminal prints it last, where it stays in sight.
    """

    sentence: str
    more: tuple[str, ...] = ()

    @classmethod
    def of(cls, sentences: Iterable[str]) -> Headline:
        """Return a headline of one or more sentences, of which the first is the answer."""
        first, *more = sentences
        return cls(first, tuple(more))

    @property
    def sentences(self) -> tuple[str, ...]:
        """All of it, in order."""
        return tuple(filter(None, (self.sentence, *self.more)))


@dataclass(frozen=True)
class Document:
    """A document.

    Attributes:
        title: Its title.
        answer: What it says first.
        sections: Its parts.
        about: What is compared, for who reads such a document for the first time; no terminal shows it.
        watch: The one replay to begin with, which a page leads to; None for none.
    """

    title: str
    answer: Headline
    sections: tuple[Section, ...]
    about: str = ""
    watch: Cell | None = None

    @property
    def lead(self) -> tuple[str, ...]:
        """The sentences of the answer."""
        return self.answer.sentences

    def shown(self, medium: Medium) -> Iterable[Section]:
        """Return the sections that a medium shows; one without anything to show is left out."""
        return (section for section in self.sections if medium in section.only and section.shown(medium))
