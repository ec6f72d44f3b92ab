"""What is driven, as the kernel has it, and what is asked of Python there: whether a disc is crushed."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from carom.solvers.impact_log import crushing_note
from carom.trace import wall_body

#: That of state.h.
NO_BODY = -(2**31)

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from carom.core import pic
    from carom.disc_arrays import DiscArrays
    from carom.driving import Drive
    from carom.solvers.event_driven.obstacles import Obstacles
    from carom.solvers.event_driven.run import Acceleration
    from carom.solvers.plain.bodies import Bodies
    from carom.solvers.plain.squeeze import LastMet


def driven_rows(start: DiscArrays) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the rows of driven bodies, and those of the legs of their paths, as the kernel takes them.

    Bodies that are driven, and walls whose surface runs, walls first, each in ascending order: the body (a wall is -1
    less its number), how many legs its path has, and how fast its surface runs. Of all these paths in turn the legs:
    when they begin and end (seconds since the start), how far the body has moved by then (two columns, metres), and its
    velocity.
    """
    rows: list[tuple[float, float, float]] = []
    legs: list[tuple[float, ...]] = []

    def add(body: int, drive: Drive, belt: float) -> None:
        path = () if drive.stands else drive.legs
        if path or belt:
            rows.append((body, len(path), belt))
            legs.extend((leg.begin_s, leg.end_s, *leg.moved, *leg.velocity) for leg in path)

    for k in range(len(start.walls) if start.driven else 0):
        add(wall_body(k), start.drive_of_wall(k), start.belt_of_wall(k))
    for disc, drive in zip(start.driven_discs, start.disc_drives, strict=True):
        add(disc, drive, 0.0)
    return np.array(rows, np.float64).reshape(-1, 3), np.array(legs, np.float64).reshape(-1, 6)


class Crushes:
    """Whether a disc of a run is crushed, as `carom.solvers.plain.squeeze` tells.

    Args:
        start: Where the run begins.
        obstacles: What its walls consist of.
        acceleration: What accelerates the discs.
        until_s: Up to when impacts are asked for, seconds since the start: what is crushed after that is not.

    Attributes:
        until_s: Likewise; it may grow.
        note: What a user is told of the disc that is crushed.
        error: Why it could not be told.
    """

    def __init__(
        self, start: DiscArrays, obstacles: Obstacles | None, until_s: float, acceleration: Acceleration | None
    ) -> None:
        self.until_s = until_s
        self.note = ""
        self.error: BaseException | None = None
        self._start = start
        self._obstacles = obstacles
        self._acceleration = acceleration
        self._bodies: Bodies | None = None

    def __call__(self, run: pic.Kernel, disc: int) -> bool:
        """Return whether a disc of a run that has just struck a body, and goes to and fro, is crushed.

        True, too, where that can't be told: the kernel ends its loop, and `error` says why.
        """
        try:
            return self._is_crushed(run, disc)
        except BaseException as error:  # noqa: BLE001 - Ctrl-C, too: compiled code hands nothing on
            self.error = error
            return True

    def reraise(self) -> None:
        """Raise `error`, if there is one, once."""
        if (error := self.error) is not None:
            self.error = None
            raise error

    def _is_crushed(self, run: pic.Kernel, disc: int) -> bool:
        from carom.solvers.plain.bodies import Bodies  # with it pydantic, which arrays do without
        from carom.solvers.plain.squeeze import Squeezes, ToAndFro

        if (to_and_fro := run.to_and_fro) is None:
            return False
        if self._bodies is None:
            self._bodies = Bodies(self._start)
        bodies, discs, epoch = self._bodies, run.discs, (run.clock["epoch"], run.clock["epoch_rest"])
        bodies.x, bodies.y, bodies.vx, bodies.vy, bodies.time = (
            discs[name].tolist() for name in ("x", "y", "vx", "vy", "time")
        )
        if run.spins is not None:
            bodies.spin = run.spins.tolist()
        if bodies.epoch != epoch:
            bodies.count_from(epoch)
        squeezes = Squeezes(bodies, most=0)  # the kernel has counted
        columns = ("last", "last_obstacle", "across", "across_obstacle", "nx", "ny", "row")
        squeezes.to_and_fro = [
            ToAndFro(self._struck(last, edge), (nx, ny), self._struck(across, other), row)
            for last, edge, across, other, nx, ny, row in to_and_fro[list(columns)].tolist()
        ]
        crush = squeezes.crush(disc)
        if crush is None or (time_s := bodies.since_start(crush.time_s)) > self.until_s:
            return False
        self.note = crushing_note(disc, crush.between, time_s)
        return True

    def _struck(self, body: int, obstacle: int) -> LastMet | None:
        from carom.solvers.plain.squeeze import LastMet

        if body == NO_BODY:
            return None
        return LastMet(body, None if self._obstacles is None else self._obstacles.feature(obstacle))
