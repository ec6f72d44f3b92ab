"""Algorithm 2 of the paper that inspired Carom: PIC frame by frame, with a stop at each impact within a frame.

The printed algorithm applies at most one impact per frame, but the paper's figure 9 shows a frame with several impacts.
This module applies all impacts of a frame, as in the figure. At each impact, the times of all pairs are computed
without a queue, as in the paper. A disc's state is stored only at its impacts, so frames cause no rounding. The result
is exactly equal to the result of `carom.solve_pic`.
"""

from __future__ import annotations

from carom.model.scene import Scene, to_scene
from carom.model.trace import Outcome, Trace
from carom.solvers.pic import start_pic_run
from carom.solvers.request import compute_frames
from carom.solvers.run import build_trace


def solve_pic_framewise(scene: Scene | str, *, frame_rate_hz: float | None = None) -> Trace:
    """Run a scene by Algorithm 2 of the paper that inspired Carom, with all impacts of each frame.

    Args:
        scene: The scene, or its name in the catalogue.
        frame_rate_hz: Frames per second; None for the scene's frame rate.

    Raises:
        InputError: The frame rate is not a positive number, or leads to too many frames.

    Examples:
        >>> trace = carom.solve_pic_framewise("paper/missed", frame_rate_hz=24)
        >>> len(trace.impacts), trace.counts["frames"]
        (1, 24)
    """
    scene = to_scene(scene)
    rate, frames = compute_frames(scene, frame_rate_hz)
    run = start_pic_run(scene, all_pairs=True)
    outcome = Outcome.COMPLETED
    for frame in range(1, frames + 1):
        outcome = run.advance_to(scene.duration_s if frame == frames else frame / rate)
        if outcome is not Outcome.COMPLETED:
            break
    counts = {"frames": frames, **run.counts}
    return build_trace(run, "pic (Algorithm 2)", scene, outcome, dt_s=1.0 / rate, counts=counts)
