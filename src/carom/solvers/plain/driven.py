"""PIC of scenes with driven bodies: by all pairs, those of discs that no path drives solved for together."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from carom.physics import pair_times, wall_times
from carom.solvers.plain.bodies import Bodies, require_supported
from carom.solvers.plain.compiled_walls import CompiledWall
from carom.solvers.plain.run import AllPairsRun

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from carom.solvers.run import Start

#: Fewer are solved for sooner one by one than arrays are made of them.
_TOGETHER = 12


class _Compiled(Bodies):
    half_plane_time = staticmethod(wall_times.half_plane_time)
    finite_wall = CompiledWall


class DrivenRun(AllPairsRun):
    """An `AllPairsRun`, to the bit, which needs the compiled extension.

    Its arguments and errors are those of `AllPairsRun`.
    """

    def _bodies_of(self, start: Start) -> Bodies:
        require_supported(start, "PIC")
        return _Compiled(start)

    def _predict(self, disc: int, others: Iterable[int]) -> None:
        bodies, others = self.bodies, list(others)
        alone = [other for other in others if other not in bodies.driven]
        if bodies.inverse_mass[disc] == 0.0 or len(alone) < _TOGETHER:
            super()._predict(disc, others)
            return
        super()._predict(disc, [other for other in others if other in bodies.driven])
        self._expect_all(disc, np.array(alone))

    def _expect_all(self, disc: int, others: NDArray[np.intp]) -> None:
        """Solve for the impacts of a disc with others, none of which is driven, as `Bodies.next_pair_impact` does."""
        bodies = self.bodies
        x, y, vx, vy, radius, clock = np.array(
            (bodies.x, bodies.y, bodies.vx, bodies.vy, bodies.radius, bodies.time), dtype=np.float64
        )
        begin = np.maximum(clock[disc], clock[others])
        # In the order of their numbers, on which the last bits depend.
        first, second = np.minimum(disc, others), np.maximum(disc, others)
        p, v = np.column_stack((x, y)), np.column_stack((vx, vy))
        p1, p2 = (p[side] + v[side] * (begin - clock[side])[:, None] for side in (first, second))
        waits = np.empty(len(others))
        pair_times.fill_pair_times(p1, v[first], radius[first], p2, v[second], radius[second], waits)
        partner = bodies.last_partner[disc]
        if partner is not None and partner >= 0 and bodies.are_parting(disc, partner):
            waits[others == partner] = np.inf
        self._instants[0, first, len(bodies.walls) + second] = begin + waits
        self._instants[1, first, len(bodies.walls) + second] = 0.0
        for k in np.flatnonzero(np.isnan(waits)).tolist():  # of other than ordinary sizes
            self._expect(int(first[k]), int(second[k]))
