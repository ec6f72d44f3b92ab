"""Algorithm 1 as the definition of `solve_pit`."""

from __future__ import annotations

import numpy as np
import pytest
from tests.drawn import KINDS, drawn
from tests.lengths import each, release_after
from tests.stage import line

from carom import Chain, solve_pit
from carom.errors import InputError
from carom.model.trace import impact_array
from carom.solvers.reference.algorithm_1 import run_algorithm_1

#: Tests of pairs at all frames that a scene may need.
MOST_TESTS = 1e6


@each("kind", KINDS)
@each("numbers", release_after(1, [range(3), range(3, 40)]))
def test_solve_pit_gives_the_bits_of_the_definition(kind: str, numbers: range) -> None:
    """Skipping of frames, cells and sweeps change no bit."""
    for number in numbers:
        scene = drawn(kind, number)
        if scene.duration_s * scene.frame_rate_hz * len(scene.discs) ** 2 > MOST_TESTS:
            continue
        trace, found = solve_pit(scene), run_algorithm_1(scene)
        assert trace.impacts.tobytes() == impact_array(found.impacts).tobytes(), scene.name
        np.testing.assert_array_equal(trace.final_position_m, [(disc.x, disc.y) for disc in found.discs])
        np.testing.assert_array_equal(trace.final_velocity_m_s, [disc.velocity for disc in found.discs])


@each(
    "fields",
    [
        {"gravity_m_s2": (0.0, -1.0)},
        {"damping_per_s": 0.5},
        {"friction": 0.5},
        {"walls": [Chain(points_m=[(-5, -5), (5, -5)])]},
    ],
)
def test_what_it_has_no_part_for_is_refused(fields: dict[str, object]) -> None:
    """Algorithm 1 of the paper has no gravity, damping, friction or finite walls."""
    scene = line(0.0, 3.0, velocities=(1.0, 0.0))
    with pytest.raises(InputError, match="Algorithm 1 is for discs and half-planes"):
        run_algorithm_1(type(scene)(**{**dict(scene), **fields}))
