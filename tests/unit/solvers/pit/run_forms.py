"""Every form of a PIT run, and all that one has found out."""

import math
from collections.abc import Callable

import numpy as np

from carom.model.damping import Damping
from carom.model.scene import Scene
from carom.solvers.pit.clock import FrameClock
from carom.solvers.pit.solve import MOST_WASTE, FrameRun, build_edges

Form = Callable[[Scene, FrameClock], FrameRun]


def start_plain_run(scene: Scene, clock: FrameClock) -> FrameRun:
    """Return a run that makes every test at every frame."""
    return list_compiled_forms()["plain"](scene, clock)


def list_compiled_forms() -> dict[str, Form]:
    """Return the compiled run as a user gets it, looping plainly, skipping whatever that costs, and sweeping."""
    from carom.core.pit import FrameLoop

    def form(*, skips: bool, max_waste: float) -> Form:
        return lambda scene, clock: FrameRun(
            FrameLoop(scene.undamped, clock, skips, max_waste, scene.damping_per_s),
            clock,
            edges_of=None if scene.arrays.has_half_planes else build_edges,
            damping=Damping(scene.damping_per_s),
        )

    return {
        "default": form(skips=True, max_waste=MOST_WASTE),
        "plain": form(skips=False, max_waste=MOST_WASTE),
        "always skipping": form(skips=True, max_waste=math.inf),
        "sweeping": form(skips=True, max_waste=0.0),
    }


def run_to_end(scene: Scene, clock: FrameClock, form: Form = start_plain_run) -> FrameRun:
    """Return a run at the end of its scene."""
    run = form(scene, clock)
    run.advance_to(scene.duration_s)
    return run


def collect_bits(run: FrameRun) -> tuple[bytes, bytes, bytes, bytes, tuple[int, ...], int]:
    """Return everything that a run has found out, as bytes: -0 differs from 0 here, too."""
    position, velocity = np.ascontiguousarray(run.positions()), np.ascontiguousarray(run.velocities())
    impacts, found = run.log.array().tobytes(), run.log.edges()
    edges = b"" if found is None else found.tobytes()
    return impacts, edges, position.tobytes(), velocity.tobytes(), run.log.ambiguous(), run.frames


def assert_identical(scene: Scene, clock: FrameClock) -> FrameRun:
    """Run a scene by all forms, which must end in the same bytes; return the plain one."""
    run = run_to_end(scene, clock)
    for name, form in list_compiled_forms().items():
        assert collect_bits(run_to_end(scene, clock, form)) == collect_bits(run), name
    return run
