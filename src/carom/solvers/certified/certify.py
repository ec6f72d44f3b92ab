"""The function `certify`, which starts a certified run."""

from __future__ import annotations

from collections.abc import Callable

from carom.errors import MissingExtraError
from carom.model.scene import Scene, to_scene
from carom.solvers.certified.options import MAX_PRECISION_BITS, TIE_BITS, CertifyOptions
from carom.solvers.certified.result import CertifiedTrace


def certify(
    scene: Scene | str,
    *,
    digits: int = CertifyOptions.digits,
    max_impacts: int | None = None,
    time_budget_s: float | None = None,
    max_precision_bits: int = MAX_PRECISION_BITS,
    tie_bits: int = TIE_BITS,
    progress: Callable[[int, float, int], None] | None = None,
) -> CertifiedTrace:
    """Run a scene with proven bounds on every number: times, velocities and final positions.

    The 64-bit floats of the scene are the exact input. All numbers are intervals that contain the true value. If a
    comparison of two overlapping intervals is necessary, the run is repeated with a higher precision. The run ends
    early at an event that the greatest precision can't decide, or at an interrupt (Ctrl-C).

    Args:
        scene: The scene, or its name in the catalogue.
        digits: Number of decimal digits to prove. The error of a time is relative to this time. Errors of velocities
            are relative to the greatest speed at the start, and errors of positions to the greatest coordinate of a
            disc's rim at the start.
        max_impacts: Stop after this many impacts; None for no limit.
        time_budget_s: Stop after this many seconds of elapsed time; None for no limit.
        max_precision_bits: Greatest precision, in bits.
        tie_bits: The run ends at an undecided event if the states of its bodies are already accurate to this many bits.
        progress: Function called from time to time with the number of impacts so far, the time reached in seconds, and
            the bits of precision.

    Returns:
        The trace with an error bound for every number. If the run ended early, the trace ends at the last certified
        impact.

    Raises:
        MissingExtraError: python-flint is not installed.
        InputError: An option is outside its range.

    Examples:
        >>> carom.certify("paper/late", digits=20)
        CertifiedTrace of 'paper/late': 1 impact, 20 digits requested
          until 1 s: certified to the end of the scene
          0.37916666666666668444 s: disc 0 and disc 1
    """
    options = CertifyOptions(digits, max_impacts, time_budget_s, max_precision_bits, tie_bits)
    scene = to_scene(scene)
    try:
        import flint  # noqa: F401 - only checks that python-flint is installed
    except ModuleNotFoundError:
        raise MissingExtraError("certify needs python-flint", hints=["pip install 'carom[certify]'"]) from None
    from carom.solvers.certified.run import CertifiedRun

    run = CertifiedRun(scene, options)

    def report(impacts: int, time_s: float) -> None:
        if progress is not None:
            progress(impacts, time_s, run.precision_bits)

    run.advance(report)
    return run.result()
