"""Content of reports (sections, tables, figures), independent of its appearance.

The modules of `carom.studies` build documents, and `carom.report.render` shows them as HTML, as Markdown and on a
terminal. The attribute `only` of a part names the media (page, Markdown or terminal) that show this part.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from enum import Flag, auto
from typing import Any, NamedTuple


class Media(Flag):
    """Media in which a document is shown."""

    PAGE = auto()
    MARKDOWN = auto()
    TERMINAL = auto()
    DETAIL = auto()  # a terminal on which the user requests the whole document
    ON_PAPER = PAGE | MARKDOWN  # media that are written to files
    IN_FULL = ON_PAPER | DETAIL  # all media except a terminal on which the user only requests a summary
    EVERYWHERE = IN_FULL | TERMINAL


class Share(NamedTuple):
    """A part of a bar: its size, its CSS class on a page, and its sign and style on a terminal."""

    css: str
    size: int
    symbol: str
    style: str = ""


class Cell(NamedTuple):
    """A cell of a table.

    Attributes:
        text: The text.
        note: A note in smaller letters after the text, such as a number.
        short: Shorter text for a terminal, instead of text and note.
        title: The full explanation, which a page shows as a tooltip.
        css: CSS class for colours on a page.
        symbol: A sign before the text, so that colours are not the only difference between cells.
        style: Colours on a terminal.
        link: Link target of the text on a page; empty for none.
        shares: The parts of a bar below the text; empty for no bar. A terminal shows the bar instead of the text.
        part: Length of a coloured line (meter) below the text, relative to the longest line; None for no line.
        anchor: Name to which links on the page refer; empty for none.
        corner: A sign in the corner of the cell on a page; empty for none.
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


class Column(NamedTuple):
    """A column of a table.

    Attributes:
        head: The heading.
        content_of: Function that takes the item of a row and returns the cell.
        subheading: A second line of the heading.
        number: Whether the cells are numbers.
    """

    head: str
    content_of: Callable[[Any], Cell | str]
    subheading: str = ""
    number: bool = False
    only: Media = Media.EVERYWHERE

    @property
    def line(self) -> str:
        """The heading in one line."""
        return f"{self.head} {self.subheading}".rstrip()

    def build_cell(self, item: object) -> Cell:
        """Return the column's cell in the row of an item."""
        content = self.content_of(item)
        return content if isinstance(content, Cell) else Cell(content)


class Table(NamedTuple):
    """A table with a row for each item. The first column contains the names of the items.

    Attributes:
        columns: The columns.
        items: The items, one for each row.
        title: The table's own heading, in addition to the heading of the section.
        note: Explanation of the columns.
        folded: Label that opens the table on a page; empty if the table is open from the start.
        css: CSS class for the layout on a page.
        packed: Whether a page stores the rows in compressed form until a reader opens the table. Packing is for tables
            with many rows.
    """

    columns: Sequence[Column]
    items: Sequence[Any]
    title: str = ""
    note: str = ""
    folded: str = ""
    css: str = ""
    only: Media = Media.EVERYWHERE
    packed: bool = False

    def select_for(self, medium: Media) -> tuple[list[Column], list[list[Cell]]]:
        """Return the columns and rows that a medium shows."""
        columns = [column for column in self.columns if medium in column.only]
        return columns, [[column.build_cell(item) for column in columns] for item in self.items]


class Text(NamedTuple):
    """A paragraph.

    Attributes:
        text: The text.
        folded: Whether a page shows the paragraph only after a click on *How is this computed?*.
    """

    text: str
    only: Media = Media.EVERYWHERE
    folded: bool = False


class Lines(NamedTuple):
    """A list of sentences.

    Attributes:
        items: The sentences.
        folded: Label that opens the list on a page; empty if the list is open from the start.
    """

    items: tuple[str, ...]
    only: Media = Media.EVERYWHERE
    folded: str = ""


class Facts(NamedTuple):
    """Pairs of name and value."""

    items: tuple[tuple[str, str], ...]
    only: Media = Media.ON_PAPER


class Legend(NamedTuple):
    """Legend of a table: pairs of a mark and its meaning. The mark is a cell with a symbol and a word."""

    items: tuple[tuple[Cell, str], ...]
    only: Media = Media.EVERYWHERE


class Code(NamedTuple):
    """Text that is shown unchanged, such as a command."""

    text: str
    only: Media = Media.EVERYWHERE


class Figure(NamedTuple):
    """An SVG drawing, which is made when a page needs it.

    Attributes:
        draw: Function that returns the drawing. Its argument is True for a phone, and False for a wide screen.
        caption: Sentences below the drawing.
        title: A heading above the drawing; empty if the drawing itself or the section already has a heading.
    """

    draw: Callable[[bool], str]
    caption: str
    title: str = ""


class Figures(NamedTuple):
    """Drawings on a page, side by side or, if `large` is true, one below the other.

    Media other than pages show tables instead of drawings.
    """

    items: tuple[Figure, ...]
    large: bool = False
    only: Media = Media.PAGE


class Pair(NamedTuple):
    """Two drawings to the same scale.

    Attributes:
        heading: The subject of both drawings.
        badge: The outcome of the run.
        sides: The content of each drawing, in a few words.
        draw: Function that returns both drawings.
        caption: Sentences below the drawings.
    """

    heading: str
    badge: Cell
    sides: tuple[str, str]
    draw: Callable[[], Sequence[str]]
    caption: tuple[str, ...]


class Pairs(NamedTuple):
    """Several pairs of drawings. Markdown shows only their captions."""

    items: tuple[Pair, ...]
    only: Media = Media.ON_PAPER


class Replays(NamedTuple):
    """Data for the replays of a page: the name of each scene, and the packed data of its runs.

    The function `pack` is called when a page needs the data.
    """

    pack: Callable[[], Iterable[tuple[str, str]]]
    only: Media = Media.PAGE


#: Label on which a reader clicks to open a folded text.
QUESTION = "How is this computed?"

Block = Table | Text | Lines | Facts | Legend | Code | Figures | Pairs | Replays


class Section(NamedTuple):
    """A part of a document.

    Attributes:
        heading: The heading.
        blocks: The content, in order.
        level: Level of the heading: 2, or 3 for a part of the previous section.
        short: A shorter heading for the list of sections.
    """

    heading: str
    blocks: tuple[Block, ...]
    level: int = 2
    only: Media = Media.EVERYWHERE
    short: str = ""

    def select_for(self, medium: Media) -> tuple[Block, ...]:
        """Return the blocks that a medium shows."""
        return tuple(block for block in self.blocks if medium in block.only)


class Document(NamedTuple):
    """A document.

    Attributes:
        title: The title.
        lead: The headline: sentences that state the main result. A terminal prints the first sentence at the top, and
            the other sentences at the end, where they stay visible.
        sections: The sections.
        about: A description of the method in two sentences, for new readers. A terminal does not show this description.
        replay_link: Link to the replay that a reader should watch first; None for none.
    """

    title: str
    lead: tuple[str, ...]
    sections: tuple[Section, ...]
    about: str = ""
    replay_link: Cell | None = None

    def select_for(self, medium: Media) -> Iterable[Section]:
        """Return the sections that a medium shows, except for empty sections."""
        return (section for section in self.sections if medium in section.only and section.select_for(medium))
