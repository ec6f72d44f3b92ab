"""Pairs that are solved for together have the bits of those that are solved for one by one."""

from __future__ import annotations

import math
import random

import pytest
from tests.forms import needs_extension
from tests.lengths import long_after

from carom import Chain, Disc, Scene, Wall
from carom.solvers.plain.run import AllPairsRun

pytestmark = needs_extension


def crowd(seed: int) -> Scene:
    """Some discs on a lattice in a box that closes, with an edge, a mallet and a paddle on legs; some rub and turn."""
    rng = random.Random(f"crowd {seed}")
    columns, rows = rng.randint(4, 6), 4

    def drift(size: float) -> tuple[float, float]:
        return rng.uniform(-size, size), rng.uniform(-size, size)

    legs = [{"from_s": 0.0, "velocity_m_s": drift(0.3)}, {"from_s": 0.4, "velocity_m_s": drift(0.3)}]
    free = [
        Disc(
            position_m=(i + rng.uniform(-0.1, 0.1), j + rng.uniform(-0.1, 0.1)),
            velocity_m_s=(0.0, 0.0) if (held := rng.random() < 0.1) else drift(3.0),
            radius_m=0.3,
            mass_kg=math.inf if held else rng.choice([1.0, 2.0, 30.0]),
        )
        for i in range(columns)
        for j in range(rows)
    ]
    mallet = Disc(position_m=(columns / 2, rows + 1.0), radius_m=0.5, mass_kg=math.inf, driven=True, legs=legs)
    far = max(columns, rows) + 2.0
    walls = [
        Wall(point_m=(-1, 0), normal=(1, 0), velocity_m_s=(0.2, 0.0)),
        Wall(point_m=(far, 0), normal=(-1, 0)),
        Wall(point_m=(0, -1), normal=(0, 1), surface_speed_m_s=rng.choice([0.0, 1.0])),
        Wall(point_m=(0, far), normal=(0, -1)),
        Chain(points_m=[(columns + 0.8, -0.5), (columns + 0.8, 1.5)], legs=legs),
    ]
    rough = {"friction": 0.3, "wall_friction": 0.2} if seed % 2 else {}
    e = rng.choice([1.0, 0.9])
    return Scene(
        name="crowd", discs=[*free, mallet], walls=walls, restitution=e, wall_restitution=e, duration_s=3.0, **rough
    )


@pytest.mark.parametrize("seed", long_after(2, range(20)))
def test_pairs_solved_for_together_have_the_bits_of_all_pairs(seed: int) -> None:
    """Impacts, edges, spins, ambiguities, counts and the end of a crowd with driven bodies, taken in two pieces."""
    from carom.solvers.plain.driven import DrivenRun

    scene, contact_s = crowd(seed), 1e-3 * (seed % 3 == 0)
    one_by_one = AllPairsRun(scene, contact_duration_s=contact_s)
    together = DrivenRun(scene, contact_duration_s=contact_s)
    outcome = one_by_one.advance_to(scene.duration_s, 400)
    together.advance_to(scene.duration_s / 7, 400)
    assert together.advance_to(scene.duration_s, 400) is outcome
    assert one_by_one.impacts > 40
    assert together.log.array().tobytes() == one_by_one.log.array().tobytes()
    for name in ("positions", "velocities", "spins"):
        expected, found = (getattr(run, name)() for run in (one_by_one, together))
        assert (found is None) == (expected is None)
        assert found is None or found.tobytes() == expected.tobytes()
    assert together.log.ambiguous() == one_by_one.log.ambiguous()
    assert together.counts == one_by_one.counts
