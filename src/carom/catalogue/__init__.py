"""The catalogue: scenes with known answers, which come from mathematics or a cited source, not from Carom's code."""

from carom.catalogue.bug_reports.bug_report import BugReport, Symptom
from carom.catalogue.entry import CatalogueScene, KnownAnswer, KnownImpact, Staged, deviation
from carom.catalogue.find_scenes import all_scenes, catalogue, find_scenes, resolve_scenes, scene_named

__all__ = [
    "BugReport",
    "CatalogueScene",
    "KnownAnswer",
    "KnownImpact",
    "Staged",
    "Symptom",
    "all_scenes",
    "catalogue",
    "deviation",
    "find_scenes",
    "resolve_scenes",
    "scene_named",
]
