"""Carom's own methods, which every bench runs: what exact costs, and what sampling costs."""

from __future__ import annotations

from collections.abc import Sequence

from carom.engines.registry import EngineInfo
from carom.execution.engines import describe_engines
from carom.execution.job import PIT_METHOD, Method
from carom.execution.pool import Pool

#: Its error does not depend on the step, and its run time is what exact costs.
EXACT_METHOD = Method("pic", "event-driven")

OWN_METHODS = (EXACT_METHOD, PIT_METHOD)


def with_own_methods(
    infos: Sequence[EngineInfo], asked: Sequence[str] | None, pool: Pool, *, own: bool
) -> list[EngineInfo]:
    """Return engines with PIC and PIT first, or without those of them that were not asked for by name.

    Args:
        infos: What is known of the engines.
        asked: Names of adapters that were asked for; None for all.
        pool: Where adapters are asked; it stays open.
        own: Whether PIC and PIT run, whichever engines are asked for.
    """
    added = [method.engine for method in OWN_METHODS if method.engine not in (asked or ())]
    others = [info for info in infos if info.name not in added]
    return [*describe_engines(added, pool), *others] if own and added else others
