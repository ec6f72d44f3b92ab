"""The near pairs are those that comparing all pairs gives, for any arrangement of discs."""

import itertools

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from carom.model.broad_phase import find_near_pairs, find_near_walls

ARRANGEMENTS = ["scattered", "column", "line with jitter", "one place", "two clusters far apart", "lattice"]


def draw_positions(arrangement: str, n: int, rng: np.random.Generator) -> NDArray[np.float64]:
    scattered = rng.uniform(-5, 5, (n, 2))
    match arrangement:
        case "scattered":
            return scattered
        case "column":
            return np.stack([np.full(n, 2.0), rng.permutation(n) * 1.0], axis=1)
        case "line with jitter":
            return np.stack([rng.permutation(n) * 1.0, rng.uniform(0, 1e-9, n)], axis=1)
        case "one place":
            return np.full((n, 2), 3.0)
        case "two clusters far apart":
            return scattered * 1e-3 + np.where(rng.random(n) < 0.5, 0.0, 1e9)[:, None]
        case _:
            return np.stack(np.divmod(rng.permutation(n), 7), axis=1).astype(float)


def compare_all_pairs(
    position: NDArray[np.float64], reach: NDArray[np.float64], movable: NDArray[np.bool_]
) -> set[tuple[int, int]]:
    i, j = np.triu_indices(len(reach), 1)
    dx, dy = (position[j] - position[i]).T
    both = reach[i] + reach[j]
    near = (both >= 0) & (dx * dx + dy * dy <= both * both) & (movable[i] | movable[j])
    return set(zip(i[near].tolist(), j[near].tolist(), strict=True))


def list_near_blocks(
    position: NDArray[np.float64], reach: NDArray[np.float64], movable: NDArray[np.bool_]
) -> list[list[tuple[int, int]]]:
    blocks = list(find_near_pairs(position, reach, movable))
    return [list(zip(first.tolist(), second.tolist(), strict=True)) for first, second in blocks]


@given(
    seed=st.integers(0, 2**32 - 1),
    n=st.integers(1, 150),
    arrangement=st.sampled_from(ARRANGEMENTS),
    octaves=st.sampled_from([0.0, 3.0, 20.0]),
    size=st.sampled_from([-1e-9, 0.0, 1e-9, 0.1, 0.5, 3.0]),
    immovable=st.sampled_from([0.0, 0.3, 1.0]),
)
def test_near_pairs_equal_those_of_all_pairs(
    seed: int, n: int, arrangement: str, octaves: float, size: float, immovable: float
) -> None:
    """Every near pair with a movable disc is returned exactly once, for reaches of any size, also below 0."""
    rng = np.random.default_rng(seed)
    position = draw_positions(arrangement, n, rng)
    reach = size * 2.0 ** -rng.uniform(0, octaves, n)
    movable = rng.random(n) >= immovable
    pairs = [pair for block in list_near_blocks(position, reach, movable) for pair in block]
    assert len(pairs) == len(set(pairs))
    assert set(pairs) == compare_all_pairs(position, reach, movable)


def test_blocks_are_ordered_by_their_second_discs() -> None:
    """If there are several blocks of pairs, all second discs of a block are below those of the next block."""
    n = 600
    blocks = list_near_blocks(np.zeros((n, 2)), np.full(n, 0.5), np.ones(n, np.bool_))
    assert len(blocks) > 1
    seconds = [[second for _, second in block] for block in blocks]
    assert all(max(one) < min(next_one) for one, next_one in itertools.pairwise(seconds))
    assert sum(map(len, blocks)) == n * (n - 1) // 2


@given(st.integers(0, 2**32 - 1), st.integers(1, 40), st.integers(0, 12))
def test_near_walls_equal_those_of_all_pairs(seed: int, discs: int, walls: int) -> None:
    """Each movable disc within its reach of a wall, or behind it, is returned with the wall, ordered by disc."""
    rng = np.random.default_rng(seed)
    position, reach, movable = rng.uniform(-5, 5, (discs, 2)), rng.uniform(0, 2, discs), rng.random(discs) < 0.7
    angle = rng.uniform(0, 2 * np.pi, walls)
    planes = np.stack([*rng.uniform(-9, 9, (2, walls)), np.cos(angle), np.sin(angle)], axis=1)
    expected = [
        (i, k)
        for i in range(discs)
        for k, (x, y, nx, ny) in enumerate(planes)
        if movable[i] and (position[i, 0] - x) * nx + (position[i, 1] - y) * ny <= reach[i]
    ]
    blocks = find_near_walls(position, reach, movable, planes)
    assert [pair for disc, wall in blocks for pair in zip(disc.tolist(), wall.tolist(), strict=True)] == expected
