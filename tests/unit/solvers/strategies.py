"""Random scenes for the solvers' tests."""

from __future__ import annotations

import math

from hypothesis import strategies as st
from tests.stage import disc_at, staged, wall_at

from carom.scene import Disc, Scene, Wall

#: Distance of neighbouring places; a disc of radius 1 at most, moved by 0.4 at most, never reaches its neighbour's.
PITCH = 3.0


@st.composite
def scenes(draw: st.DrawFn, *, max_discs: int = 5) -> Scene:
    """Draw a scene of discs on a jittered 3 by 3 grid, some immovable, in a box, beside an oblique wall, or free.

    Numbers are quotients by 97, so that nothing comes out exact by luck; the discs head for the middle, so that they
    meet.
    """
    places = draw(st.lists(st.integers(0, 8), min_size=1, max_size=max_discs, unique=True))
    jitter = st.integers(-38, 38).map(lambda k: k / 97)
    discs = []
    for place in places:
        x = PITCH * (place % 3 - 1) + draw(jitter)
        y = PITCH * (place // 3 - 1) + draw(jitter)
        mass = draw(st.sampled_from([1.0, 1.0, 0.1, 1000.0, math.inf]))
        velocity = (0.0, 0.0)
        if mass < math.inf:
            pull = draw(st.integers(0, 100)) / 97
            velocity = (draw(st.integers(-300, 300)) / 97 - pull * x, draw(st.integers(-300, 300)) / 97 - pull * y)
        radius = draw(st.integers(20, 97)) / 97
        discs.append(Disc(position_m=(x, y), velocity_m_s=velocity, radius_m=radius, mass_kg=mass))
    box = [wall_at(-5, 0, 1, 0), wall_at(5, 0, -1, 0), wall_at(0, -5, 0, 1), wall_at(0, 5, 0, -1)]
    oblique = [Wall(point_m=(-10, 0), normal=(3, 4))]
    return staged(
        "random",
        *discs,
        *draw(st.sampled_from([[], box, box[:2], oblique])),
        restitution=draw(st.sampled_from([1.0, 1.0, 0.9, 0.5, 0.0])),
        wall_restitution=draw(st.sampled_from([1.0, 1.0, 0.9, 0.5, 0.0])),
        duration_s=3.0,
    )


def line(*positions: float, velocities: tuple[float, ...], restitution: float = 1.0, duration_s: float = 10.0) -> Scene:
    """Return discs of 1 kg and radius 0.5 on the x axis."""
    return staged(
        "line",
        *[disc_at(x, 0.0, v, 0.0) for x, v in zip(positions, velocities, strict=True)],
        restitution=restitution,
        duration_s=duration_s,
    )
