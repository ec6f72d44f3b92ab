from collections.abc import Sequence

from typing_extensions import disjoint_base

from carom.physics.double_double import Pair

@disjoint_base
class Features:
    def __new__(cls, rows: Sequence[Sequence[float]]) -> Features: ...
    def first_time(self, x: Pair, y: Pair, ux: Pair, uy: Pair, radius: float, last: int) -> tuple[float, int, bool]: ...
