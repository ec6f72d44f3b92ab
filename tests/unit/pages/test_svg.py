"""What all figures of a report share."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from carom.pages.svg import drawing, finish, plain_number


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
