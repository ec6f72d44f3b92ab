"""Choice of Carom's own methods, PIC and PIT, for a bench."""

from __future__ import annotations

from collections.abc import Sequence

from carom.engines.registry import EngineInfo
from carom.execution.describe_engines import describe_engines
from carom.execution.job import PIT_METHOD, Method
from carom.execution.pool import Pool
from carom.studies.bench.options import BenchPlan

#: The profile of PIC whose error and run time do not depend on the step size.
EXACT_METHOD = Method("pic", "event-driven")


def list_own_methods(plan: BenchPlan) -> dict[str, Method]:
    """Return PIC and PIT, except for a method that the user requests by name. The keys are engine names."""
    return {method.engine: method for method in (EXACT_METHOD, PIT_METHOD) if method.engine not in (plan.engines or ())}


def add_own_methods(infos: Sequence[EngineInfo], plan: BenchPlan, pool: Pool) -> list[EngineInfo]:
    """Return the engines to run, with PIC and PIT first if the plan includes them."""
    own_names = list_own_methods(plan)
    other_infos = [info for info in infos if info.name not in own_names]
    return [*describe_engines(list(own_names), pool), *other_infos] if plan.own and own_names else other_infos
