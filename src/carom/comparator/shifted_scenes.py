"""Scenes that start slightly later or earlier on the same paths, so that impacts happen at another phase of a step.

At a single phase of a step, a method may be accurate by chance. So methods are compared at several phases.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator

import numpy as np

from carom.comparator.non_finite import find_non_finite
from carom.comparator.slowing import Slowing
from carom.errors import InputError, SceneError
from carom.model.scene import Disc, Scene
from carom.model.trace import Trace
from carom.model.walls import AnyWall, move_wall, reverse_motion, shift_legs
from carom.solvers.pic import solve_pic
from carom.support.formatting import format_seconds


def list_even_phases(count: int) -> tuple[float, ...]:
    """Return `count` phases that are evenly spread over a step, beginning with 0.

    Raises:
        InputError: `count` is below 1.
    """
    if count < 1:
        raise InputError(f"the number of phases must be 1 or more, got {count}")
    return tuple(k / count for k in range(count))


def build_shifted_scenes(reference: Trace, dt_s: float, phases: Iterable[float]) -> Iterator[Scene]:
    """For each phase, yield the scene with a later or earlier start. A phase is omitted if bodies would overlap.

    All discs are advanced by ``phase * dt`` along their paths, and the duration is shortened by the same time. If the
    first impact is before the new start, the discs are instead moved back by ``(1 - phase) * dt``.

    Args:
        reference: The scene's PIC trace.
        dt_s: The step size, in seconds.
        phases: Fractions of a step by which the start is shifted, from 0 to 1.
    """
    scene = reference.scene
    first = float(reference.impacts["time_s"][0]) if len(reference.impacts) else math.inf
    for phase in phases:
        shift_s = phase * dt_s
        try:
            yield _shift_scene(scene, shift_s if shift_s < min(first, scene.duration_s) else shift_s - dt_s)
        except SceneError:
            continue


def solve_shifted_references(reference: Trace, dt_s: float, phases: Iterable[float]) -> tuple[Trace, ...]:
    """Solve the scenes of `build_shifted_scenes` with PIC, and return the traces.

    A shifted scene is omitted if its impacts differ from those of the reference in their bodies or order. For example,
    a disc that is moved back may pass through another body, or the last impact may come after the end.
    """
    bodies, shifted_scenes = ["first", "second"], build_shifted_scenes(reference, dt_s, phases)
    traces = (solve_pic(scene, max_impacts=len(reference.impacts) + 1) for scene in shifted_scenes)
    return tuple(
        trace
        for trace in traces
        if np.array_equal(trace.impacts[bodies], reference.impacts[bodies]) and not find_non_finite(trace)
    )


def shift_start(scene: Scene, by_s: float) -> Scene:
    """Return the scene with the same end and a start `by_s` seconds earlier: every disc is moved back along its path.

    The scene then has the same impacts, each later by `by_s`. But if bodies would meet on the way back, the scene
    begins later instead. For example, the discs of Newton's cradle touch at the start.

    Args:
        scene: The scene.
        by_s: Time of the shift in seconds, 0 or more.

    Raises:
        InputError: Bodies meet within `by_s` both before the start and after it.
    """
    if by_s == 0.0:
        return scene
    for shift_s in (-by_s, by_s):
        if shift_s < scene.duration_s and _is_free_of_impacts(scene, shift_s):
            return _shift_scene(scene, shift_s)
    raise InputError(
        f"the scene can't begin {format_seconds(by_s)} earlier or later: bodies meet within that time before and after "
        "its start"
    )


def _is_free_of_impacts(scene: Scene, shift_s: float) -> bool:
    """Whether no bodies meet between the start and the time `shift_s`, which may be before the start."""
    slowing = Slowing.of(scene)
    if slowing.table_m_s2 and shift_s < 0.0:  # motion on a table can't be solved backwards
        try:
            return _is_free_of_impacts(_shift_scene(scene, shift_s), -shift_s)
        except SceneError:  # bodies overlap at the earlier start
            return False
    # A damped disc moves along a part of its undamped path. So the undamped path is solved.
    flown_s, scene = shift_s if slowing.table_m_s2 else slowing.damping.to_undamped(shift_s), scene.undamped
    if flown_s < 0:  # solve the path before the start backwards: reverse all velocities
        velocities = [disc.drive.velocity_at(0.0) for disc in scene.discs]
        discs = [
            disc.model_copy(update={"velocity_m_s": (-u, -v), "legs": ()})
            for disc, (u, v) in zip(scene.discs, velocities, strict=True)
        ]
        scene = _replace_bodies(scene, discs, [reverse_motion(wall) for wall in scene.walls])
    return len(solve_pic(scene, max_impacts=1, until_s=abs(flown_s)).impacts) == 0


def _shift_scene(scene: Scene, shift_s: float) -> Scene:
    """Return the scene with the same end and a start `shift_s` later. No bodies may meet between the two starts."""
    discs = [_shift_disc(disc, scene, shift_s) for disc in scene.discs]
    walls = [shift_legs(move_wall(w, *w.drive.moved_at(shift_s)), shift_s) if w.driven else w for w in scene.walls]
    return _replace_bodies(scene, discs, walls, duration_s=scene.duration_s - shift_s)


def _shift_disc(disc: Disc, scene: Scene, shift_s: float) -> Disc:
    if disc.immovable and not disc.driven:
        return disc
    (x, y), (u, v) = disc.position_m, disc.velocity_m_s
    if disc.legs:
        dx, dy = disc.drive.moved_at(shift_s)
        moved: Disc = shift_legs(disc, shift_s).model_copy(update={"position_m": (x + dx, y + dy)})
        return moved
    slowing, speed = Slowing.of(scene), math.hypot(u, v)
    flown_s = slowing.compute_flown_time(shift_s, speed)
    kept_fraction = slowing.compute_kept_fraction(shift_s, speed)
    gx, gy = (0.0, 0.0) if disc.immovable else scene.gravity_m_s2
    place = (x + u * flown_s + 0.5 * gx * shift_s * shift_s, y + v * flown_s + 0.5 * gy * shift_s * shift_s)
    velocity = (u * kept_fraction + gx * shift_s, v * kept_fraction + gy * shift_s)
    state = {"position_m": place, "velocity_m_s": velocity, "spin_rad_s": disc.spin_rad_s * kept_fraction}
    return disc.model_copy(update=state)


def _replace_bodies(scene: Scene, discs: Iterable[Disc], walls: Iterable[AnyWall], **fields: float) -> Scene:
    """Return the scene with new discs, walls and fields.

    Raises:
        SceneError: Bodies overlap.
    """
    replaced = scene.model_copy(update={"discs": tuple(discs), "walls": tuple(walls), **fields})
    # The copy of a scene is not validated: all fields have valid types, but bodies may overlap.
    replaced.model_post_init(None)
    return replaced
