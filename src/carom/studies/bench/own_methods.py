"""Choice of Carom's own methods, PIC and PIT, for a bench."""

from __future__ import annotations

from collections.abc import Sequence

from carom.engines.registry import EngineInfo
from carom.execution.describe_engines import describe_engines
from carom.execution.job import PIT_METHOD, Method
from carom.execution.pool import Pool

#: The profile of PIC whose error and run time do not depend on the step size.
EXACT_METHOD = Method("pic", "event-driven")


def list_own_methods(engine_names: Sequence[str] | None) -> dict[str, Method]:
    """Return PIC and PIT, except for a method that the user requests by name. The keys are engine names.

    Args:
        engine_names: Names of the requested adapters; None for all.
    """
    return {method.engine: method for method in (EXACT_METHOD, PIT_METHOD) if method.engine not in (engine_names or ())}


def add_own_methods(
    infos: Sequence[EngineInfo], engine_names: Sequence[str] | None, pool: Pool, *, needs_own_methods: bool
) -> list[EngineInfo]:
    """Return the engines to run, with PIC and PIT first.

    Args:
        infos: Descriptions of the engines.
        engine_names: Names of the requested adapters; None for all.
        pool: Pool of worker processes that describe adapters; it is not closed.
        needs_own_methods: Whether PIC and PIT run even if the user does not request them by name.
    """
    own_names = list_own_methods(engine_names)
    other_infos = [info for info in infos if info.name not in own_names]
    return [*describe_engines(list(own_names), pool), *other_infos] if needs_own_methods and own_names else other_infos
