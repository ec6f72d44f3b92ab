"""Shapes of pictures as SVG elements: their places, their order, and lines with fewer points."""

import math
import sys
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.cases import each

import carom
from carom.report.picture import draw_pair
from carom.report.shapes import Circle, Dots, Line, Number, Polygon, Shape, Style, render_svg, simplify_line
from carom.report.svg import INK, SERIES, WALL

LOW, HIGH = np.array([0.0, 0.0]), np.array([2.0, 1.0])
STYLE = Style(1, edge=INK)


def draw(*shapes: Shape, label: str = "picture") -> ET.Element:
    """Return the SVG element of a region of 2 m by 1 m, which is 200 points wide."""
    return ET.fromstring(render_svg(shapes, LOW, HIGH, 200.0, label))  # noqa: S314 - our own text


def test_shapes_are_at_their_places() -> None:
    """In a drawing with 100 points per metre, y grows upwards and the upper edge is at 0."""
    svg = draw(
        Circle((0.5, 0.25), 0.1, STYLE),
        Polygon([(0, 0), (1, 0), (1, 1)], STYLE),
        Line([(0, 1), (2, 0)], STYLE),
        Dots([(1, 1)], 3.0, Style(1, fill=INK)),
        Number((2, 1), 7),
    )
    assert svg.get("viewBox") == "0 0 200 100"
    circle, background = svg.findall("circle")
    assert (circle.get("cx"), circle.get("cy"), circle.get("r")) == ("50", "75", "10")
    assert [path.get("d") for path in svg.findall("path")] == ["M0 100L100 100L100 0Z", "M0 0L200 100", "M100 0h0"]
    (number,) = svg.findall("text")
    assert (number.text, number.get("x"), number.get("y")) == ("7", "200", "0")
    assert (background.get("cx"), background.get("cy")) == ("200", "0")


def test_shapes_with_higher_order_cover_others() -> None:
    """Shapes are drawn by their order, and shapes of one order as they are given."""
    shapes = [Circle((0, 0), radius, Style(order, edge=INK)) for radius, order in ((0.1, 2), (0.2, 1), (0.3, 2))]
    assert [circle.get("r") for circle in draw(*shapes).findall("circle")] == ["20", "10", "30"]


def test_style_is_written_as_attributes() -> None:
    """Fill, line, dashes and opacity are attributes, colours are the page's, and a wall is hatched."""
    solid = Style(1, fill=SERIES[0], edge=WALL, width_pt=2.5, dashes_pt=(3.0, 1.5), opacity=0.5)
    svg = draw(Circle((0, 0), 1.0, solid), Circle((0, 0), 1.0, Style(1, edge=WALL, hatched=True)), label='"<&')
    filled, hatched = svg.findall("circle")
    wanted = {"fill": f"var(--s0,{SERIES[0]})", "stroke": f"var(--wall,{WALL})", "stroke-width": "2.5"}
    wanted |= {"stroke-dasharray": "3 1.5", "opacity": "0.5"}
    assert {name: filled.get(name) for name in wanted} == wanted
    (pattern,) = svg.findall("pattern")
    assert hatched.get("fill") == f"url(#{pattern.get('id')})"
    assert svg.get("aria-label") == '"<&'


@each("bad", [math.nan, math.inf, -math.inf])
def test_points_that_are_not_finite_interrupt_a_line(bad: float) -> None:
    """A line is interrupted at a point that is not finite, and a circle or number there is not drawn."""
    line = Line([(0, 0), (1, 0), (bad, 0), (1, 1), (2, 1)], STYLE)
    svg = draw(line, Circle((0, bad), 1.0, STYLE), Number((bad, 0), 1))
    assert not svg.findall("circle")
    assert [path.get("d") for path in svg.findall("path")] == ["M0 100L100 100", "M100 0L200 0"]


@each("far_m", [1e7, 1e100])
def test_far_points_keep_their_direction(far_m: float) -> None:
    """A line from the middle to a point far outside the picture ends nearer, in the same direction."""
    (path,) = draw(Line([(1, 0.5), (1 + 0.6 * far_m, 0.5 + 0.8 * far_m)], STYLE)).findall("path")
    start, end = str(path.get("d"))[1:].split("L")
    x, y = map(float, end.split())
    assert start == "100 50"
    assert math.hypot(x, y) < 1.1e6
    assert math.atan2(50 - y, x - 100) == pytest.approx(math.atan2(0.8, 0.6), abs=1e-5)


@given(st.lists(st.tuples(st.floats(-300, 300), st.floats(-300, 300)), min_size=1, max_size=30))
def test_simplified_line_is_within_the_tolerance(points: list[tuple[float, float]]) -> None:
    """A simplified line has the same ends, and each point of the line is within 0.05 of it."""
    line = np.array(points)
    found = simplify_line(line)
    assert found[[0, -1]].tolist() == line[[0, -1]].tolist()
    begins, steps = found[:-1], np.diff(found, axis=0)
    for point in line:
        squares = np.maximum((steps**2).sum(axis=1), 1e-300)
        along = np.clip(((point - begins) * steps).sum(axis=1) / squares, 0.0, 1.0)
        distances = np.hypot(*(begins + along[:, None] * steps - point).T)
        assert min([*distances, *np.hypot(*(found - point).T)]) <= 0.05 + 1e-9


def test_points_on_a_straight_line_are_omitted() -> None:
    """A straight path needs two points, however many states were recorded, and a path that turns back needs three."""
    there = np.column_stack([np.linspace(0.0, 100.0, 1000), np.linspace(0.0, 50.0, 1000)])
    assert simplify_line(there).tolist() == [[0.0, 0.0], [100.0, 50.0]]
    assert simplify_line(np.concatenate([there, there[::-1]])).tolist() == [[0.0, 0.0], [100.0, 50.0], [0.0, 0.0]]


def test_pictures_in_the_plane_need_no_matplotlib(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pictures of a run are drawn without matplotlib, which takes long to load."""
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    reference = carom.solve_pic("paper/missed")
    drawn = draw_pair(reference, carom.solve_pit(reference.scene), [0], ("exact", "PIT"))
    exact, pit = (ET.fromstring(one) for one in drawn)  # noqa: S314 - our own text
    assert len(exact.findall("circle")) > len(pit.findall("circle"))  # two discs at the impact
