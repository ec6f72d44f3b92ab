"""PIC against an oracle that shares no code with it: 50 digits, every pair again at every step, textbook formulas.

How far float64 may be off is not guessed. The oracle also runs scenes that differ from the given one by a few units in
the fiftieth digit; The difference of their impacts is the scene's own condition. The allowed error of float64 is that
condition times the rounding of float64, times a few for the operations of each impact.
"""

import random
from typing import Any

from mpmath import mp, mpf
from tests.cases import each, release_after
from tests.validation.mpmath_runs import draw_lossy_scene, run_brute_force

from carom import Scene, solve_pic

DIGITS = 50
NUDGE = mpf(10) ** -35
#: Float64's unit roundoff, and what is granted for the operations of one impact (about 30, in several discs).
ROUNDOFF = 2.0**-53
OPERATIONS = 64


def draw_damped_scene(seed: int) -> Scene:
    """Return the drawn scene of a number, with one of three rates of damping, and friction and spin in every other."""
    return draw_lossy_scene(seed, rough=seed % 2 == 1).model_copy(update={"damping_per_s": (0.05, 0.3, 1.0)[seed % 3]})


@each("kind", ["floating", "falling", "damped"])
@each("seed", release_after(1, range(1, 80)))
def test_pic_error_is_within_the_condition_of_the_scene(seed: int, kind: str) -> None:
    """PIC's first impacts differ from 50-digit brute force by at most the condition of the scene times rounding."""
    falls = kind == "falling"
    scene = draw_lossy_scene(seed, immovable=not falls, gravity=(0.25, -1.0) if falls else (0.0, 0.0))
    if kind == "damped":
        scene = draw_damped_scene(seed)
    shake = random.Random(-seed)

    def nudged(value: float) -> Any:
        return mpf(value) * (1 + NUDGE * shake.choice([-1, 0, 1]))

    with mp.workdps(DIGITS):
        truth = run_brute_force(scene, 12)
        runs = [run_brute_force(scene, len(truth), nudged) for _ in range(6)]
        trace = solve_pic(scene, max_impacts=len(truth))
        assert trace.impacts[["first", "second"]].tolist() == [(event.first, event.second) for event in truth]
        for k, (event, found) in enumerate(zip(truth, trace.impacts, strict=True)):
            speed = max(abs(v) for v in event.after)
            others = [run[k] for run in runs]
            assert all((o.first, o.second) == (event.first, event.second) for o in others)
            granted = OPERATIONS * (k + 1) * ROUNDOFF
            condition = max(abs(o.time - event.time) for o in others) / NUDGE
            assert abs(found["time_s"] - event.time) <= granted * (condition + event.time)
            after = [*found["velocity_first_after"], *found["velocity_second_after"]]
            for component, value in enumerate(after):
                condition = max(abs(o.after[component] - event.after[component]) for o in others) / NUDGE
                assert abs(value - event.after[component]) <= granted * (condition + speed)
