"""Functions that several attacks need: a time limit, random damage, saved inputs, and a search for leftovers."""

import json
import os
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from hashlib import sha256
from pathlib import Path
from random import Random
from typing import Any

from tests.processes import PATIENT_S, is_alive

from carom.errors import CaromError
from carom.support.escaping import escape_controls

#: What takes more processor time counts as a hang, in seconds.
HANG_S = 10.0
#: Code that waits for ever uses no processor time. It may take this many times the limit by the clock.
_BUSY = 20.0
#: A signal is repeated after so long, in seconds: Python can be about to sleep when the first comes, and sleep on.
_AGAIN_S = 0.1


class HangError(BaseException):
    """Nothing that is attacked catches it."""


@contextmanager
def limit_time(limit_s: float = HANG_S, busy: float = _BUSY) -> Iterator[None]:
    """Raise `HangError` if the body takes longer.

    Args:
        limit_s: Processor time of this process, in seconds, so that a busy machine counts for nothing.
        busy: Multiple of the limit that the body may take by the clock.
    """
    timers = {signal.ITIMER_PROF: limit_s, signal.ITIMER_REAL: busy * limit_s}

    def stop() -> None:
        for timer in timers:
            signal.setitimer(timer, 0.0)

    def late(*_: object) -> None:
        stop()
        raise HangError

    before = {number: signal.signal(number, late) for number in (signal.SIGPROF, signal.SIGALRM)}
    try:
        for timer, seconds in timers.items():
            signal.setitimer(timer, seconds, _AGAIN_S)
        yield
    finally:
        stop()
        for number, handler in before.items():
            signal.signal(number, handler)


def try_act(act: Callable[[], str], *names: str, most: int = 2000, limit_s: float = HANG_S, busy: float = _BUSY) -> str:
    """Return the loss that an act returns or raises. A refusal in a sentence that contains one of `names` is no loss.

    A sentence shows no control characters, and has a limited length.
    """
    try:
        with limit_time(limit_s, busy):
            return act()
    except CaromError as error:
        text = str(error)
        sentence = escape_controls(text) == text and len(text) < most and any(name in text for name in names)
        return "" if sentence else f"{type(error).__name__} without one of {names}: {text[:300]!r}"
    except HangError:
        return f"no end after {limit_s:g} s"
    except Exception as error:  # noqa: BLE001 - this is what is looked for
        return f"{type(error).__name__}: {str(error)[:300]!r}"


#: Values that JSON can hold.
PIECES: tuple[Any, ...] = (
    *(None, True, False, 0, -1, 5, 10**20, 10**400, 0.0, -0.5, 5e-324, 1e308, float("nan"), float("inf"), "", "x"),
    *("inf", "é\n", "\ud800", "\x1b[31m", "ran", "wrong", "9" * 400),
    *([], [[]], [1], ["a"], {}, {"a": []}, {"": None}, [{"verdict": "x"}]),
)


def spoil(rng: Random, value: Any) -> Any:
    """Return a copy of a value of JSON in which one thing is replaced, taken away or doubled."""
    if isinstance(value, dict) and value and rng.random() < 0.9:
        key = rng.choice([*value])
        if rng.random() < 0.1:
            return {name: one for name, one in value.items() if name != key}
        return {**value, key: spoil(rng, value[key])}
    if isinstance(value, list) and value and rng.random() < 0.9:
        k = rng.randrange(len(value))
        return [*value[:k], spoil(rng, value[k]), *value[k + rng.choice((1, 1, 0, 2)) :]]
    return rng.choice(PIECES)


def check_strict_json(lines: str) -> None:
    """Raise a ValueError if a line is no JSON, or contains NaN or infinity."""

    def refuse(name: str) -> None:
        raise ValueError(name)

    for line in lines.splitlines():
        json.loads(line, parse_constant=refuse)


def save_input(folder: Path, suffix: str, data: bytes) -> str:
    """Keep an input with which something was lost, and return a reference to its file."""
    path = folder / f"found-{sha256(data).hexdigest()[:16]}{suffix}"
    path.write_bytes(data)
    return f"see {path.name}"


def find_leftovers(mark: str, temporary: Path) -> str:
    """Return the processes with `mark` in their environment, and the folders of Carom's, that remain after a while."""
    until = time.monotonic() + PATIENT_S
    while True:
        pids = [pid for pid in map(int, filter(str.isdigit, os.listdir("/proc"))) if _has_mark(pid, mark)]
        folders = sorted(os.listdir(temporary)) if temporary.exists() else []
        if not pids and not folders:
            return ""
        if time.monotonic() > until:
            return f"left over: processes {pids}, folders {folders}"
        time.sleep(0.05)


def _has_mark(pid: int, mark: str) -> bool:
    try:
        return is_alive(pid) and pid != os.getpid() and mark.encode() in Path(f"/proc/{pid}/environ").read_bytes()
    except OSError:
        return False
