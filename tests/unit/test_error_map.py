"""The map of what sampling costs agrees with closed forms, and is drawn."""

import numpy as np
from docs.figures.error_map import build_error_map, error_map_figure

SCENES = 2**17


def test_the_missed_share_is_the_closed_forms() -> None:
    """The share missed is max(0, 1 - 2 sqrt(1 - b^2)/a), a in radii, over blocks of 6 by 6 cells.

    A block holds some 5,400 scenes; drawn at random they would stray by 4 sqrt(1/4/5400) = .027 at most.
    """
    found = build_error_map(SCENES)
    a = np.sqrt(found.advance[:-1] * found.advance[1:])
    b = 0.5 * (found.offset[:-1] + found.offset[1:])[:, None]
    expected = np.maximum(0.0, 1.0 - 2.0 * np.sqrt(1.0 - b**2) / a)
    blocks = (found.missed - expected).reshape(4, 6, 6, 6).mean(axis=(1, 3))
    assert np.max(np.abs(blocks)) < 0.027
    assert abs(float(np.mean(found.missed - expected))) < 0.005


def test_small_steps_cost_in_proportion_and_head_on_nothing() -> None:
    """At small steps the error grows with the step, and head-on it is least: the normal can't be turned there."""
    error = build_error_map(SCENES).velocity_error
    advance = build_error_map(SCENES).advance
    row = 10
    ratio = error[row, 12] / error[row, 2]
    assert abs(np.log(ratio) / np.log(advance[12] / advance[2]) - 1.0) < 0.1
    assert error[0, 5] < error[5, 5] < error[15, 5]


def test_both_halves_are_drawn() -> None:
    """Each half is an SVG element with its name and its axes' words."""
    found = build_error_map(SCENES)
    for missed, words in ((True, "share of impacts missed"), (False, "velocity error / relative speed")):
        drawn = error_map_figure(found, "a map", missed=missed)
        assert drawn.startswith("<svg")
        assert words in drawn
        assert 'aria-label="a map"' in drawn
