"""The map of what sampling costs agrees with closed forms, and is drawn."""

import numpy as np
from docs.figures.error_map import build_error_map, error_map_figure

SCENES = 2**17


def test_missed_share_matches_the_closed_form() -> None:
    r"""The share missed is max(0, 1 - 2 sqrt(1 - b^2)/a), with a in radii, on average over 6 by 6 cells.

    A block has about 5,400 scenes; random draws would deviate by 4 sqrt(1/4/5400) = 0.027 at most.
    """
    found = build_error_map(SCENES)
    a = np.sqrt(found.advance[:-1] * found.advance[1:])
    b = 0.5 * (found.offset[:-1] + found.offset[1:])[:, None]
    expected = np.maximum(0.0, 1.0 - 2.0 * np.sqrt(1.0 - b**2) / a)
    blocks = (found.missed - expected).reshape(4, 6, 6, 6).mean(axis=(1, 3))
    assert np.max(np.abs(blocks)) < 0.027
    assert abs(float(np.mean(found.missed - expected))) < 0.005


def test_velocity_error_grows_with_step_and_offset() -> None:
    """At small steps the error is proportional to the step, and it is smaller the closer an impact is to head-on."""
    error = build_error_map(SCENES).velocity_error
    advance = build_error_map(SCENES).advance
    row = 10
    ratio = error[row, 12] / error[row, 2]
    assert abs(np.log(ratio) / np.log(advance[12] / advance[2]) - 1.0) < 0.1
    assert error[0, 5] < error[5, 5] < error[15, 5]


def test_both_figures_of_the_map_are_drawn() -> None:
    """Each figure is an SVG element with its accessible name and the label of its values."""
    found = build_error_map(SCENES)
    for missed, words in ((True, "share of impacts missed"), (False, "velocity error / relative speed")):
        drawn = error_map_figure(found, "a map", missed=missed)
        assert drawn.startswith("<svg")
        assert words in drawn
        assert 'aria-label="a map"' in drawn
