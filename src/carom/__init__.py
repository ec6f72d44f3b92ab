"""Carom: a cross-check harness for disc collisions.

The names below are loaded when they are first used, so ``import carom`` costs nothing and imports no optional part.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from carom.comparator import Horizon, Score, compare, horizon
    from carom.disc_arrays import DiscArrays
    from carom.errors import CaromError, SceneError
    from carom.physics.impact_law import resolve_impact
    from carom.physics.time_of_impact import time_of_impact
    from carom.registry import EngineInfo, engines
    from carom.runs.execute import cross_check, run
    from carom.runs.results import Results
    from carom.scene import Disc, Scene, Wall, load_scene, save_scene
    from carom.solvers.certified import CertifiedTrace, certify
    from carom.solvers.event_driven.run import EventDrivenRun
    from carom.solvers.pic import solve_pic
    from carom.solvers.pit.solve import solve_pit
    from carom.solvers.plain.framewise import solve_pic_framewise
    from carom.trace import Outcome, Trace

__all__ = [
    "CaromError",
    "CertifiedTrace",
    "Disc",
    "DiscArrays",
    "EngineInfo",
    "EventDrivenRun",
    "Horizon",
    "Outcome",
    "Results",
    "Scene",
    "SceneError",
    "Score",
    "Trace",
    "Wall",
    "certify",
    "compare",
    "cross_check",
    "engines",
    "horizon",
    "load_scene",
    "resolve_impact",
    "run",
    "save_scene",
    "solve_pic",
    "solve_pic_framewise",
    "solve_pit",
    "time_of_impact",
]

_HOME = {
    "CaromError": "carom.errors",
    "CertifiedTrace": "carom.solvers.certified.result",
    "Disc": "carom.scene",
    "DiscArrays": "carom.disc_arrays",
    "EngineInfo": "carom.registry",
    "EventDrivenRun": "carom.solvers.event_driven.run",
    "Horizon": "carom.comparator.horizon",
    "Outcome": "carom.trace",
    "Results": "carom.runs.results",
    "Scene": "carom.scene",
    "SceneError": "carom.errors",
    "Score": "carom.comparator",
    "Trace": "carom.trace",
    "Wall": "carom.scene",
    "certify": "carom.solvers.certified.certify",
    "compare": "carom.comparator",
    "cross_check": "carom.runs.execute",
    "engines": "carom.registry",
    "horizon": "carom.comparator",
    "load_scene": "carom.scene",
    "resolve_impact": "carom.physics.impact_law",
    "run": "carom.runs.execute",
    "save_scene": "carom.scene",
    "solve_pic": "carom.solvers.pic",
    "solve_pic_framewise": "carom.solvers.plain.framewise",
    "solve_pit": "carom.solvers.pit.solve",
    "time_of_impact": "carom.physics.time_of_impact",
}


def __getattr__(name: str) -> Any:
    if name in _HOME:
        globals()[name] = value = getattr(importlib.import_module(_HOME[name]), name)
        return value
    message = f"module 'carom' has no attribute {name!r}"
    raise AttributeError(message)


def __dir__() -> list[str]:
    return sorted(__all__)
