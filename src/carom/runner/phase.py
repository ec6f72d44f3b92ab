"""A scene begun a part of a step earlier: where in a step an impact falls is luck, and one start shows one of it."""

from __future__ import annotations

from carom.errors import InputError
from carom.scene import Scene
from carom.solvers.pic import solve_pic

__all__ = ["begun_earlier", "phases"]


def phases(count: int) -> tuple[float, ...]:
    """Return so many phases, evenly spread over a step, the first of them 0.

    Raises:
        InputError: `count` is below 1.
    """
    if count < 1:
        raise InputError(f"phases must be 1 or more, got {count}")
    return tuple(k / count for k in range(count))


def begun_earlier(scene: Scene, by_s: float) -> Scene:
    """Return the scene begun `by_s` seconds earlier: every disc moved back along its path, the end where it was.

    The same impacts follow, `by_s` later each. Where bodies would have met on the way back (those of a cradle that
    touch at the start, say) the scene begins later instead, if nothing is to happen before.

    Args:
        scene: The scene.
        by_s: Seconds, 0 or more.

    Raises:
        InputError: Bodies meet within `by_s` both before the start and after it.
    """
    if by_s == 0.0:
        return scene
    for shift_s in (-by_s, by_s):
        if shift_s < scene.duration_s and _free(scene, shift_s):
            return _moved(scene, shift_s, scene.duration_s - shift_s)
    raise InputError(
        f"the scene can't begin {by_s:.3g} s earlier or later: bodies meet within that time on either side"
    )


def _free(scene: Scene, shift_s: float) -> bool:
    """Whether nothing meets between the start and `shift_s` after it, or before it where that is negative."""
    ahead = scene if shift_s > 0 else _reversed(scene)
    return len(solve_pic(ahead, max_impacts=1, until_s=abs(shift_s)).impacts) == 0


def _reversed(scene: Scene) -> Scene:
    return _with_discs(scene, [((x, y), (-u, -v)) for (x, y), (u, v) in _states(scene)], scene.duration_s)


def _moved(scene: Scene, shift_s: float, duration_s: float) -> Scene:
    gx, gy = scene.gravity_m_s2
    half = 0.5 * shift_s * shift_s
    moved = []
    for disc, ((x, y), (u, v)) in zip(scene.discs, _states(scene), strict=True):
        falls = 0.0 if disc.immovable else 1.0
        place = (x + u * shift_s + falls * gx * half, y + v * shift_s + falls * gy * half)
        moved.append((place, (u + falls * gx * shift_s, v + falls * gy * shift_s)))
    return _with_discs(scene, moved, duration_s)


_Vector = tuple[float, float]


def _states(scene: Scene) -> list[tuple[_Vector, _Vector]]:
    return [(disc.position_m, disc.velocity_m_s) for disc in scene.discs]


def _with_discs(scene: Scene, states: list[tuple[_Vector, _Vector]], duration_s: float) -> Scene:
    discs = [
        {**disc.model_dump(), "position_m": place, "velocity_m_s": (0.0, 0.0) if disc.immovable else velocity}
        for disc, (place, velocity) in zip(scene.discs, states, strict=True)
    ]
    return Scene(**{**scene.model_dump(), "discs": discs, "duration_s": duration_s})
