"""Carom: a cross-check harness for disc collisions.

Each public name is loaded when it is first used. So ``import carom`` takes little time and imports no optional
dependency. The import raises an ImportError if the compiled extension is missing.
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable
from types import ModuleType
from typing import TYPE_CHECKING, Any

from carom.core.extension import require_extension
from carom.support import hooks

if TYPE_CHECKING:
    from carom.comparator import Score as Score
    from carom.comparator import compare as compare
    from carom.comparator import horizon as horizon
    from carom.comparator.horizon import Horizon as Horizon
    from carom.core.impact_law import resolve_impact as resolve_impact
    from carom.core.time_of_impact import time_of_impact as time_of_impact
    from carom.engines.registry import EngineInfo as EngineInfo
    from carom.errors import CaromError as CaromError
    from carom.errors import SceneError as SceneError
    from carom.execution.describe_engines import engines as engines
    from carom.execution.results import Results as Results
    from carom.model.disc_arrays import DiscArrays as DiscArrays
    from carom.model.scene import Chain as Chain
    from carom.model.scene import Disc as Disc
    from carom.model.scene import Ring as Ring
    from carom.model.scene import Scene as Scene
    from carom.model.scene import Wall as Wall
    from carom.model.scene_file import load_scene as load_scene
    from carom.model.scene_file import save_scene as save_scene
    from carom.model.trace import Mode as Mode
    from carom.model.trace import Outcome as Outcome
    from carom.model.trace import Trace as Trace
    from carom.report.notebook import plot_beside as plot_beside
    from carom.solvers.certified.certify import certify as certify
    from carom.solvers.certified.result import CertifiedTrace as CertifiedTrace
    from carom.solvers.event_driven.run import EventDrivenRun as EventDrivenRun
    from carom.solvers.pic import solve_pic as solve_pic
    from carom.solvers.pit.solve import solve_pit as solve_pit
    from carom.solvers.reference.algorithm_2 import solve_pic_framewise as solve_pic_framewise
    from carom.studies.advise.api import advise as advise
    from carom.studies.cross_check.demo import demo as demo
    from carom.studies.cross_check.replay import replay as replay
    from carom.studies.cross_check.run import cross_check as cross_check
    from carom.studies.cross_check.run import run as run
    from carom.studies.tune.api import tune as tune


_HOMES = {
    "carom.comparator": ("Score", "compare", "horizon"),
    "carom.comparator.horizon": ("Horizon",),
    "carom.model.disc_arrays": ("DiscArrays",),
    "carom.errors": ("CaromError", "SceneError"),
    "carom.core.impact_law": ("resolve_impact",),
    "carom.core.time_of_impact": ("time_of_impact",),
    "carom.engines.registry": ("EngineInfo",),
    "carom.studies.advise.api": ("advise",),
    "carom.studies.tune.api": ("tune",),
    "carom.studies.cross_check.demo": ("demo",),
    "carom.report.notebook": ("plot_beside",),
    "carom.studies.cross_check.replay": ("replay",),
    "carom.execution.describe_engines": ("engines",),
    "carom.studies.cross_check.run": ("cross_check", "run"),
    "carom.execution.results": ("Results",),
    "carom.model.scene": ("Chain", "Disc", "Ring", "Scene", "Wall"),
    "carom.model.scene_file": ("load_scene", "save_scene"),
    "carom.solvers.certified.certify": ("certify",),
    "carom.solvers.certified.result": ("CertifiedTrace",),
    "carom.solvers.event_driven.run": ("EventDrivenRun",),
    "carom.solvers.pic": ("solve_pic",),
    "carom.solvers.pit.solve": ("solve_pit",),
    "carom.solvers.reference.algorithm_2": ("solve_pic_framewise",),
    "carom.model.trace": ("Mode", "Outcome", "Trace"),
}
#: Import paths of earlier versions, and the modules that replace them. The module `carom.adapter` is not listed,
#: because its file still exists.
_MOVED = {
    "carom.program": ("carom.engines.protocol",),
    "carom.program.adapter": ("carom.engines.protocol.adapter",),
    "carom.runs": ("carom.execution",),
    "carom.runs.imported": ("carom.execution.scene_import",),
    "carom.scene": ("carom.model.scene", "carom.model.scene_file"),
    "carom.scenes": ("carom.catalogue",),
    "carom.trace": ("carom.model.trace", "carom.model.flights", "carom.model.energy"),
}
_HOME = dict(sorted((name, module) for module, names in _HOMES.items() for name in names))

__all__ = list(_HOME)


def __getattr__(name: str) -> Any:
    if name in _HOME:
        globals()[name] = value = getattr(importlib.import_module(_HOME[name]), name)
        return value
    if f"carom.{name}" in _MOVED:
        return sys.modules[f"carom.{name}"]
    raise AttributeError(f"module 'carom' has no attribute {name!r}")


def __dir__() -> list[str]:
    return list(_HOME)


def scene(name: str) -> Scene:
    """Return the scene of the catalogue with a full name such as ``paper/missed``.

    Examples:
        >>> carom.scene("paper/missed").frame_rate_hz
        24.0
    """
    from carom.model.scene import to_scene

    return to_scene(name)


def _find_scene(name: str) -> Scene:
    """Return a scene of the catalogue.

    The package `carom.model` must not import the catalogue, and calls this function instead.
    """
    from carom.catalogue import scene_named

    return scene_named(name)


#: Names of functions that show a result, and the modules that contain them.
_VIEWS = {"summary": "carom.report.summary", "to_pandas": "carom.report.data_frames"}
_VIEWS |= dict.fromkeys(("html_of", "plot"), "carom.report.notebook")


def _find_view(name: str) -> Callable[..., Any]:
    """Import and return a function that shows a result.

    Result classes use this function, because their modules must not import `carom.report`.
    """
    view: Callable[..., Any] = getattr(importlib.import_module(_VIEWS[name]), name)
    return view


class _Moved(ModuleType):
    """A module at an import path of an earlier version.

    When a name of such a module is first used, the module imports its replacement.
    """

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):  # introspection reads names such as `__path__` from every module
            raise AttributeError(name)
        if (path := f"{self.__name__}.{name}") in _MOVED:
            return sys.modules[path]
        for module in map(importlib.import_module, _MOVED[self.__name__]):
            if hasattr(module, name):
                return getattr(module, name)
        raise AttributeError(f"module {self.__name__!r} has no attribute {name!r}")


class _Engines(ModuleType):
    """The package `carom.engines`. Calling the package calls the public function `carom.engines`."""

    def __call__(self, *args: Any, **options: Any) -> list[EngineInfo]:
        from carom.execution.describe_engines import engines

        return engines(*args, **options)


require_extension()
sys.modules.update({name: _Moved(name) for name in _MOVED})
hooks.find_view, hooks.find_scene = _find_view, _find_scene
# the import binds `carom.engines` to the package, so the package must be callable
importlib.import_module("carom.engines").__class__ = _Engines
