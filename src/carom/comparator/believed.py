"""Up to where a reference may be believed: given, or estimated from what a perturbation by one ulp makes of it."""

from __future__ import annotations

import math
from collections import Counter

import numpy as np
from numpy.typing import NDArray

from carom.errors import InputError, SceneError
from carom.scene import Disc, Scene
from carom.solvers.pic import solve_pic
from carom.trace import Trace

__all__ = ["BELIEVED", "estimate_horizon", "reach_of"]

#: Where two runs that began an ulp apart differ by this part of the scene's speed (velocities) or duration (times), the
#: reference is no longer believed. A thousand times the rounding threshold of the verdicts, and a thousandth of what
#: sampling costs at any usual step, so that neither depends on where exactly the line is drawn.
BELIEVED = 1e-9


def reach_of(reference: Trace, horizon: float | None) -> tuple[int, float]:
    """Return how many of the reference's impacts lie within a horizon, and until when it reaches, seconds.

    Args:
        reference: The reference.
        horizon: A number of impacts (an int), a time in seconds (a float), or None for the whole run.

    Raises:
        InputError: It is negative or not a number.
    """
    count = len(reference.impacts)
    if horizon is None:
        return count, math.inf
    if isinstance(horizon, bool) or not horizon >= 0:
        raise InputError(f"horizon must be a number of impacts (int) or a time in seconds (float), got {horizon!r}")
    times = reference.impacts["time_s"]
    if isinstance(horizon, int):
        if horizon >= count:
            return count, math.inf
        # The first impact that is not believed ends it.
        return horizon, float(np.nextafter(times[horizon], -math.inf))
    if horizon >= reference.scene.duration_s:
        return count, math.inf
    return int(np.searchsorted(times, horizon, side="right")), float(horizon)


def estimate_horizon(reference: Trace) -> float | None:
    """Estimate the time up to which a PIC trace may be believed; None where that is the whole of it.

    The scene is solved again with every number of its start moved by one unit in the last place. Rounding does about as
    much to a run at each impact, so where the two part, neither is to be believed. That is an estimate and no proof:
    `carom certify` proves.

    Args:
        reference: A trace by `carom.solve_pic`.
    """
    scene = reference.scene
    if reference.ambiguous or not len(reference.impacts):
        return None
    try:
        nudged = _nudged(scene, positions=True)
    except SceneError:  # an ulp too deep in a touching neighbour
        nudged = _nudged(scene, positions=False)
    other = solve_pic(nudged, max_impacts=len(reference.impacts))
    if not len(other.impacts):
        return 0.0
    one, times = reference.impacts, reference.impacts["time_s"]
    same = _same_impacts(reference, other)
    # An impact within rounding of the end may fall on either side of it, and says nothing of those before.
    last = times > scene.duration_s * (1.0 - BELIEVED)
    apart = (same < 0) & ~last
    two = other.impacts[np.maximum(same, 0)]
    velocities = [np.abs(one[name]) for name in one.dtype.names or () if "velocity" in name]
    speed = float(np.max(np.concatenate(velocities), initial=0.0))
    # Asked so that NaN differs from everything.
    differs = ~(np.abs(times - two["time_s"]) <= BELIEVED * scene.duration_s)
    for name in ("velocity_first_after", "velocity_second_after"):
        differs |= ~(np.max(np.abs(one[name] - two[name]), axis=1) <= BELIEVED * speed)
    apart |= (same >= 0) & differs
    if not apart.any():
        return None
    return max(0.0, float(np.nextafter(times[int(np.argmax(apart))], -math.inf)))


def _same_impacts(reference: Trace, other: Trace) -> NDArray[np.intp]:
    """Which impact of another trace is the n-th of the same pair, -1 where it has none.

    Counted pair by pair: impacts of different pairs at nearly one instant may change places without any harm.
    """
    numbers: list[dict[tuple[int, int, int], int]] = []
    for trace in (reference, other):
        seen: Counter[tuple[int, int]] = Counter()
        index = {}
        for k, pair in enumerate(zip(trace.impacts["first"].tolist(), trace.impacts["second"].tolist(), strict=True)):
            index[(*pair, seen[pair])] = k
            seen[pair] += 1
        numbers.append(index)
    return np.array([numbers[1].get(key, -1) for key in numbers[0]], dtype=np.intp)


def _nudged(scene: Scene, *, positions: bool) -> Scene:
    signs = np.random.default_rng(0).choice([-math.inf, math.inf], size=(len(scene.discs), 4))
    discs = [
        disc
        if disc.immovable
        else Disc(
            position_m=_moved(disc.position_m, sign[:2]) if positions else disc.position_m,
            velocity_m_s=_moved(disc.velocity_m_s, sign[2:]),
            radius_m=disc.radius_m,
            mass_kg=disc.mass_kg,
        )
        for disc, sign in zip(scene.discs, signs, strict=True)
    ]
    return scene.model_copy(update={"discs": tuple(discs)}) if not positions else _rebuilt(scene, discs)


def _rebuilt(scene: Scene, discs: list[Disc]) -> Scene:
    fields = {name: getattr(scene, name) for name in type(scene).model_fields}
    return Scene(**{**fields, "discs": tuple(discs)})


def _moved(vector: tuple[float, float], towards: NDArray[np.float64]) -> tuple[float, float]:
    # A zero stays: a unit in the last place of nothing is nothing, and symmetries that rounding keeps are kept.
    x, y = (v if v == 0.0 else math.nextafter(v, t) for v, t in zip(vector, towards.tolist(), strict=True))
    return (x, y)
