"""Certified runs: event-driven simulation in ball arithmetic, in which every digit is proven."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import numpy as np

from carom.errors import InputError, MissingExtraError
from carom.solvers.certified.result import CertifiedTrace, Degeneracy, Degenerate, Ending
from carom.trace import IMPACT_DTYPE, Outcome, Trace

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from carom.scene import Scene
    from carom.solvers.certified.bodies import BallBodies
    from carom.solvers.certified.recording import Recording
    from carom.solvers.certified.run import Stage

__all__ = ["MAX_PRECISION_BITS", "TIE_BITS", "certify"]

#: Half a million impacts of 64 discs at packing .4, which would take an hour or so.
MAX_PRECISION_BITS = 65536
#: Two times that agree in so many bits are no accident of the start's 53.
TIE_BITS = 512


def certify(
    scene: Scene,
    *,
    digits: int = 15,
    max_impacts: int | None = None,
    time_budget_s: float | None = None,
    max_precision_bits: int = MAX_PRECISION_BITS,
    tie_bits: int = TIE_BITS,
    progress: Callable[[int, float, int], None] | None = None,
) -> CertifiedTrace:
    """Run a scene with proven bounds on every number: times, velocities and final positions.

    The float64 values of the scene are the exact input. The next impact is chosen by certified comparison only; where
    that is not decided, the run is repeated at a higher precision. An event that no precision decides ends the run, and
    is reported. An interrupt (Ctrl-C) ends it, too; what was certified until then is returned in every case.

    Args:
        scene: The scene; discs and walls of any number; under gravity, no immovable discs beside movable ones.
        digits: Decimal digits wanted: times to that part of themselves, velocities of the greatest speed at the start,
            positions of the greatest extent of the start.
        max_impacts: Stop after this many impacts; None for no limit.
        time_budget_s: Stop after this many seconds of clock time; None for no limit.
        max_precision_bits: Never compute with more bits than these.
        tie_bits: An event that is still not decided when its bodies are known to so many bits is called degenerate.
        progress: Called now and then with impacts so far, time reached in seconds, and bits of precision.

    Returns:
        The trace with its radii. Its final state is that at the end, or at the last certified impact where the run
        ended before.

    Raises:
        MissingExtraError: python-flint is not installed.
        InputError: The scene has immovable discs under gravity, or an option is outside its range.
    """
    if not 1 <= digits <= 10_000:
        raise InputError(f"digits must be 1 to 10000, got {digits}")
    if max_impacts is not None and max_impacts < 0:
        raise InputError(f"max_impacts must be 0 or more, got {max_impacts}")
    if time_budget_s is not None and not time_budget_s > 0:
        raise InputError(f"time_budget_s must be above 0, got {time_budget_s}")
    if max_precision_bits < 64:
        raise InputError(f"max_precision_bits must be 64 or more, got {max_precision_bits}")
    if tie_bits < 64:
        raise InputError(f"tie_bits must be 64 or more, got {tie_bits}")
    _refuse_quartics(scene)
    try:
        from flint import ctx
    except ImportError:
        raise MissingExtraError("certify needs python-flint: pip install 'carom[certify]'") from None
    from carom.solvers.certified.recording import Recording
    from carom.solvers.certified.run import Budget, climb

    started = time.perf_counter()
    precision = ctx.prec
    try:
        budget = Budget(max_impacts, time_budget_s, max_precision_bits, tie_bits)
        recording = Recording(scene, digits)
        stage, replays = climb(recording, scene, budget, progress)
        return _result(scene, stage, recording, replays, started)
    finally:
        ctx.prec = precision


def _refuse_quartics(scene: Scene) -> None:
    """Refuse a falling disc and a fixed one: their gap is a quartic in time, which is not solved in balls."""
    fixed = [i for i, disc in enumerate(scene.discs) if disc.immovable]
    if fixed and len(fixed) < len(scene.discs) and scene.gravity_m_s2 != (0.0, 0.0):
        raise InputError(
            f"discs[{fixed[0]}] is immovable and gravity_m_s2 is {scene.gravity_m_s2}: a certified run does not "
            "support falling discs beside immovable ones; solve_pic does, or set gravity_m_s2 to [0, 0]"
        )


def _result(scene: Scene, stage: Stage, recording: Recording, replays: int, started: float) -> CertifiedTrace:
    from carom.solvers.certified.run import replayed

    ending = stage.ending or Ending.PRECISION_CAP
    good, digits = recording.complete(), recording.digits
    impacts = np.array(recording.rows[:good], dtype=IMPACT_DTYPE)
    radii = np.array(recording.radii[:good], dtype=IMPACT_DTYPE)
    for array in (impacts, radii):
        array.flags.writeable = False
    bodies = replayed(scene, stage, good)
    bits_lost = stage.bits - bodies.worst_accuracy_bits()
    end_s = scene.duration_s if ending is Ending.COMPLETED else float(impacts["time_s"][-1]) if good else 0.0
    (position, position_radius), (velocity, velocity_radius) = _final(bodies, end_s, recording.bits)
    trace = Trace(
        method="certified",
        scene=scene,
        impacts=impacts,
        final_position_m=position,
        final_velocity_m_s=velocity,
        end_time_s=end_s,
        outcome=_outcome(ending, stage.degeneracy),
        settings={"digits": digits, "precision_bits": stage.bits},
        counts={"impacts": good},
        notes=(ending.value,) if stage.degeneracy is None else (str(stage.degeneracy),),
    )
    return CertifiedTrace(
        trace=trace,
        radii=radii,
        final_position_radius_m=position_radius,
        final_velocity_radius_m_s=velocity_radius,
        digits=digits,
        ending=ending,
        decimals=tuple(recording.decimals[:good]),
        degeneracy=stage.degeneracy if ending is Ending.DEGENERATE else None,
        commuted=tuple(pair for pair in stage.commuted if pair[1] < good),
        precision_bits=stage.bits,
        bits_lost=float(bits_lost),
        replays=replays,
        elapsed_s=time.perf_counter() - started,
    )


def _outcome(ending: Ending, degeneracy: Degeneracy | None) -> Outcome:
    if degeneracy is not None and degeneracy.kind is Degenerate.COLLAPSE:
        return Outcome.STANDSTILL
    plain = {Ending.COMPLETED: Outcome.COMPLETED, Ending.MAX_IMPACTS: Outcome.MAX_IMPACTS}
    return plain.get(ending, Outcome.STOPPED)


def _final(
    bodies: BallBodies, end_s: float, bits: int
) -> tuple[tuple[NDArray[np.float64], NDArray[np.float64]], tuple[NDArray[np.float64], NDArray[np.float64]]]:
    """Return positions and velocities at the exact instant `end_s`, each with its radii."""
    from flint import arb, ctx

    from carom.solvers.certified.recording import nearest

    places = [bodies.place(i, end_s) for i in range(len(bodies))]
    speeds = [bodies.velocity(i, arb(end_s)) for i in range(len(bodies))]
    ctx.prec = min(bits, ctx.prec)
    both = []
    for rows in (places, speeds):
        pairs = np.array([[nearest(+ball) for ball in row] for row in rows]).reshape(len(bodies), 2, 2)
        both.append((pairs[:, :, 0].copy(), pairs[:, :, 1].copy()))
    return both[0], both[1]
