"""Every form of a PIT run, and all that one has found out."""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from carom.model.damping import Damping
from carom.model.scene import Scene
from carom.solvers.pit.clock import FrameClock
from carom.solvers.pit.solve import MOST_WASTE, FrameRun, build_edges

Form = Callable[[Scene, FrameClock], FrameRun]


def edges_of(scene: Scene) -> Callable[[NDArray[np.void]], NDArray[np.void]] | None:
    return None if scene.arrays.has_half_planes else build_edges


def plain(scene: Scene, clock: FrameClock) -> FrameRun:
    """Return a run that makes every test at every frame."""
    return compiled_forms()["plain"](scene, clock)


def compiled_forms() -> dict[str, Form]:
    """Return the compiled run as a user gets it, looping plainly, skipping whatever that costs, and sweeping."""
    from carom.core.pit import FrameLoop

    def form(*, skips: bool, max_waste: float) -> Form:
        return lambda scene, clock: FrameRun(
            FrameLoop(scene.undamped, clock, skips, max_waste, scene.damping_per_s),
            clock,
            edges_of=edges_of(scene),
            damping=Damping(scene.damping_per_s),
        )

    return {
        "default": form(skips=True, max_waste=MOST_WASTE),
        "plain": form(skips=False, max_waste=MOST_WASTE),
        "always skipping": form(skips=True, max_waste=math.inf),
        "sweeping": form(skips=True, max_waste=0.0),
    }


def finished(scene: Scene, clock: FrameClock, form: Form = plain) -> FrameRun:
    """Return a run at the end of its scene."""
    run = form(scene, clock)
    run.advance_to(scene.duration_s)
    return run


def bits(run: FrameRun) -> tuple[bytes, bytes, bytes, bytes, tuple[int, ...], int]:
    """Return everything that a run has found out, as bytes: -0 differs from 0 here, too."""
    position, velocity = np.ascontiguousarray(run.positions()), np.ascontiguousarray(run.velocities())
    impacts, found = run.log.array().tobytes(), run.log.edges()
    edges = b"" if found is None else found.tobytes()
    return impacts, edges, position.tobytes(), velocity.tobytes(), run.log.ambiguous(), run.frames


def assert_identical(scene: Scene, clock: FrameClock) -> FrameRun:
    """Run a scene by all forms, which must end in the same bytes; return the plain one."""
    run = finished(scene, clock)
    for name, form in compiled_forms().items():
        assert bits(finished(scene, clock, form)) == bits(run), name
    return run
