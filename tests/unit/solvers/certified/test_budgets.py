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


def test_a_limit_on_impacts() -> None:
    """The requested impacts are certified, and the final state is that at the last of them."""
    certified = certify(SCENE, max_impacts=40)
    assert certified.ending is Ending.MAX_IMPACTS
    assert certified.trace.outcome is Outcome.MAX_IMPACTS
    assert len(certified) == 40
    assert certified.trace.end_time_s == certified.trace.impacts["time_s"][-1]


def test_a_precision_cap_keeps_what_it_allows() -> None:
    """At 96 bits some dozens of impacts are known to 15 digits; they are those of a run with more bits."""
    capped = certify(SCENE, max_precision_bits=96)
    assert capped.ending is Ending.PRECISION_CAP
    assert capped.trace.outcome is Outcome.STOPPED
    assert 0 < len(capped) < 200
    more = certify(SCENE, max_impacts=len(capped))
    assert capped.trace.impacts[["first", "second"]].tolist() == more.trace.impacts[["first", "second"]].tolist()
    apart = np.abs(capped.trace.impacts["time_s"] - more.trace.impacts["time_s"])
    assert np.all(apart <= capped.radii["time_s"] + more.radii["time_s"])


def test_a_time_budget_keeps_what_was_reached() -> None:
    """A budget that is used up at once still ends at a certified impact."""
    certified = certify(SCENE, time_budget_s=1e-9)
    assert certified.ending is Ending.TIME_BUDGET
    assert 0 < len(certified) < 100


def test_an_interrupt_keeps_the_prefix() -> None:
    """Ctrl-C in the middle returns what was certified before it, with a final state that belongs to it."""

    def interrupt(impacts: int, _time_s: float, _bits: int) -> None:
        if impacts >= 64:
            raise KeyboardInterrupt

    certified = certify(SCENE, progress=interrupt)
    assert certified.ending is Ending.INTERRUPTED
    whole = certify(SCENE, max_impacts=len(certified))
    assert len(certified) == 64
    assert certified.trace.impacts.tobytes() == whole.trace.impacts.tobytes()
    assert certified.trace.final_position_m.tobytes() == whole.trace.final_position_m.tobytes()


def test_an_interrupt_in_a_replay_keeps_what_was_certified_before_it() -> None:
    """The replay at a higher precision is not worth less than the attempt before it."""
    reached = [0]

    def interrupt(impacts: int, _time_s: float, bits: int) -> None:
        if bits > 300:
            raise KeyboardInterrupt
        reached[0] = impacts

    certified = certify(SCENE, progress=interrupt)
    assert certified.ending is Ending.INTERRUPTED
    assert len(certified) >= reached[0] > 64


def test_the_precision_of_python_flint_is_left_as_it_was() -> None:
    """The global precision is restored, whatever happens."""
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
def test_bad_options_are_refused(option: dict[str, Any], words: str) -> None:
    """The message names the option and its value."""
    with pytest.raises(InputError, match=words):
        certify(SCENE, **option)


def test_without_python_flint_the_error_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    """The message holds the command that installs it."""
    monkeypatch.setitem(sys.modules, "flint", None)
    with pytest.raises(MissingExtraError, match=r"certify needs python-flint; pip install 'carom\[certify\]'"):
        certify(SCENE)
