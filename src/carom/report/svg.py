"""Conversion of matplotlib figures to small SVG drawings for HTML pages. The page defines the colours."""

from __future__ import annotations

import html
import io
import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple
from zlib import crc32

from carom.comparator.thresholds import THRESHOLDS
from carom.report.files import require_report_extra
from carom.support import formatting

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Colours of figures. On a page, each colour is replaced by a CSS variable, which has another value in dark mode.
INK = "#1b2330"
MUTED = "#66707f"
GRID = "#d8dde4"
SURFACE = "#fefefd"
WALL = "#8b94a1"
#: Colours that colour-blind people can distinguish in light and in dark mode, as a test checks. The first three (green,
#: blue, red) are the colours of the paper that inspired Carom.
SERIES = ("#00805c", "#0068a8", "#cc3d1e", "#d94fd0", "#4b2d00", "#0f3c69", "#6a1fe0", "#74777c")

_AIM_PT = 11.0
#: Font size of names next to lines.
_NAME_PT = 8.5
_MARKERS = "osD^vP*X"
_PNG_DPI = 144
#: Space above the axes, with and without a title.
_HEAD_IN, _BARE_IN = 0.5, 0.15
#: Fraction of an axis that is reserved for errors within rounding, with space for two labels, and largest number of
#: ticks on a phone.
_STRIP, _MOST_TICKS = 0.14, 4
#: Space for the numbers and the label of the y axis, and height of a line below the diagram.
_LEFT_IN, _FOOT_IN = 0.87, 0.16

_VARIABLES = {INK: "--ink", MUTED: "--muted", GRID: "--rule", SURFACE: "--surface", WALL: "--wall"}
_VARIABLES |= {colour: f"--s{k}" for k, colour in enumerate(SERIES)}


def as_page_colour(colour: str) -> str:
    """Return one of the colours of figures as the page's CSS variable."""
    return f"var({_VARIABLES[colour]},{colour})"


_STYLE = {
    "svg.fonttype": "none",  # text is smaller than paths, and can be searched and read aloud
    "text.parse_math": False,  # a dollar sign in a name must not begin a formula
    "font.family": "sans-serif",
    "font.size": 9.0,
    "text.color": INK,
    "axes.labelcolor": INK,
    "axes.edgecolor": MUTED,
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "hatch.linewidth": 0.6,
}


@contextmanager
def use_drawing_style() -> Iterator[None]:
    """Use the report's drawing style within a `with` block. Afterwards, matplotlib's settings are as before.

    Raises:
        MissingExtraError: matplotlib is not installed.
    """
    require_report_extra()
    import matplotlib as mpl

    with mpl.rc_context(_STYLE):  # type: ignore[arg-type] # the stubs allow literal names only
        yield


def build_figure(width_in: float, height_in: float) -> Figure:
    """Return an empty figure that is not registered with pyplot."""
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width_in, height_in))
    FigureCanvasSVG(figure)
    return figure


#: Dash pattern of each profile, which is the same in every diagram. `tuned`, unknown profiles and PIC have solid lines.
_DASHES: dict[str, Any] = {
    "default": "--",
    "located": ":",
    "swept": "-.",
    "ccd": (0, (6, 1.5, 1, 1.5, 1, 1.5)),
    "event-driven": (0, (9, 2)),
    "frame-by-frame": "--",
    "pic event-driven": "-",
    "no-ccd": (0, (2, 2)),
    "resting": (0, (8, 2, 2, 2)),
    "cylinder": (0, (4, 1, 1, 1)),
    "cylinder-plain": (0, (1, 3)),
}


#: The position of an engine in this list defines its colour and mark. Only PIC has the first colour.
_ENGINES = (
    "pymunk",
    "box2d",
    "mujoco",
    "pybullet",
    "planck",
    "matter",
    "rapier2d",
    "jolt",
    "rapier",
    "box2d3",
    "dart",
    "drake",
    "cannon",
    "p2",
    "havok",
    "ode",
    "physx",
    "newton",
)


def _choose_look(engine: str) -> tuple[str, str]:
    """Return the colour and mark of an engine, which are the same in every diagram."""
    if engine == "pic":
        return SERIES[0], _MARKERS[0]
    lap = len(SERIES) - 1
    # The style of an unknown engine follows from its name, so another engine may have the same style.
    n = _ENGINES.index(engine) if engine in _ENGINES else crc32(engine.encode()) % (lap * len(_MARKERS))
    return SERIES[1 + n % lap], _MARKERS[(1 + n) % len(_MARKERS)]  # 7 colours and 8 marks give 56 styles


def choose_line_style(engine: str, *, profile: str = "tuned") -> dict[str, Any]:
    """Return a method's line style: colour and mark depend on the engine, and the dash pattern on the profile.

    PIT's line is broad, and drawn below the other lines, so that the other lines stay visible. Marks of default
    settings are hollow.
    """
    hollow, pit = profile in {"default", "frame-by-frame"}, engine == "pit"
    colour, marker = _choose_look(engine)
    return {
        "color": INK if pit else colour,
        "linewidth": 3.2 if pit else 1.3,
        "alpha": 0.4 if pit else 0.9,
        "linestyle": _DASHES.get(f"{engine} {profile}", _DASHES.get(profile, "-")),
        "marker": marker,
        "markersize": 5.0,
        "markerfacecolor": "none" if hollow else None,
        "zorder": 2 if pit else 3,
    }


#: Sizes for a phone, in inches: the diagram, its left margin, its right margin for names, and the height of a legend
#: line.
_NARROW_IN, _NARROW_LEFT_IN, _NAMES_IN, _ENTRY_IN = (3.9, 3.9), 0.8, 1.3, 0.18


def build_framed_figure(
    width_in: float,
    height_in: float,
    title: str = "",
    foot: Sequence[str] = (),
    *,
    narrow: bool = False,
    below: int = 0,
) -> tuple[Figure, Axes]:
    """Return a figure with space for a legend on the right, a title above, and small text lines below.

    Args:
        width_in: Width of the figure.
        height_in: Height of the figure, without the lines below.
        title: Title above the diagram.
        foot: Text lines below the diagram.
        narrow: Whether the figure has the width of a phone.
        below: Number of names in a legend below a narrow figure; 0 if the names are on the right.
    """
    if narrow:
        width_in, height_in = _NARROW_IN[0], _NARROW_IN[1] + _ENTRY_IN * math.ceil(below / 2)
    height = height_in + _FOOT_IN * len(foot)
    figure = build_figure(width_in, height)
    left_in, right_in = (_NARROW_LEFT_IN, 0.1 if below else _NAMES_IN) if narrow else (_LEFT_IN, 0.28 * width_in)
    foot_in, head_in = 0.55 + _ENTRY_IN * narrow * math.ceil(below / 2), _HEAD_IN if title else _BARE_IN
    left, wide = left_in / width_in, 1.0 - (left_in + right_in) / width_in
    tall = (height_in - foot_in - head_in) / height
    axes = figure.add_axes((left, (height - height_in + foot_in) / height, wide, tall))
    figure.text(0.02, 1.0 - 0.24 / height, title, fontsize=9.5 if narrow else 11)
    for k, line in enumerate(reversed(foot)):
        figure.text(0.02, (0.06 + _FOOT_IN * k) / height, line, fontsize=6.5, color=MUTED)
    return figure, axes


def draw_link_target(axes: Axes, x: float, y: float, anchor: str) -> None:
    """Draw an invisible disc as a link to a part of the page. The disc is large enough to click."""
    clear = (0.0, 0.0, 0.0, 0.0)
    axes.plot([x], [y], "o", markersize=_AIM_PT, color=clear, markeredgecolor=clear, zorder=5, url=f"#{anchor}")


def finish(axes: Axes, below: Figure | None = None) -> None:
    """Draw the grid and the legend, and remove the labels of minor ticks.

    Args:
        axes: The axes.
        below: Figure at whose bottom the legend is drawn; None for a legend next to the axes.
    """
    from matplotlib.ticker import NullFormatter

    # On a short axis, matplotlib would label minor ticks with formulas, but `use_drawing_style` disables formulas.
    for each in (axes, *axes.child_axes):
        each.xaxis.set_minor_formatter(NullFormatter())
        each.yaxis.set_minor_formatter(NullFormatter())
    axes.grid(which="major", color=MUTED, alpha=0.18, linewidth=0.6)
    if below is not None:
        below.legend(loc="lower center", frameon=False, fontsize=8.0, ncols=2)
    elif axes.get_legend_handles_labels()[0]:
        axes.legend(loc="upper left", bbox_to_anchor=(1.02, 1.0), frameon=False, fontsize=7.5, borderaxespad=0.0)


def scale_error_axis(
    axes: Axes, name: str, errors: Iterable[float], *, narrow: bool = False
) -> Callable[[float], float]:
    """Make the x or y axis logarithmic for errors, with a shaded strip for errors that are only rounding.

    Returns:
        A function that returns the position of an error on the axis. An infinite error is drawn at the end of the axis.
    """
    known = [error for error in errors if THRESHOLDS.rounding < error < math.inf]
    low = math.floor(math.log10(min(known, default=0.1)))
    high = math.ceil(math.log10(max(known, default=1.0) * 1.01))
    bottom, top = 10.0**low, 10.0**high
    strip = (top / bottom) ** (_STRIP / (1.0 - _STRIP))
    foot = bottom / math.sqrt(strip)
    spacing = math.ceil((high - low) / _MOST_TICKS) if narrow else 1
    ticks = [10.0**k for k in range(high, low - 1 + narrow, -spacing)][::-1]  # a phone has no room for the lowest label
    labels = [f"≤ {formatting.format_number(THRESHOLDS.rounding)}", *map(formatting.format_number, ticks)]
    axes.set(**{f"{name}scale": "log", f"{name}lim": (bottom / strip, top), f"{name}ticks": [foot, *ticks]})
    axes.set(**{f"{name}ticklabels": labels})
    axes.minorticks_off()
    (axes.axvspan if name == "x" else axes.axhspan)(bottom / strip, bottom, color=MUTED, alpha=0.1, linewidth=0)

    def place(error: float) -> float:
        return min(max(error, foot), top) if error > THRESHOLDS.rounding else foot

    return place


class LineEnd(NamedTuple):
    """The end of a line, its name, and its colour."""

    x: float
    y: float
    name: str
    colour: str


def label_lines(figure: Figure, axes: Axes, ends: Sequence[LineEnd]) -> None:
    """Write the name of each line to the right of the axes, near the line's end, but without overlaps.

    A thin line leads from the end of a line to its name.
    """
    axes.set_xlim(axes.get_xlim())  # fix the limits, so that the ends of lines stay in place
    axes.set_ylim(axes.get_ylim())
    spacing = 1.25 * _NAME_PT / (72.0 * axes.get_position().height * figure.get_figheight())
    to_axes = axes.transData + axes.transAxes.inverted()
    places = [tuple(map(float, to_axes.transform((end.x, end.y)))) for end in ends]
    placed = sorted(zip(places, ends, strict=True), key=lambda one: (one[0][1], one[0][0]))
    levels = [min(max(y, 0.0), 1.0) for (_, y), _ in placed]
    for k in range(1, len(levels)):
        levels[k] = max(levels[k], levels[k - 1] + spacing)
    top = 1.0 + 0.5 * spacing
    for k in reversed(range(len(levels))):
        levels[k] = min(levels[k], top - spacing * (len(levels) - 1 - k))
    thin: dict[str, Any] = {"clip_on": False, "linewidth": 0.7, "alpha": 0.7, "zorder": 1}
    for ((x, y), end), level in zip(placed, levels, strict=True):
        axes.plot([x, 1.02, 1.04], [y, level, level], transform=axes.transAxes, color=end.colour, **thin)
        axes.text(1.05, level, end.name, transform=axes.transAxes, fontsize=_NAME_PT, verticalalignment="center")


def format_tick(value: float, _position: float) -> str:
    """Format the number at a tick in the same way as numbers in reports."""
    return formatting.format_number(value)


def render_png(figure: Figure) -> bytes:
    """Return the figure as PNG."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=_PNG_DPI, facecolor="white", metadata={"Software": None})
    return buffer.getvalue()


def render(figure: Figure, label: str, links: Mapping[str, str] = MappingProxyType({}), *, narrow: bool = False) -> str:
    """Return a figure as an SVG element for HTML, with an accessible name. The drawing style must be in use.

    Args:
        figure: The figure.
        label: Accessible name of the drawing.
        links: Accessible name of each link in the figure. The keys are the parts of the page to which the links lead.
        narrow: Whether the figure is the phone version of another figure on the page.
    """
    import matplotlib as mpl

    buffer = io.StringIO()
    nothing = dict.fromkeys(("Date", "Creator", "Format", "Type"))
    # Ids of parts are hashes. The label is part of the hashed text, so that ids differ between figures but are
    # reproducible.
    mpl.rcParams["svg.hashsalt"] = label + " (narrow)" * narrow
    figure.savefig(buffer, format="svg", transparent=True, metadata=nothing)
    text = buffer.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>\s*", "", text, flags=re.DOTALL)
    text = re.sub(r"<!--.*?-->\s*", "", text, flags=re.DOTALL)
    # SVG within HTML needs no namespaces, but ids must be unique on the page.
    text = text.replace("xlink:href", "href")
    text = re.sub(r'\sxmlns(:\w+)?="[^"]*"', "", text)
    used = set(re.findall(r'href="#([^"]+)"', text)) | set(re.findall(r"url\(#([^)]+)\)", text))
    text = re.sub(r'\sid="([^"]*)"', lambda found: found[0] if found[1] in used else "", text)
    # Round coordinates to a hundredth of a point. Numbers between tags are text, and are not changed.
    text = re.sub(r"<(?!a )[^>]*>", lambda tag: re.sub(r"(?<=\d\.\d\d)\d+", "", tag[0]), text)
    # Remove blanks around the letters of paths, and indents of elements.
    text = re.sub(r'(?<= d=")[^"]*', lambda path: re.sub(r"\s+(?=[A-Za-z])|(?<=[A-Za-z])\s+", "", path[0]), text)
    text = re.sub(r"\n\s*<", "\n<", text)
    for colour in _VARIABLES:
        text = text.replace(colour, as_page_colour(colour))
    for anchor, link_name in links.items():
        name = html.escape(link_name, quote=True)
        text = text.replace(f'<a href="#{anchor}" target="_blank">', f'<a href="#{anchor}" aria-label="{name}">')
    role = "group" if links else "img"  # an element with the role img must not contain links
    text = re.sub(r'^<svg[^>]*?(viewBox="[^"]*")[^>]*>', rf'<svg \1 role="{role}" aria-label="LABEL">', text)
    return text.strip().replace("LABEL", html.escape(label, quote=True), 1)


def to_separate_svg(svg: str) -> str:
    """Convert a drawing of a page to a separate SVG file, which needs XML namespaces."""
    svg = re.sub(r"</?a\b[^>]*>", "", svg)  # remove links, because they lead to parts of the page
    names = 'xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink"'
    return svg.replace("<svg ", f"<svg {names} ", 1) + "\n"
