"""From scene to trace by PIT: which form serves it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from carom.extension import extension_available, extension_notes
from carom.solvers.pit.clock import FrameClock
from carom.solvers.request import frames_of
from carom.solvers.units import run_in_ordinary_units
from carom.trace import Trace

if TYPE_CHECKING:
    from carom.scene import Scene
    from carom.solvers.pit.run import FrameRun
    from carom.solvers.units import RunInUnits

__all__ = ["pit_run", "solve_pit"]


def pit_run(scene: Scene, clock: FrameClock, *, skipping: bool = True) -> FrameRun | RunInUnits:
    """Return a PIT run at the start of a scene: compiled, or under gravity and without the extension the definition.

    Args:
        scene: The scene.
        clock: When the frames are.
        skipping: Whether to leave out tests that can find nothing; the result is the same to the bit. The definition
            leaves none out.
    """
    run: FrameRun | RunInUnits = run_in_ordinary_units(
        scene, lambda scene, units: _pit_run(scene, clock.in_units(units), skipping)
    )
    return run


def _pit_run(scene: Scene, clock: FrameClock, skipping: bool) -> FrameRun:
    if scene.gravity_m_s2 == (0.0, 0.0):
        if extension_available():
            from carom.solvers.pit.compiled import CompiledRun

            return CompiledRun(scene, clock, skipping=skipping)
        notes = extension_notes()
    else:
        notes = ()
    from carom.solvers.pit.frames import FrameSampledRun

    run = FrameSampledRun(scene, clock)
    run.notes = notes
    return run


def solve_pit(scene: Scene, *, frame_rate_hz: float | None = None, skipping: bool = True) -> Trace:
    """Run a scene by PIT.

    Frame k stands at ``k / frame_rate_hz``, from 0 to the last one before `scene.duration_s`.

    Args:
        scene: The scene.
        frame_rate_hz: Frames a second; the scene's own by default.
        skipping: Whether to leave out tests that can find nothing; only the work counts differ.

    Raises:
        InputError: The frame rate is not a positive number, or gives frames without end.
    """
    rate, _ = frames_of(scene, frame_rate_hz)
    clock = FrameClock.at_rate(rate)
    run = pit_run(scene, clock, skipping=skipping)
    outcome = run.advance_to(scene.duration_s)
    return Trace(
        method="pit",
        scene=scene,
        impacts=run.log.array(),
        final_position_m=run.positions(),
        final_velocity_m_s=run.velocities(),
        end_time_s=run.time_s,
        outcome=outcome,
        dt_s=clock.frame_s,
        ambiguous=run.log.ambiguous(),
        counts=run.counts,
        notes=run.notes,
    )
