"""Carom's own methods, which every bench runs to show the cost of exact results and of sampling."""

from __future__ import annotations

from collections.abc import Sequence

from carom.engines.registry import EngineInfo
from carom.execution.describe_engines import describe_engines
from carom.execution.job import PIT_METHOD, Method
from carom.execution.pool import Pool

#: PIC, whose error does not depend on the step size. PIC's run time is the cost of exact results.
EXACT_METHOD = Method("pic", "event-driven")

OWN_METHODS = (EXACT_METHOD, PIT_METHOD)


def add_own_methods(
    infos: Sequence[EngineInfo], engine_names: Sequence[str] | None, pool: Pool, *, needs_own_methods: bool
) -> list[EngineInfo]:
    """Return engines with PIC and PIT first. If `needs_own_methods` is False, PIC and PIT are only included on request.

    Args:
        infos: Descriptions of the engines.
        engine_names: Names of the requested adapters; None for all.
        pool: Pool for describing adapters, which stays open.
        needs_own_methods: Whether PIC and PIT run in addition to the requested engines.
    """
    added = [method.engine for method in OWN_METHODS if method.engine not in (engine_names or ())]
    other_infos = [info for info in infos if info.name not in added]
    return [*describe_engines(added, pool), *other_infos] if needs_own_methods and added else other_infos
