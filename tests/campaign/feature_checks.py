"""Checks of PIC on one scene: with a certified run, rotated and reordered, in pieces, and by all pairs."""

import contextlib
import random
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from functools import cached_property
from types import FrameType
from typing import NamedTuple

import numpy as np
from tests.campaign.comparison import COUNTED, Difference, Kind, compare_with_envelope
from tests.campaign.envelope import Envelope, alarm, compute_envelope
from tests.campaign.events import Record
from tests.campaign.transformation import restore_record, rotate_scene, turn_quarter_back
from tests.transformed_scenes import turn_quarter
from tests.unit.solvers.run_kinds import collect_run_bits

from carom import Outcome, Scene, Trace, solve_pic
from carom.core.resolution import clock_resolution
from carom.solvers.pic import start_pic_run
from carom.solvers.run import Run

#: Impacts over which a scene is followed.
MOST_IMPACTS = 40
#: Impacts by which a certified run goes beyond those of PIC.
MORE_CERTIFIED = 20
#: Seconds of processor time of a run whose time stands still, and of all checks of a scene.
STANDSTILL_S, SCENE_S = 2.0, 30.0
#: Seconds that each check has, whatever those before it took.
LEAST_S = 1.0
#: Number of impacts at one instant after which a run must end by itself.
AT_ONE_INSTANT = 12
#: Pieces that a run is cut into.
PIECES = 12


class Check(StrEnum):
    """Kind of check; its value is its name in tables."""

    CERTIFIED = "certified run"
    ROTATED = "rotated by 90 degrees"
    REORDERED = "rotated and reordered"
    PIECES = "in pieces"
    ALL_PAIRS = "by all pairs"
    TIME_LIMIT = "time limit"
    PROCESS = "process"


class Finding(NamedTuple):
    """A difference: the check, its kind, and a sentence."""

    check: Check
    kind: str
    text: str


@dataclass
class CheckedScene:
    """Result of the checks of a scene.

    Attributes:
        impacts: Impacts of PIC.
        certified: How many of these were compared with a certified run.
        modes: Changes of modes that were compared with a certified run.
        low_hops: Whether contact begins where hops are lower than the resolution of a gap.
        kept_contact: Whether contact goes on where rounding decides whether a disc hops.
        findings: The first difference of each kind and check.
        seconds: Processor time.
    """

    impacts: int = 0
    certified: int = 0
    modes: int = 0
    low_hops: bool = False
    kept_contact: bool = False
    findings: list[Finding] = field(default_factory=list)
    seconds: float = 0.0


class OutOfTimeError(BaseException):
    """The processor time of a check is used up. It is no `Exception`, so that no solver catches it."""


@contextlib.contextmanager
def time_limit(seconds: float) -> Iterator[None]:
    """Raise `OutOfTimeError` in the block after some seconds of processor time."""

    def end(_signal: int, _frame: FrameType | None) -> None:
        raise OutOfTimeError

    with alarm(seconds, end):
        yield


def all_pairs_run(scene: Scene) -> Run:
    """Return a run that tests all pairs of bodies for impacts, without cells."""
    return start_pic_run(scene, all_pairs=True)


def check_scene(scene: Scene, solve: Callable[..., Trace] = solve_pic) -> CheckedScene:
    """Run all checks of a scene."""
    found, begin_s = CheckedScene(), time.process_time()
    trace, envelope, bits = list[Trace](), list[Envelope](), Bits(scene)

    def solve_scene() -> Iterator[Finding]:
        trace.append(solve(scene, max_impacts=MOST_IMPACTS))
        found.impacts = len(trace[0].impacts)
        yield from _find_no_end(scene, trace[0])

    def compare_with_certified() -> list[Finding]:
        record, most = Record.of(trace[0]), len(trace[0].impacts) + MORE_CERTIFIED
        envelope.append(compute_envelope(scene, trace[0], most, solve))
        until_s = min(envelope[0].horizon_s, envelope[0].certified_s)
        found.certified = int(np.sum(record.impacts["time_s"] <= until_s))
        found.modes = 0 if record.modes is None else int(np.sum(record.modes["time_s"] <= until_s))
        differences = compare_with_envelope(scene, envelope[0], record)
        kinds = {difference.kind for difference in differences}
        found.low_hops, found.kept_contact = Kind.LOW_HOPS in kinds, Kind.KEPT_CONTACT in kinds
        return _first_of_each_kind(Check.CERTIFIED, differences)

    checks: dict[Check, Callable[[], Iterable[Finding]]] = {
        Check.TIME_LIMIT: solve_scene,
        Check.CERTIFIED: compare_with_certified,
        Check.REORDERED: lambda: _first_of_each_kind(Check.REORDERED, _of_reordered(scene, solve, envelope[0])),
        Check.ROTATED: lambda: _find_unlike_rotated(trace[0], solve),
        Check.PIECES: lambda: bits.find_unlike(Check.PIECES),
        Check.ALL_PAIRS: lambda: bits.find_unlike(Check.ALL_PAIRS),
    }
    for check, find in checks.items():
        left_s = SCENE_S - (time.process_time() - begin_s)
        try:
            with time_limit(max(LEAST_S, left_s)):
                found.findings += find()
        except OutOfTimeError:
            found.findings.append(Finding(Check.TIME_LIMIT, f"no end of {check.value}", f"it takes {left_s:.1f} s"))
        except Exception as error:  # noqa: BLE001 - whatever a solver raises is a finding
            text = f"raised {type(error).__name__}: {error}"
            found.findings.append(Finding(check, type(error).__name__, text))
        if not (trace and (envelope or check is Check.TIME_LIMIT)):
            break
    found.seconds = time.process_time() - begin_s
    return found


def _first_of_each_kind(check: Check, differences: Sequence[Difference]) -> list[Finding]:
    first = {difference.kind: difference for difference in reversed(differences)}
    return [Finding(check, kind.value, difference.text) for kind, difference in first.items() if kind not in COUNTED]


def _of_reordered(scene: Scene, solve: Callable[..., Trace], envelope: Envelope) -> list[Difference]:
    """Compare a run of the rotated scene, with its discs in reverse order, with the envelope of the scene."""
    trace = solve(rotate_scene(scene, turn_quarter, is_reversed=True), max_impacts=MOST_IMPACTS)
    return compare_with_envelope(scene, envelope, restore_record(Record.of(trace), turn_quarter_back, is_reversed=True))


def _find_no_end(scene: Scene, trace: Trace) -> Iterator[Finding]:
    """Yield a finding if the time of a run stands still and the run does not end within its time limit."""
    times = trace.impacts["time_s"]
    if trace.outcome is not Outcome.MAX_IMPACTS or len(times) < AT_ONE_INSTANT:
        return
    last_s = float(times[-1])
    if last_s - float(times[-AT_ONE_INSTANT]) > 2.0 * clock_resolution(last_s):
        return
    run, until_s = start_pic_run(scene), min(scene.duration_s, last_s + 4.0 * clock_resolution(last_s))
    try:
        with time_limit(STANDSTILL_S):
            run.advance_to(until_s)
    except OutOfTimeError:
        text = f"{len(run.log)} impacts up to {float(run.log.array()['time_s'][-1])!r} s, no end in {STANDSTILL_S:g} s"
        yield Finding(Check.TIME_LIMIT, "time stands still", text)


# Bits -----------------------------------------------------------------------------------------------------------------


class Bits:
    """Bits of a run of PIC, compared with those of a run in pieces and of a run by all pairs."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene

    @cached_property
    def _expected(self) -> tuple[dict[str, object], float]:
        run = start_pic_run(self._scene)
        return _take_at_once(run, self._scene), run.time_s

    def find_unlike(self, check: Check) -> Iterator[Finding]:
        """Yield a finding if a run in pieces, or by all pairs, has other bits."""
        expected, end_s = self._expected
        if check is Check.PIECES:
            found = _take_in_pieces(start_pic_run(self._scene), self._scene, end_s)
        else:
            found = _take_at_once(all_pairs_run(self._scene), self._scene)
        unlike = [name for name, value in expected.items() if found[name] != value]
        if unlike:
            yield Finding(check, "other bits", f"other bits in {', '.join(unlike)}")


def _find_unlike_rotated(trace: Trace, solve: Callable[..., Trace]) -> Iterator[Finding]:
    """Yield a finding if the run of the rotated scene is not bit-identical to the rotated run."""
    turned = solve(rotate_scene(trace.scene, turn_quarter), max_impacts=MOST_IMPACTS)
    unlike = unlike_fields(Record.of(trace), restore_record(Record.of(turned), turn_quarter_back))
    if unlike:
        yield Finding(Check.ROTATED, "other bits", f"other bits in {', '.join(unlike)}")


def unlike_fields(one: Record, other: Record) -> list[str]:
    """Return the fields in which two records differ; 0 and -0 are one number."""
    found = []
    for name in Record.__dataclass_fields__:
        a, b = getattr(one, name), getattr(other, name)
        if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
            names = a.dtype.names or (None,)
            same = a.shape == b.shape and all(
                np.array_equal(a if part is None else a[part], b if part is None else b[part]) for part in names
            )
        else:
            same = a == b
        if not same:
            found.append(name)
    return found


def _take_at_once(run: Run, scene: Scene) -> dict[str, object]:
    return collect_run_bits(run, run.advance_to(scene.duration_s, MOST_IMPACTS))


def _take_in_pieces(run: Run, scene: Scene, ends_s: float) -> dict[str, object]:
    """Advance a run in pieces, by time and by impacts, and read its results between them."""
    rng = random.Random(scene.name)
    for time_s in sorted(rng.uniform(0.0, ends_s) for _ in range(PIECES)):
        outcome = run.advance_to(time_s, rng.choice((MOST_IMPACTS, rng.randint(0, MOST_IMPACTS))))
        collect_run_bits(run, outcome)
    return _take_at_once(run, scene)
