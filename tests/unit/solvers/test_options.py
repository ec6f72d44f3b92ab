"""All functions refuse invalid options with the same message, and a state continues only its own scene."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from tests.cases import each
from tests.scene_builders import disc_at, staged, wall_at

from carom import solve_pic
from carom.errors import InputError
from carom.model.disc_arrays import DiscArrays
from carom.solvers.event_driven.run import EventDrivenRun
from carom.solvers.options import RunOptions

from .run_kinds import RUNS, all_pairs

SCENE = staged("pair", disc_at(0, 0, 1, 0), disc_at(3, 0), wall_at(9, 0, -1, 0), duration_s=4)

DOORS: dict[str, Callable[..., Any]] = {
    "RunOptions": RunOptions,
    "solve_pic": lambda **asked: solve_pic(SCENE, **asked),
    "EventDrivenRun": lambda **asked: EventDrivenRun(SCENE, **asked),
    "all pairs": lambda **asked: all_pairs(SCENE, **asked),
}

REFUSED: list[tuple[dict[str, Any], str]] = [
    ({"record": "some"}, "record must be 'all' or 'none', got 'some'"),
    ({"record": ["all"]}, "record must be 'all' or 'none', got ['all']"),
    ({"window_s": (math.nan, math.nan)}, "window_s must be a pair of times, got (nan, nan)"),
    ({"window_s": (0.0, math.nan)}, "window_s must be a pair of times, got (0.0, nan)"),
    ({"window_s": (1.0,)}, "window_s must be a pair of times, got (1.0,)"),
    ({"window_s": None}, "window_s must be a pair of times, got None"),
    ({"contact_duration_s": math.inf}, "contact_duration_s must be a finite number, 0 or more, got inf"),
    ({"contact_duration_s": math.nan}, "contact_duration_s must be a finite number, 0 or more, got nan"),
    ({"contact_duration_s": -1.0}, "contact_duration_s must be a finite number, 0 or more, got -1.0"),
    ({"contact_duration_s": True}, "contact_duration_s must be a finite number, 0 or more, got True"),
]


@each("door", DOORS)
@each("asked, message", REFUSED)
def test_invalid_option_has_the_same_error_at_every_entry_point(door: str, asked: dict[str, Any], message: str) -> None:
    """An option out of range raises the same InputError, with its name and value, at every entry point."""
    with pytest.raises(InputError) as refusal:
        DOORS[door](**asked)
    assert str(refusal.value) == message


@each("name", RUNS)
@each(
    "goal, message",
    [
        ((math.nan,), "time_s must be a number of seconds, got nan"),
        (("3",), "time_s must be a number of seconds, got '3'"),
        ((None,), "time_s must be a number of seconds, got None"),
        ((3.0, -1), "max_impacts must be a whole number, 0 or more, got -1"),
        ((3.0, 1.5), "max_impacts must be a whole number, 0 or more, got 1.5"),
        ((3.0, True), "max_impacts must be a whole number, 0 or more, got True"),
    ],
)
def test_invalid_goal_has_the_same_error_in_every_run(name: str, goal: tuple[Any, ...], message: str) -> None:
    """An invalid time or impact limit raises the same InputError in every run, which is not advanced."""
    run = RUNS[name](SCENE)
    with pytest.raises(InputError) as refusal:
        run.advance_to(*goal)
    assert str(refusal.value) == message
    assert run.time_s == 0.0
    assert len(run.log) == 0


def build_rough_start(**changes: Any) -> DiscArrays:
    position, velocity = np.array([[0.0, 0.0], [3.0, 0.0], [6.0, 1.0]]), np.array([[1.0, 0.0], [0.0, 0.0], [0.0, 0.0]])
    fields = {"radius_m": np.full(3, 0.5), "mass_kg": np.ones(3), "inertia_factor": np.full(3, 0.5), "friction": 0.25}
    walls = ((9.0, 0.0, -1.0, 0.0),)
    return DiscArrays(**{"position_m": position, "velocity_m_s": velocity, "walls": walls, **fields, **changes})


@each(
    "name, value, message",
    [
        ("radius_m", np.array([0.5, 0.5, 0.25]), "disc 2 differs, and 0 other discs"),
        ("radius_m", np.full(3, 0.25), "disc 0 differs, and 2 other discs"),
        ("mass_kg", np.array([1.0, 2.0, 1.0]), "disc 1 differs, and 0 other discs"),
        ("mass_kg", np.array([1.0, math.inf, 1.0]), "disc 1 differs, and 0 other discs"),
        ("inertia_factor", np.array([0.5, 0.5, 1.0]), "disc 2 differs, and 0 other discs"),
        ("walls", ((8.0, 0.0, -1.0, 0.0),), "((8.0, 0.0, -1.0, 0.0),), got ((9.0, 0.0, -1.0, 0.0),)"),
        ("walls", (), "(), got ((9.0, 0.0, -1.0, 0.0),)"),
        ("restitution", 0.5, "0.5, got 1.0"),
        ("wall_restitution", 0.5, "0.5, got 1.0"),
        ("friction", 0.5, "0.5, got 0.25"),
        ("wall_friction", 0.5, "0.5, got 0.0"),
        ("tangential_restitution", 0.5, "0.5, got 0.0"),
        ("wall_tangential_restitution", 0.5, "0.5, got 0.0"),
    ],
)
def test_resuming_from_another_scene_names_the_difference(name: str, value: Any, message: str) -> None:
    """Resuming from the state of another scene raises an InputError with the field and the values that differ."""
    # Another initial position is allowed: positions are part of the state.
    run = EventDrivenRun(build_rough_start())
    run.advance_to(1.0)
    with pytest.raises(InputError) as refusal:
        EventDrivenRun(build_rough_start(**{name: value}), resume=run.state())
    assert str(refusal.value) == f"resume must be the state of a run of the same {name}: {message}"
    elsewhere = build_rough_start(position_m=build_rough_start().position_m + 0.25)
    assert EventDrivenRun(elsewhere, resume=run.state()).positions().tobytes() == run.positions().tobytes()


def test_resuming_with_other_wall_materials_is_refused() -> None:
    """Resuming a run from the state of a scene with another wall restitution raises an InputError."""
    one, other = (
        staged("one", disc_at(0, 0, 1), wall_at(2, 0, -1, 0, restitution=e), duration_s=1) for e in (0.5, 0.25)
    )
    with pytest.raises(InputError, match="must be the state of a run of the same wall_materials"):
        EventDrivenRun(one, resume=EventDrivenRun(other).state())


def test_resuming_from_an_incompatible_state_is_refused() -> None:
    """A state with another disc count, spin or contact time, or an object that is no state, is refused."""
    smooth = {"friction": 0.0, "inertia_factor": None}
    state, bare = EventDrivenRun(build_rough_start()).state(), EventDrivenRun(build_rough_start(**smooth)).state()
    fewer = DiscArrays(np.zeros((1, 2)), np.zeros((1, 2)), np.full(1, 0.5), np.ones(1))
    for start, resume, message in (
        (fewer, state, "a run of 1 discs, got a state of 3"),
        (build_rough_start(), bare, "a run with friction or spin, like this run, got a state without"),
        (build_rough_start(**smooth), state, "a run without friction or spin, like this run, got a state with"),
    ):
        with pytest.raises(InputError) as refusal:
            EventDrivenRun(start, resume=resume)
        assert str(refusal.value) == f"resume must be the state of {message}"
    with pytest.raises(InputError, match=r"a run of the same contact_duration_s: 0\.5, got 0\.0"):
        EventDrivenRun(build_rough_start(), contact_duration_s=0.5, resume=state)
    wrong: Any = {"time_s": 1.0}
    with pytest.raises(InputError, match=r"resume must be what EventDrivenRun.state\(\) returns, got {'time_s': 1.0}"):
        EventDrivenRun(build_rough_start(), resume=wrong)
