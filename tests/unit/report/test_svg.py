"""Common properties of all figures in a report."""

import re
from importlib import resources
from itertools import combinations

import numpy as np
from matplotlib.figure import Figure
from tests.cases import each

from carom.engines.registry import list_adapter_points
from carom.report.svg import SERIES, choose_line_style, finish, format_tick, use_drawing_style


def test_short_logarithmic_axis_has_plain_labels() -> None:
    """No tick label of an axis of less than a decade uses `$` notation, which a report would show literally."""
    with use_drawing_style():
        figure = Figure()
        axes = figure.add_subplot()
        axes.loglog([0.02, 0.07], [0.2, 0.7])
        above = axes.secondary_xaxis("top", functions=(lambda s: np.multiply(s, 2.0), lambda r: np.divide(r, 2.0)))
        for axis in (axes.xaxis, axes.yaxis, above.xaxis):
            axis.set_major_formatter(format_tick)
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


def test_engines_have_different_colours_or_markers() -> None:
    """Each engine has its own pair of colour and marker, and no engine has the colour of PIC or of PIT."""
    names = list(list_adapter_points())
    looks = {name: (choose_line_style(name)["color"], choose_line_style(name)["marker"]) for name in names}
    assert len(set(looks.values())) == len(names) > 2
    own = {looks[name][0] for name in ("pic", "pit")}
    assert len(own) == 2
    assert not own & {colour for name, (colour, _) in looks.items() if name not in {"pic", "pit"}}


#: What a person sees who lacks one kind of cones, in linear RGB (G. Machado, M. Oliveira, L. Fernandes, "A
#: physiologically-based model for simulation of color vision deficiency", 2009, table 1, severity 1).
SEEN = {
    "all cones": np.eye(3),
    "no red ones": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
    "no green ones": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.01182, 0.04294, 0.968881]],
    "no blue ones": [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.3039]],
}
#: From linear RGB to XYZ (IEC 61966-2-1), and the white of D65.
XYZ, WHITE = [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]], [0.95047, 1.0, 1.08883]
#: The least difference of two colours that is seen at all, in CIELAB (M. Mahy, L. Van Eycken, A. Oosterlinck, 1994).
LEAST_SEEN = 2.3


def to_cielab(colour: str, seen: object) -> np.ndarray:
    """Return what is seen of a colour, in CIELAB (CIE 15)."""
    channels = np.array([int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5)])
    linear = np.where(channels <= 0.04045, channels / 12.92, ((channels + 0.055) / 1.055) ** 2.4)
    x, y, z = np.array(XYZ) @ np.clip(np.array(seen) @ linear, 0.0, 1.0) / WHITE
    fx, fy, fz = (np.cbrt(t) if t > 216 / 24389 else (24389 / 27 * t + 16) / 116 for t in (x, y, z))
    return np.array([116 * fy - 16, 500 * (fx - fy), 200 * (fy - fz)])


@each("seen", SEEN)
def test_colours_differ_for_every_kind_of_colour_blindness(seen: str) -> None:
    """Any two colours differ by over four times the least visible difference, for every kind of cones."""
    css = (resources.files("carom.report") / "templates" / "report.css").read_text(encoding="utf-8")
    light, dark = (re.findall(r"--s\d: (#[0-9a-f]{6});", part) for part in css.split("prefers-color-scheme: dark"))
    assert tuple(light) == SERIES
    assert len(dark) == len(SERIES)
    for colours in (light, dark):
        for first, second in combinations(colours, 2):
            apart = np.linalg.norm(to_cielab(first, SEEN[seen]) - to_cielab(second, SEEN[seen]))
            assert apart > 4 * LEAST_SEEN, (first, second)
