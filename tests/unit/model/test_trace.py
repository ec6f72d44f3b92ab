"""The record of one run."""

import math
import pickle

import numpy as np
import pytest
from tests.scene_builders import disc_at, staged

from carom.model.energy import kinetic_energy
from carom.model.trace import IMPACT_DTYPE, ImpactRecord, Outcome, build_impact_array, wall_body, wall_index
from carom.solvers.pic import solve_pic

RECORD = ImpactRecord(1.5, 0, 3, (0.6, 0.8), (1.0, 2.0), (3.0, 4.0), (5.0, 6.0), (7.0, 8.0))


def test_impact_record_has_the_fields_of_the_array_in_order() -> None:
    """A record has the fields of an impact array in the same order, followed by the spins and the edge."""
    assert (*(IMPACT_DTYPE.names or ()), "spins", "edge") == ImpactRecord._fields


def test_impact_array_holds_every_field_of_every_record() -> None:
    """An array of records has all their fields and is read-only; without records it has the fields, too."""
    array = build_impact_array([RECORD, RECORD._replace(time_s=2.5, second=wall_body(1))])
    assert array.shape == (2,)
    assert array["time_s"].tolist() == [1.5, 2.5]
    assert array["second"].tolist() == [3, -2]
    for name in IMPACT_DTYPE.names or ():
        np.testing.assert_array_equal(array[name][0], getattr(RECORD, name))
    with pytest.raises(ValueError, match="read-only"):
        array["time_s"] = 0.0
    assert build_impact_array([])["velocity_first_after"].shape == (0, 2)
    assert [wall_body(k) for k in range(3)] == [-1, -2, -3]
    assert [wall_index(wall_body(k)) for k in range(3)] == [0, 1, 2]


def test_every_outcome_has_its_own_sentence() -> None:
    """The text of each outcome has more than three words and differs from the others, since reports show it."""
    texts = [outcome.value for outcome in Outcome]
    assert all(len(text.split()) > 3 for text in texts)
    assert len(set(texts)) == len(texts)


def test_kinetic_energy_counts_only_movable_discs() -> None:
    """Masses of 2 and 4 kg at 5 and 1 m/s have 25 J and 2 J; an immovable disc has none."""
    discs = disc_at(0, 0, 3, 4, r=1, m=2), disc_at(9, 0, 0, 1, r=1, m=4), disc_at(0, 9, r=1, m=math.inf)
    scene = staged("energy", *discs, duration_s=1)
    velocity = np.array([disc.velocity_m_s for disc in scene.discs])
    assert kinetic_energy(scene, velocity) == 27.0


def test_trace_survives_pickling() -> None:
    """A pickled trace keeps impacts, outcome, scene and final positions, so that workers can return it."""
    scene = staged("head-on", disc_at(0, 0, 1, 0), disc_at(3, 0), duration_s=3)
    trace = solve_pic(scene)
    copy = pickle.loads(pickle.dumps(trace))  # noqa: S301 - our own bytes
    assert copy.impacts.tobytes() == trace.impacts.tobytes()
    assert copy.outcome is trace.outcome
    assert copy.scene == scene
    np.testing.assert_array_equal(copy.final_position_m, trace.final_position_m)
