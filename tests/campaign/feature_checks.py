"""Checks of PIC on one scene: with a certified run, rotated and reordered, in pieces, and by all pairs."""

import contextlib
import random
import signal
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from enum import StrEnum
from functools import cached_property, partial
from types import FrameType

import numpy as np
from tests.campaign.campaign import Checked, Finding
from tests.campaign.certified_comparison import COUNTED, compare_with_certified, reliable_until
from tests.campaign.comparison import Difference, Kind, Record, compare_with_envelope
from tests.campaign.copies import Copies
from tests.campaign.envelope import Envelope, EnvelopeImpact, compute_envelope
from tests.campaign.feature_scenes import law_of
from tests.campaign.transformation import restore_record, rotate_scene, turn_quarter_back
from tests.transformed_scenes import turn_quarter
from tests.unit.solvers.run_kinds import collect_run_bits

from carom import CertifiedTrace, Outcome, Scene, Trace, solve_pic
from carom.core.resolution import clock_resolution
from carom.solvers.certified.options import CertifyOptions
from carom.solvers.certified.run import CertifiedRun
from carom.solvers.pic import start_pic_run
from carom.solvers.run import Run

#: Impacts over which a scene is followed, and events of its envelope.
MOST_IMPACTS, MOST_EVENTS = 40, 80
#: Impacts by which a certified run goes beyond those of PIC.
MORE_CERTIFIED = 20
#: Seconds of processor time of a certified run, of a run whose time stands still, and of all checks of a scene.
CERTIFIED_S, STANDSTILL_S, SCENE_S = 2.0, 2.0, 30.0
#: What each check has, whatever those before it took.
LEAST_S = 1.0
#: Impacts at one instant after which a run is taken on to its end.
AT_ONE_INSTANT = 12
#: Pieces that a run is cut into.
PIECES = 12


class Check(StrEnum):
    """Comparison of a run with another one; tables show its value."""

    CERTIFIED = "certified run"
    ROTATED = "rotated by 90 degrees"
    REORDERED = "rotated and reordered"
    PIECES = "in pieces"
    ALL_PAIRS = "by all pairs"
    TIME_LIMIT = "time limit"


class OutOfTimeError(BaseException):
    """A check used up its processor time. It is no `Exception`, so that no other code handles it."""


@contextlib.contextmanager
def time_limit(seconds: float, error: type[BaseException] = OutOfTimeError) -> Iterator[None]:
    """Raise an exception in the block after some seconds of processor time; an outer limit continues after it."""

    def end(_signal: int, _frame: FrameType | None) -> None:
        raise error

    before = signal.signal(signal.SIGPROF, end)
    left, _ = signal.setitimer(signal.ITIMER_PROF, seconds)
    begin_s = time.process_time()
    try:
        yield
    finally:
        left = max(1e-3, left - (time.process_time() - begin_s)) if left else 0.0
        signal.signal(signal.SIGPROF, before)
        signal.setitimer(signal.ITIMER_PROF, left)


def all_pairs_run(scene: Scene) -> Run:
    """Return a run that searches all pairs of bodies instead of cells."""
    return start_pic_run(scene, all_pairs=True)


def check_scene(scene: Scene, solve: Callable[..., Trace] = solve_pic) -> Checked:
    """Run all checks of a scene; the findings are the first difference of each kind and check."""
    begin_s, sums = time.process_time(), dict[str, float](impacts=0, certified=0)
    trace, oracle, findings = list[Trace](), list[Oracle](), list[Finding]()

    def solve_scene() -> Iterator[Finding]:
        trace.append(solve(scene, max_impacts=MOST_IMPACTS))
        sums["impacts"] = len(trace[0].impacts)
        yield from _find_no_end(scene, trace[0])

    def compare_with_certified() -> list[Finding]:
        oracle.append(Oracle(scene, trace[0], solve))
        record = Record.of(trace[0])
        sums.update(oracle[0].counts(record))
        differences = oracle[0].differences(record)
        kinds = {difference.kind for difference in differences}
        sums["contact from low hops"] = int(Kind.LOW_HOPS in kinds)
        sums["contact kept"] = int(Kind.KEPT_CONTACT in kinds)
        return _first_of_each_kind(Check.CERTIFIED, differences)

    checks: dict[Check, Callable[[], Iterable[Finding]]] = {
        Check.TIME_LIMIT: solve_scene,
        Check.CERTIFIED: compare_with_certified,
        Check.REORDERED: lambda: _first_of_each_kind(Check.REORDERED, _of_reordered(scene, solve, oracle[0])),
        Check.ROTATED: lambda: _find_unlike_rotated(trace[0], solve),
        Check.PIECES: partial(_find_unlike_run, Check.PIECES, scene),
        Check.ALL_PAIRS: partial(_find_unlike_run, Check.ALL_PAIRS, scene),
    }
    for check, find in checks.items():
        left_s = SCENE_S - (time.process_time() - begin_s)
        try:
            with time_limit(max(LEAST_S, left_s)):
                findings += find()
        except OutOfTimeError:
            findings.append(Finding(f"{Check.TIME_LIMIT}: no end of {check}", f"it takes {left_s:.1f} s"))
        except Exception as error:  # noqa: BLE001 - whatever a solver raises is a finding
            name = type(error).__name__
            findings.append(Finding(f"{check}: {name}", f"raised {name}: {error}"))
        if not (trace and (oracle or check is Check.TIME_LIMIT)):
            break
    return Checked(str(law_of(scene)), sums, findings=findings, seconds=time.process_time() - begin_s)


def _first_of_each_kind(check: Check, differences: Sequence[Difference]) -> list[Finding]:
    first = {difference.kind: difference for difference in reversed(differences)}
    return [Finding(f"{check}: {kind}", difference.text) for kind, difference in first.items() if kind not in COUNTED]


class Oracle:
    """Certified events of a scene, and bounds of the rounding errors of a run."""

    def __init__(self, scene: Scene, trace: Trace, solve: Callable[..., Trace]) -> None:
        self._scene, self._solve, self._impacts = scene, solve, len(trace.impacts)
        self.envelope: Envelope = compute_envelope(scene, trace, MOST_EVENTS)
        self.certified: CertifiedTrace = certify_within(CERTIFIED_S, scene, self._impacts + MORE_CERTIFIED)

    @cached_property
    def copies(self) -> Copies:
        """Runs of copies of the scene, computed on first use."""
        return Copies(self._scene, self._solve, self._impacts, self.envelope.gap_m)

    def differences(self, record: Record) -> list[Difference]:
        """Return the unexplained differences of a run from the certified events, in order of time."""
        found = compare_with_envelope(self._scene, self.envelope, record)
        if found or self.envelope.end is not None:
            return found
        return compare_with_certified(self._scene, self.certified, record, self.copies, self.envelope.gap_m)

    def counts(self, record: Record) -> dict[str, int]:
        """Return how many impacts and modes of a run are compared, and how many of these by the envelope."""
        events = self.envelope.events
        in_envelope = sum(isinstance(event, EnvelopeImpact) for event in events)
        proven = min(in_envelope, len(record.impacts))
        if self.envelope.end is not None:
            certified, modes = proven, len(events) - in_envelope
        else:
            until_s = min(self.copies.horizon_s, reliable_until(self.certified))
            certified = max(proven, int(np.sum(record.impacts["time_s"] <= until_s)))
            modes = 0 if record.modes is None else int(np.sum(record.modes["time_s"] <= until_s))
        return {"certified": certified, "order proven": proven, "changes of modes": modes}


def certify_within(seconds: float, scene: Scene, impacts: int) -> CertifiedTrace:
    """Return a certified run that is limited to some seconds of processor time."""
    run = CertifiedRun(scene, CertifyOptions(max_impacts=impacts))
    # `KeyboardInterrupt` ends a certified run, and keeps what was certified.
    with contextlib.suppress(KeyboardInterrupt), time_limit(seconds, KeyboardInterrupt):
        run.advance()
    if run.ending is None:  # interrupted between two attempts
        run = CertifiedRun(scene, CertifyOptions(max_impacts=0))
        run.advance()
    return run.result()


def _of_reordered(scene: Scene, solve: Callable[..., Trace], oracle: Oracle) -> list[Difference]:
    """Return the differences of a run of the rotated scene with its discs in reverse order."""
    trace = solve(rotate_scene(scene, turn_quarter, is_reversed=True), max_impacts=MOST_IMPACTS)
    return oracle.differences(restore_record(Record.of(trace), turn_quarter_back, is_reversed=True))


def _find_no_end(scene: Scene, trace: Trace) -> Iterator[Finding]:
    """Yield a finding if the run's time stands still, and the run does not stop by itself in time."""
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
        yield Finding(f"{Check.TIME_LIMIT}: time stands still", text)


def _find_unlike_run(check: Check, scene: Scene) -> Iterator[Finding]:
    """Yield a finding if a run in pieces, or by all pairs, is not bit-identical to a run in cells at once."""
    run = start_pic_run(scene)
    expected = _take_at_once(run, scene)
    if check is Check.PIECES:
        found = _take_in_pieces(start_pic_run(scene), scene, run.time_s)
    else:
        found = _take_at_once(all_pairs_run(scene), scene)
    if unlike := [name for name, value in expected.items() if found[name] != value]:
        yield Finding(f"{check}: other bits", f"other bits in {', '.join(unlike)}")


def _find_unlike_rotated(trace: Trace, solve: Callable[..., Trace]) -> Iterator[Finding]:
    """Yield a finding if the run of the rotated scene is not bit-identical to the rotated run."""
    turned = solve(rotate_scene(trace.scene, turn_quarter), max_impacts=MOST_IMPACTS)
    one, other = vars(Record.of(trace)), vars(restore_record(Record.of(turned), turn_quarter_back))
    unlike = [name for name, value in one.items() if not np.array_equal(value, other[name])]  # 0 and -0 are one number
    if unlike:
        yield Finding(f"{Check.ROTATED}: other bits", f"other bits in {', '.join(unlike)}")


def _take_at_once(run: Run, scene: Scene) -> dict[str, object]:
    return collect_run_bits(run, run.advance_to(scene.duration_s, MOST_IMPACTS))


def _take_in_pieces(run: Run, scene: Scene, ends_s: float) -> dict[str, object]:
    """Advance a run in pieces, by time and by impacts, and read all its results between them."""
    rng = random.Random(scene.name)
    for time_s in sorted(rng.uniform(0.0, ends_s) for _ in range(PIECES)):
        outcome = run.advance_to(time_s, rng.choice((MOST_IMPACTS, rng.randint(0, MOST_IMPACTS))))
        collect_run_bits(run, outcome)
    return _take_at_once(run, scene)
