import math
from collections.abc import Mapping

import pytest
from tests.scene_builders import disc_at, staged
from tests.unit.execution.stubs import Makes, Still

from carom.engines.api import Observation, Setting
from carom.errors import AdapterError
from carom.execution.observation import step_cutter
from carom.execution.observation.engine_run import observe_run
from carom.execution.observation.step_cutter import Cutter


class Runner:
    """A point on a line at 1 m/s that touches at given places, and is never turned back."""

    settings: Mapping[str, Setting] = {}

    def __init__(self, *spans: tuple[float, float]) -> None:
        self.spans, self.x, self.dt = spans, 0.0, 0.0

    def cut(self, dt_s: float) -> None:
        self.dt = dt_s

    def advance(self, steps: int) -> None:
        self.x += steps * self.dt

    def touching(self) -> frozenset[tuple[int, int]]:
        return frozenset((0, k + 1) for k, (start, end) in enumerate(self.spans) if start < self.x < end)

    def save(self) -> object:
        return self.x

    def restore(self, state: object) -> None:
        assert isinstance(state, float)
        self.x = state

    def observe(self) -> Observation:
        raise NotImplementedError

    def close(self) -> None:
        pass


def list_end_times(*spans: tuple[float, float], steps: int = 4, dt_s: float = 1.0) -> list[float]:
    cutter = Cutter(Runner(*spans))
    return [time for k in range(steps) for time in cutter.take_step(k * dt_s, (k + 1) * dt_s)]


def test_step_is_cut_just_after_a_contact_begins() -> None:
    """A step without contact is one piece; one with a contact is cut after it, by two units in the last place."""
    cutter = Cutter(Runner())
    assert [time for k in range(3) for time in cutter.take_step(k * 0.1, (k + 1) * 0.1)] == [0.1, 0.2, 3 * 0.1]
    assert (cutter.pieces, cutter.probes) == (3, 0)
    times = list_end_times((1.3, 9.0))
    assert times == [1.0, pytest.approx(1.3, abs=2 * math.ulp(1.3)), 2.0, 3.0, 4.0]
    assert times[1] > 1.3


def test_contacts_within_one_step_are_cut_in_order_of_time() -> None:
    """Two contacts that begin within one step give two cuts, the earlier one first."""
    times = list_end_times((2.75, 9.0), (2.125, 9.0))
    assert times == [1.0, 2.0, pytest.approx(2.125, abs=1e-15), pytest.approx(2.75, abs=1e-15), 3.0, 4.0]


def test_lasting_contact_cuts_only_one_step() -> None:
    """A contact over several steps cuts only the first, and one that is over at the end of its step cuts none."""
    assert len(list_end_times((0.5, 2.5))) == 5
    assert len(list_end_times((0.5, 1.5), (2.25, 2.75), steps=3)) == 4  # the second is over where nobody looks


def test_cutter_gives_up_after_too_many_pieces(monkeypatch: pytest.MonkeyPatch) -> None:
    """A step with more contacts than `MOST_PIECES` ends after that many pieces, and `has_too_many_pieces` is true."""
    monkeypatch.setattr(step_cutter, "MOST_PIECES", 5)
    cutter = Cutter(Runner(*((k / 64, 9.0) for k in range(1, 60))))
    assert len(list(cutter.take_step(0.0, 1.0))) == 5
    assert cutter.has_too_many_pieces


def test_world_that_cannot_be_cut_is_refused() -> None:
    """A located profile of a world without `cut`, `touching`, `save` and `restore` raises an AdapterError."""
    scene = staged("one", disc_at(0, 0, r=1), duration_s=1)
    with pytest.raises(AdapterError, match="cut, touching, save and restore"):
        observe_run(Makes(Still()), scene, "located", 0.1)
