"""What a bench does: every job that comes of its plan."""

from __future__ import annotations

from collections.abc import Sequence

from carom.comparator.shift import even_phases
from carom.registry import EngineInfo
from carom.runs.engines import Methods, methods_of
from carom.runs.job import Job
from carom.runs.plan import profiles_to_plan, sorted_out
from carom.runs.pool import Pool
from carom.scene import Scene
from carom.studies.bench.options import BenchPlan
from carom.studies.bench.series import default_steps


def jobs_of(
    scenes: Sequence[Scene], infos: Sequence[EngineInfo], plan: BenchPlan, pool: Pool
) -> tuple[list[Job], Methods]:
    """Return every job of the scoring pass, and what is known of its methods.

    Raises:
        InputError: There is no scene, or two have one name.
        UnknownNameError: No engine asked for has a profile of the plan.
    """
    plain, _ = sorted_out(scenes)
    profiles = profiles_to_plan(infos, plan.profiles)
    steps = {scene.name: sorted(set(plan.dts or default_steps(scene)), reverse=True) for scene in plain}
    methods = methods_of(infos, profiles, [dt_s for own in steps.values() for dt_s in own], pool)
    jobs = [
        Job(scene, method, dt_s, refinement, phase)
        for scene in plain
        for info in infos
        for refinement, dt_s in enumerate(steps[scene.name])
        for method in methods.at[info.name, dt_s]
        for phase in even_phases(plan.phases)
    ]
    return jobs, methods
