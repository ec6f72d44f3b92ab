"""Which jobs a cross-check has."""

from __future__ import annotations

from tests.stage import disc_at, staged

from carom.runs.options import Options
from carom.runs.plan import plan_of
from carom.runs.pool import InProcess

SCENE = staged("pair", disc_at(0, 0, 1, 0), disc_at(3, 0), duration_s=3.0)


def refinements(profile: str, dts: tuple[float, ...] | None = None) -> list[int]:
    """Return at which steps, numbered from the coarsest, a profile of pymunk's runs."""
    with InProcess() as pool:
        plan = plan_of([SCENE], Options(engines=("pymunk",), profiles=("tuned", "located"), dts=dts), pool)
    return [job.refinement for job in plan.jobs if job.method.profile == profile]


def test_a_located_profile_runs_at_the_coarsest_step_alone() -> None:
    """Its steps are cut where impacts are, so finer ones tell nothing more; the other profiles run at each of three."""
    assert refinements("tuned") == [0, 1, 2]
    assert refinements("located") == [0]


def test_a_located_profile_runs_at_each_step_that_is_asked_for() -> None:
    """Who names the steps gets them."""
    assert refinements("tuned", (0.1, 0.05)) == refinements("located", (0.1, 0.05)) == [0, 1]
