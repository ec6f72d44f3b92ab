"""Comparison of PIC with pooltool, which also computes instants of impacts: ``python -m benchmarks.pooltool``.

The scenes have equal elastic balls, no walls, and the least friction that pooltool accepts. The output shows the number
of impacts of both programs, the number of first impacts that have the same order, the differences of their times, and
the ratio of processor times. Release 0.6.0 of pooltool requires a release of panda3d that PyPI does not have. So run
``pip install --no-deps pooltool-billiards``, and install the other requirements with an available release of panda3d.
"""

from __future__ import annotations

import itertools
import math
import statistics
import time
from typing import Any

from benchmarks.arguments import count, parser, run

import carom
from carom.catalogue.groups.classics_many_discs import stage_boxed_gas
from carom.errors import CaromError

ROUNDS = 5

#: pooltool refuses a friction of 0. This friction slows a ball by 1e-14 m/s in a second.
FRICTION = 1e-15


def cloud(side: int) -> carom.Scene:
    """Return `side` times `side` balls that start in all directions, with gaps of two thirds of a radius."""
    gas = stage_boxed_gas(side, radius_m=0.03, pitch_m=0.08, speed=1.0, duration_s=1.0).scene
    return carom.Scene(name=f"{side * side} balls", discs=gas.discs, duration_s=gas.duration_s)


def _of_pooltool(scene: carom.Scene) -> Any:
    import numpy as np
    import pooltool
    from pooltool.objects.ball.datatypes import BallState
    from pooltool.objects.table.components import CushionSegments

    table = pooltool.Table.default()
    table.cushion_segments, table.pockets = CushionSegments(linear={}, circular={}), {}
    balls = {}
    for i, disc in enumerate(scene.discs):
        friction = {"u_s": FRICTION, "u_r": FRICTION, "u_sp_proportionality": FRICTION}
        ball = pooltool.Ball.create(str(i), R=disc.radius_m, m=disc.mass_kg, **friction)
        motion = np.array([[*disc.position_m, disc.radius_m], [*disc.velocity_m_s, 0.0], [0.0, 0.0, 0.0]])
        ball.state = BallState(motion, pooltool.constants.sliding)
        balls[str(i)] = ball
    return pooltool.System(cue=pooltool.Cue(cue_ball_id="0"), table=table, balls=balls)


def peer(scene: carom.Scene) -> tuple[list[tuple[float, int, int]], float]:
    """Return pooltool's impacts (time, first, second), and its processor time in seconds.

    Raises:
        CaromError: pooltool is not installed.
    """
    try:
        import pooltool
        from pooltool.physics.resolve.ball_ball.frictionless_elastic import FrictionlessElastic
    except ImportError as error:
        raise CaromError(f"pooltool is not installed: {error}; see the docstring of benchmarks/pooltool.py") from error
    engine = pooltool.physics.PhysicsEngine()
    engine.resolver.ball_ball = FrictionlessElastic()
    system = _of_pooltool(scene)
    started = time.process_time()
    pooltool.simulate(system, engine=engine, inplace=True, t_final=scene.duration_s)
    seconds = time.process_time() - started
    hits = [event for event in system.events if event.event_type == pooltool.EventType.BALL_BALL]
    found = []
    for hit in hits:
        first, second = sorted(int(name) for name in hit.ids)
        found.append((float(hit.time), first, second))
    return [one for one in found if one[0] <= scene.duration_s], seconds


def main(largest: int = 7) -> None:
    """Compare the programs on clouds of growing size.

    Raises:
        CaromError: pooltool is not installed.
    """
    peer(cloud(2))  # The first call compiles pooltool's functions.
    print(
        f"{'scene':>9} {'PIC':>6} {'pooltool':>9} {'in order':>9} {'first time':>11} {'largest':>9} {'time ratio':>11}"
    )
    for side in range(2, largest + 1):
        scene = cloud(side)
        theirs, _ = peer(scene)
        ours = [(float(hit["time_s"]), int(hit["first"]), int(hit["second"])) for hit in carom.solve_pic(scene).impacts]
        same = list(itertools.takewhile(lambda both: both[0][1:] == both[1][1:], zip(ours, theirs, strict=False)))
        errors = [abs(one[0] - other[0]) for one, other in same] or [math.nan]
        print(
            f"{scene.name:>9} {len(ours):6} {len(theirs):9} {len(same):9} {errors[0]:11.1e} {max(errors):9.1e}"
            f" {_ratio(scene):11.1f}"
        )


def _ratio(scene: carom.Scene) -> float:
    ratios = []
    for _ in range(ROUNDS):
        started = time.process_time()
        carom.solve_pic(scene)
        ours = time.process_time() - started
        ratios.append(peer(scene)[1] / ours)
    return statistics.median(ratios)


if __name__ == "__main__":
    arguments = parser("benchmarks.pooltool", __doc__)
    arguments.add_argument("--largest", type=count, default=7, help="balls on a side of the largest cloud")
    run(arguments, main)
