"""The function `certify`: event-driven simulation in ball arithmetic, in which every digit is proven."""

from __future__ import annotations

from typing import TYPE_CHECKING

from carom.errors import MissingExtraError
from carom.model.scene import Scene, as_scene
from carom.solvers.certified.options import MAX_PRECISION_BITS, TIE_BITS, CertifyOptions

if TYPE_CHECKING:
    from collections.abc import Callable

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

    The float64 values of the scene are the exact input. The next impact is chosen only by certified comparisons. If
    these can't decide, the run is repeated at a higher precision. An event that no precision decides ends the run, and
    is reported. An interrupt (Ctrl-C) ends the run, too. The result contains everything that was certified until then.

    Args:
        scene: The scene, or its name in the catalogue.
        digits: Requested decimal digits: of each time, of velocities relative to the greatest speed at the start, of
            positions relative to the greatest extent of the start.
        max_impacts: Stop after this many impacts; None for no limit.
        time_budget_s: Stop after this many seconds of elapsed time; None for no limit.
        max_precision_bits: Greatest precision, bits.
        tie_bits: An event counts as degenerate if it is still undecided when its bodies are known to this many bits.
        progress: Function that is called at intervals, with the number of impacts so far, the time reached in seconds,
            and the precision in bits.

    Returns:
        The trace with its radii. The final state of the trace is the state at the end, or at the last certified impact
        if the run ended earlier.

    Raises:
        MissingExtraError: python-flint is not installed.
        InputError: An option is outside its range.

    Examples:
        >>> carom.certify("paper/late", digits=20)
        CertifiedTrace of 'paper/late': 1 impact, 20 digits requested
          until 1 s: certified to the end of the scene
          0.37916666666666668444 s: disc 0 and disc 1
    """
    asked = CertifyOptions(digits, max_impacts, time_budget_s, max_precision_bits, tie_bits)
    scene = as_scene(scene)
    try:
        import flint  # noqa: F401 - checks that it is installed
    except ModuleNotFoundError:
        raise MissingExtraError("certify needs python-flint", hints=["pip install 'carom[certify]'"]) from None
    from carom.solvers.certified.run import CertifiedRun

    run = CertifiedRun(scene, digits=asked.digits, max_precision_bits=asked.max_precision_bits, tie_bits=asked.tie_bits)

    def report(impacts: int, time_s: float) -> None:
        if progress is not None:
            progress(impacts, time_s, run.precision_bits)

    run.advance_to(scene.duration_s, asked.max_impacts, report, asked.time_budget_s)
    return run.result()
