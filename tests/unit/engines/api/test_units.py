"""Scenes in an engine's own units: what is seen of them, taken back, is the run in metres and seconds, to the bit."""

import numpy as np
import pytest
from tests.cases import each
from tests.scene_builders import disc_at, require_value, staged, wall_at

from carom.engines.api import AdapterError, Contact, Observation, scaled, unscaled
from carom.solvers.pic import solve_pic

SCENE = staged(
    "thrown",
    disc_at(0.1, 2.3, 1.7, 0.3, r=0.3, m=1.3, spin_rad_s=2.1),
    disc_at(2.9, 2.4, -0.7, 0.1, r=0.4, m=2.7),
    wall_at(0.0, 0.1, 0.1, 1.0),
    restitution=0.9,
    friction=0.2,
    gravity_m_s2=(0.1, -3.3),
    duration_s=1.3,
)


@each("length, time", [(2.0**10, 1.0), (1.0, 2.0**-20), (2.0**-3, 2.0**5)])
def test_units_of_powers_of_two_keep_every_bit(length: float, time: float) -> None:
    """Impact times and the final state, solved in other units and converted back, have the same bits."""
    true, found = solve_pic(SCENE), solve_pic(scaled(SCENE, length=length, time=time))
    seen = Observation(found.final_position_m, found.final_velocity_m_s, (), "", found.final_spin_rad_s)
    end = unscaled(seen, length=length, time=time)
    assert len(true.impacts) > 2
    assert (found.impacts["time_s"] / time).tolist() == true.impacts["time_s"].tolist()
    assert end.position_m.tolist() == true.final_position_m.tolist()
    assert end.velocity_m_s.tolist() == true.final_velocity_m_s.tolist()
    assert require_value(end.spin_rad_s).tolist() == require_value(true.final_spin_rad_s).tolist()


def test_contacts_are_converted_back_to_si_units() -> None:
    """`unscaled` converts times to s and impulses to N s, and keeps missing impulses and the warning."""
    told = Contact(0, 1, 3.0, (1.0, 0.0), 40.0, tangential_impulse_n_s=-8.0)
    state = Observation(np.zeros((2, 2)), np.zeros((2, 2)), (told, Contact(0, -1, 3.0, (0.0, 1.0))), "hot")
    first, second = unscaled(state, length=4.0, time=0.5).contacts
    assert (first.time_s, first.impulse_n_s, first.tangential_impulse_n_s) == (6.0, 5.0, -1.0)
    assert (second.impulse_n_s, second.tangential_impulse_n_s) == (None, None)
    assert unscaled(state, time=0.5).warning == "hot"


@each("unit", [100.0, 0.1, 0.0, -2.0, float("inf"), float("nan")])
def test_units_other_than_powers_of_two_are_refused(unit: float) -> None:
    """Units that are not positive powers of two, such as 100 pixels per metre, would round and are refused."""
    with pytest.raises(AdapterError, match="length must be a power of two"):
        scaled(SCENE, length=unit)
    with pytest.raises(AdapterError, match="time must be a power of two"):
        scaled(SCENE, time=unit)
