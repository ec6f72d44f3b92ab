"""Each budget ends a run with a clear outcome and what was certified so far."""

import sys
from typing import Any

import numpy as np
import pytest
from tests.cases import each

from carom import Outcome, certify
from carom.errors import InputError, MissingExtraError
from carom.solvers.certified.result import Ending
from carom.studies.bench.gas import build_gas_scene

SCENE = build_gas_scene(9, 0.3, duration_s=1000.0)


def test_max_impacts_ends_a_certified_run_at_the_last_one() -> None:
    """A limit of 40 impacts certifies 40, and the run ends at the time of the last one."""
    certified = certify(SCENE, max_impacts=40)
    assert certified.ending is Ending.MAX_IMPACTS
    assert certified.trace.outcome is Outcome.MAX_IMPACTS
    assert len(certified) == 40
    assert certified.trace.end_time_s == certified.trace.impacts["time_s"][-1]


def test_precision_cap_keeps_the_certified_impacts() -> None:
    """At 96 bits a run ends with PRECISION_CAP, and its impacts agree with those of a more precise run."""
    capped = certify(SCENE, max_precision_bits=96)
    assert capped.ending is Ending.PRECISION_CAP
    assert capped.trace.outcome is Outcome.STOPPED
    assert 0 < len(capped) < 200
    more = certify(SCENE, max_impacts=len(capped))
    assert capped.trace.impacts[["first", "second"]].tolist() == more.trace.impacts[["first", "second"]].tolist()
    apart = np.abs(capped.trace.impacts["time_s"] - more.trace.impacts["time_s"])
    assert np.all(apart <= capped.radii["time_s"] + more.radii["time_s"])


def test_time_budget_keeps_the_certified_impacts() -> None:
    """A time budget of 1 ns ends the run after at least one and fewer than 100 certified impacts."""
    certified = certify(SCENE, time_budget_s=1e-9)
    assert certified.ending is Ending.TIME_BUDGET
    assert 0 < len(certified) < 100


def test_interrupt_keeps_the_certified_impacts() -> None:
    """Ctrl-C after 64 impacts returns these impacts and the state that belongs to them."""

    def interrupt(impacts: int, _time_s: float, _bits: int) -> None:
        if impacts >= 64:
            raise KeyboardInterrupt

    certified = certify(SCENE, progress=interrupt)
    assert certified.ending is Ending.INTERRUPTED
    whole = certify(SCENE, max_impacts=len(certified))
    assert len(certified) == 64
    assert certified.trace.impacts.tobytes() == whole.trace.impacts.tobytes()
    assert certified.trace.final_position_m.tobytes() == whole.trace.final_position_m.tobytes()


def test_interrupt_in_a_replay_keeps_earlier_impacts() -> None:
    """Ctrl-C in a replay at higher precision returns at least the impacts certified before the replay."""
    reached = [0]

    def interrupt(impacts: int, _time_s: float, bits: int) -> None:
        if bits > 300:
            raise KeyboardInterrupt
        reached[0] = impacts

    certified = certify(SCENE, progress=interrupt)
    assert certified.ending is Ending.INTERRUPTED
    assert len(certified) >= reached[0] > 64


def test_global_flint_precision_is_restored() -> None:
    """`certify` leaves the global precision of python-flint unchanged."""
    from flint import ctx

    before = ctx.prec
    certify(SCENE, max_impacts=3)
    assert ctx.prec == before


@each(
    "option, words",
    [
        ({"digits": 0}, "digits must be a whole number from 1 to 10000, got 0"),
        ({"digits": 10_001}, "digits must be a whole number from 1 to 10000, got 10001"),
        ({"max_impacts": -1}, "max_impacts must be a whole number, 0 or more, got -1"),
        ({"time_budget_s": float("nan")}, "time_budget_s must be a positive number of seconds, at most 1e7, got nan"),
        ({"tie_bits": 3}, "tie_bits must be a whole number from 64 to 1048576, got 3"),
    ],
)
def test_invalid_option_is_refused_with_name_and_value(option: dict[str, Any], words: str) -> None:
    """An option out of range raises an InputError with its name, range and value."""
    with pytest.raises(InputError, match=words):
        certify(SCENE, **option)


def test_missing_python_flint_error_has_the_install_command(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without python-flint, `certify` raises a MissingExtraError with the pip command."""
    monkeypatch.setitem(sys.modules, "flint", None)
    with pytest.raises(MissingExtraError, match=r"certify needs python-flint; pip install 'carom\[certify\]'"):
        certify(SCENE)
