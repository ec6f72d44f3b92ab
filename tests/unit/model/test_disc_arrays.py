"""A start as arrays: what is refused, and what a scene keeps of its own."""

import math

import numpy as np
import pytest
from tests.cases import each
from tests.scene_builders import disc_at, staged, wall_at

from carom.errors import InputError
from carom.model.disc_arrays import DiscArrays


def build_two_discs(**changed: object) -> DiscArrays:
    fields = {
        "position_m": np.array([[0.0, 0.0], [3.0, 0.0]]),
        "velocity_m_s": np.zeros((2, 2)),
        "radius_m": np.full(2, 0.5),
        "mass_kg": np.ones(2),
    }
    return DiscArrays(**{**fields, **changed})  # type: ignore[arg-type]  # some are wrong on purpose


@each(
    "changed, words",
    [
        ({"position_m": np.zeros((0, 2))}, "position_m must hold at least one disc"),
        ({"radius_m": np.ones(3)}, r"radius_m must have the shape \(2,\), got \(3,\)"),
        ({"velocity_m_s": np.full((2, 2), math.nan)}, "velocity_m_s must be finite"),
        ({"mass_kg": np.array([1.0, 0.0])}, "mass_kg must be above 0"),
        ({"mass_kg": np.array([1.0, math.inf]), "velocity_m_s": np.ones((2, 2))}, r"must be \(0, 0\) for an immovable"),
        ({"walls": (wall_at(0, -3, 0, 2),)}, r"walls\[0\] must be four numbers"),
        ({"walls": ((0.0, -3.0, 0.0, 2.0),)}, r"walls\[0\] must have a normal of length 1"),
        ({"restitution": 1.5}, "must be from 0 to 1"),
        ({"wall_friction": math.nan}, "wall_friction must be from 0 to 6.7"),
        ({"inertia_factor": np.array([0.5, 0.0])}, "inertia_factor must be"),
        ({"spin_rad_s": np.array([0.0, math.nan])}, "radius_m times spin_rad_s must be finite"),
        ({"spin_rad_s": np.ones(2), "inertia_factor": np.array([0.5, math.inf])}, "spin_rad_s must be 0 for a disc"),
    ],
)
def test_invalid_arrays_are_refused(changed: dict[str, object], words: str) -> None:
    """Shapes and values that no disc or wall can have are refused with a message that names the field."""
    with pytest.raises(InputError, match=words):
        build_two_discs(**changed)


def test_arrays_of_a_scene_are_read_only() -> None:
    """The arrays of a scene, which all solvers share, can't be written to."""
    with pytest.raises(ValueError, match="read-only"):
        staged("one", disc_at(0, 0), duration_s=1.0).arrays.position_m[0, 0] = 1.0
