"""What all figures of a report share."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

import carom
from carom.pages.svg import drawing, finish, line_style, plain_number


def test_an_axis_of_less_than_a_decade_has_plain_words() -> None:
    """No tick is labelled in the notation of formulas, which a report writes out as it stands, dollars and all."""
    with drawing():
        figure = Figure()
        axes = figure.add_subplot()
        axes.loglog([0.02, 0.07], [0.2, 0.7])
        above = axes.secondary_xaxis("top", functions=(lambda s: np.multiply(s, 2.0), lambda r: np.divide(r, 2.0)))
        for axis in (axes.xaxis, axes.yaxis, above.xaxis):
            axis.set_major_formatter(plain_number)
        finish(axes)
        figure.canvas.draw()
        labels = [
            label.get_text()
            for axis in (axes.xaxis, axes.yaxis, above.xaxis)
            for which in ("major", "minor")
            for label in axis.get_ticklabels(which=which)
        ]
    assert labels
    assert not [label for label in labels if "$" in label]


def test_no_two_profiles_of_an_engine_are_drawn_with_one_dash() -> None:
    """Lines of an engine have one colour, so the dash alone tells its profiles apart."""
    several = 0
    for engine in carom.engines():
        names = list(engine.profiles)
        dashes = {repr(line_style(0, pit=False, profile=name)["linestyle"]) for name in names}
        assert len(dashes) == len(names), (engine.name, names)
        several += len(names) > 2
    assert several, "no engine with three profiles was tried"


def test_a_profile_has_one_dash_whatever_the_engine() -> None:
    """A dash means a profile and a colour an engine."""
    first, second = (line_style(number, pit=False, profile="located") for number in (0, 1))
    assert first["linestyle"] == second["linestyle"]
    assert first["color"] != second["color"]
