"""Comparison of found settings with hand-written profiles on the group `classics`."""

from collections.abc import Sequence

from carom.catalogue import find_scenes
from carom.execution.job import Method
from carom.execution.pool import LocalPool
from carom.execution.scene_reference import build_reference, solve_reference
from carom.model.trace import Trace
from carom.studies.tune.evaluate import Evaluator
from carom.studies.tune.objective import Merit, compute_merit
from carom.studies.tune.options import TuneOptions
from carom.studies.tune.run import tune


def compute_merits(engine: str, profiles: Sequence[str], trials: int) -> tuple[Merit, list[Merit]]:
    """Return the merit of what is found from the shipped settings, and that of each profile."""
    scenes = [entry.scene for entry in find_scenes(["classics"])]
    traces = {scene: trace for scene in scenes if isinstance(trace := solve_reference(scene), Trace)}
    ends = {scene.name: build_reference(trace, None).horizon_s for scene, trace in traces.items()}
    with LocalPool() as pool:
        steps = {scene: 1 / scene.frame_rate_hz for scene in scenes}
        evaluator = Evaluator(steps, {name: end_s for name, end_s in ends.items() if end_s is not None}, pool)
        written = [compute_merit(evaluator.evaluate(Method(engine, profile), scenes)) for profile in profiles]
    return tune(engine, scenes, TuneOptions(trials=trials)).best.merit, written


def assert_as_good(found: Merit, written: Sequence[Merit]) -> None:
    """Hold what is found to no more scenes wrong, and no fewer exact or close, than with any of the profiles."""
    for profile in written:
        assert found.wrong <= profile.wrong
        assert found.imprecise <= profile.imprecise
