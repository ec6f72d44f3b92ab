"""Friction and spin in the solvers: results, unchanged results, and refused scenes."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from tests.cases import each
from tests.scene_builders import disc_at, require_value, staged, wall_at, with_discs

from carom import Scene, solve_pic
from carom.engines.api import Capabilities, unsupported_reason
from carom.solvers.pit.solve import solve_pit


def build_pair(**fields: Any) -> Scene:
    """Return two discs, of which the first, spinning, hits the other off its centre."""
    discs = [disc_at(0, 0, 4, 0, spin_rad_s=3.0), disc_at(3, 0.5, 0, 0, r=0.75, m=2.0)]
    return Scene(**{"name": "pair", "discs": discs, "duration_s": 2.0, **fields})


def build_box(**fields: Any) -> Scene:
    """Return a disc that falls into a corner of two walls, and another above."""
    discs = [disc_at(2, 3, -3, -2, spin_rad_s=-1.0), disc_at(4, 3, -4, -2)]
    walls = [wall_at(0, 0, 1, 0), wall_at(0, 0, 0, 1)]
    return Scene(**{"name": "box", "discs": discs, "walls": walls, "duration_s": 3.0, **fields})


def test_spin_without_friction_changes_no_impact() -> None:
    """Without friction, spinning discs have the impacts of non-spinning ones, and their spins stay constant."""
    spinning = build_pair()
    still = with_discs(spinning, spin_rad_s=0.0)
    for solve in (solve_pic, solve_pit):
        one, other = solve(spinning), solve(still)
        assert one.impacts.tobytes() == other.impacts.tobytes()
        assert one.final_velocity_m_s.tobytes() == other.final_velocity_m_s.tobytes()
        assert require_value(one.final_spin_rad_s).tolist() == [3.0, 0.0]
        assert require_value(one.spins).tolist() == [(3.0, 0.0, 3.0, 0.0)]
        assert other.spins is None
        assert other.final_spin_rad_s is None


def test_recording_options_change_no_spin() -> None:
    """A run without records has the same final spins, and a window has the spins of its own impacts."""
    scene = build_box(friction=0.3, wall_friction=0.4)
    whole, none = solve_pic(scene), solve_pic(scene, record="none")
    assert len(require_value(none.spins)) == 0
    assert require_value(none.final_spin_rad_s).tolist() == require_value(whole.final_spin_rad_s).tolist()
    assert len(whole.impacts) >= 3
    begin = float(whole.impacts["time_s"][1])
    part = solve_pic(scene, window_s=(begin, math.inf))
    assert require_value(part.spins).tobytes() == require_value(whole.spins)[1:].tobytes()


def test_right_angled_corner_is_ambiguous_only_with_friction() -> None:
    """Simultaneous impacts on perpendicular walls are ambiguous with friction, and not without."""
    # Into a corner with (-3, -2), friction 1/4: x first gives (22/9, 4/3) and spin -22/9, y first (2, 2) and spin 2.
    # PIC takes the lower body number first, which is the second wall; PIT tests the first wall first.
    corner = wall_at(-1, 0, 1, 0), wall_at(0, -1, 0, 1)
    smooth = staged("corner", disc_at(3, 2, -3, -2, r=1), *corner, duration_s=2.0)
    rough = Scene(**{**smooth.model_dump(), "wall_friction": 0.25})
    for solve, expected in ((solve_pic, (2.0, 2.0, 2.0)), (solve_pit, (22 / 9, 4 / 3, -22 / 9))):
        assert solve(smooth).ambiguous == ()
        trace = solve(rough)
        assert trace.ambiguous == (1,)
        end = (*trace.final_velocity_m_s[0].tolist(), require_value(trace.final_spin_rad_s)[0])
        assert end == pytest.approx(expected, rel=1e-14)


def test_pit_velocities_on_rough_walls_equal_those_of_pic() -> None:
    """PIT finds impacts with rough walls late, but with exactly PIC's velocities and spins."""
    bodies = disc_at(0, 1, 3, -2.7, r=0.4, spin_rad_s=1.0), wall_at(0, 0, 0, 1), wall_at(0, 3, 0, -1)
    scene = staged("strip", *bodies, wall_friction=0.2, wall_restitution=0.9, duration_s=4.0)
    late, right = solve_pit(scene, frame_rate_hz=24.0), solve_pic(scene)
    assert len(right.impacts) > 3
    most = min(len(late.impacts), len(right.impacts))
    assert most >= len(right.impacts) - 1
    for name in ("velocity_first_before", "velocity_first_after"):
        assert late.impacts[name][:most].tolist() == right.impacts[name][:most].tolist()
    assert require_value(late.spins)[:most].tolist() == require_value(right.spins)[:most].tolist()


def test_repeated_impact_in_the_tc_model_loses_no_energy() -> None:
    """In the TC model an impact soon after the disc's last one is elastic and changes no spin."""
    scene = build_box(friction=0.3, wall_friction=0.4, restitution=0.5, wall_restitution=0.5)
    trace = solve_pic(scene, contact_duration_s=10.0)
    seen: set[int] = set()
    for impact, spins in zip(trace.impacts, require_value(trace.spins), strict=True):
        bodies = {int(impact[side]) for side in ("first", "second")} - {-1, -2}
        before = np.stack([impact["velocity_first_before"], impact["velocity_second_before"]])
        after = np.stack([impact["velocity_first_after"], impact["velocity_second_after"]])
        lost = (before**2).sum() - (after**2).sum()
        if bodies & seen:
            assert abs(lost) < 1e-12
            assert spins["first_before"] == spins["first_after"]
        else:
            assert lost > 0.1
        seen |= bodies


#: A method that rubs and turns discs, and discs that rub and don't spin, some of which can't turn.
ABLE = Capabilities(spin=True, friction=(0.0, 1.0), tangential_restitution=True)
STILL = with_discs(build_pair(), spin_rad_s=0.0).discs
RUBS = {"discs": STILL, "friction": 0.5, "tangential_restitution": 0.5}
HELD = with_discs(build_pair(), spin_rad_s=0.0, inertia_factor=math.inf).discs


@each(
    "fields, able, reason",
    [
        ({}, Capabilities(), "the scene has spinning discs, which this method does not support"),
        ({"friction": 0.5}, Capabilities(), "the scene has spinning discs, which this method does not support"),
        (RUBS, ABLE, ""),
        (RUBS, replace(ABLE, spin=False), "on discs that can turn, and this method does not turn discs"),
        ({"discs": HELD, "friction": 0.5}, replace(ABLE, spin=False), ""),
        (RUBS, replace(ABLE, friction=(0.0, 0.25)), "friction is 0.5, and this method simulates only 0 to 0.25"),
        (RUBS, replace(ABLE, tangential_restitution=False), "tangential restitution"),
        (RUBS, Capabilities(), "the scene has friction, which this method does not support"),
        ({"discs": STILL, "wall_friction": 9.0}, Capabilities(), ""),
        ({}, replace(ABLE, max_spin_rad_s=3.0), ""),
        ({}, replace(ABLE, max_spin_rad_s=2.0), "a disc spins at 3 rad/s, and this method's limit is 2 rad/s"),
        ({}, replace(ABLE, max_turn_rad=1.5), ""),
        ({}, replace(ABLE, max_turn_rad=1.25), "turns by 1.5 rad in a step of 0.5 s"),
    ],
)
def test_skip_reason_names_undeclared_spin_friction_or_turning(
    fields: dict[str, Any], able: Capabilities, reason: str
) -> None:
    """The reason to skip a method names the spin, friction or turn per step beyond its declared limits."""
    found = unsupported_reason(build_pair(**fields), able, 0.5)
    assert reason in found
    assert bool(reason) == bool(found)
