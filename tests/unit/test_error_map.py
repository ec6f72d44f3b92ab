"""The map of what sampling costs agrees with a closed form."""

import numpy as np
from docs.figures.error_map import build_error_map

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
