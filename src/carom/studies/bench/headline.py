"""Headline of a bench: PIC's run time, and the errors and run times of the best engines."""

from __future__ import annotations

from collections.abc import Iterator

from carom.report import formatting
from carom.studies.bench.axes import ErrorKind
from carom.studies.bench.result import Bench, Point, SceneBench, read_run_time
from carom.studies.bench.tables import format_error, format_losses, format_milliseconds

#: Largest number of scenes that the headline describes one by one.
SCENES_SHOWN = 2


def describe_bench(bench: Bench) -> Iterator[str]:
    """Yield the sentences of the headline. For several scenes, the first sentence is a summary."""
    target, kind = bench.plan.target, bench.plan.error
    if len(bench.scenes) == 1:
        yield describe_scene(bench.scenes[0], target, kind)
        return
    exact = [scene.exact for scene in bench.scenes if scene.exact is not None]
    scene_count = formatting.format_count(len(bench.scenes), "scene")
    results = [(scene, scene.find_cheapest_engine(target)) for scene in bench.scenes]
    fastest = formatting.group_by((point.method.phrase, scene) for scene, point in results if point is not None)
    parts = [f"PIC is exact on {len(exact)} of {scene_count}{_format_time_range(exact)}"] if exact else []
    target_text = f"{format_error(target, kind)} error"
    if fastest:
        most_common = sorted(fastest.items(), key=lambda item: -len(item[1]))
        best = formatting.join_words([f"{name} on {_format_scenes(scenes, bench)}" for name, scenes in most_common])
        parts.append(f"the fastest engine with at most {target_text} is {best.removesuffix(' on every scene')}")
    unreached = [scene for scene, point in results if point is None]
    lossy = [scene for scene in unreached if not any(curve.best and curve.best.is_correct for curve in scene.engines)]
    if lossy:
        parts.append(f"every engine misses or invents impacts on {_format_scenes(lossy, bench)}")
    if len(unreached) > len(lossy):
        parts.append(f"no engine reaches {target_text} on {len(unreached) - len(lossy) if fastest or lossy else 'any'}")
    yield formatting.capitalise(f"{'; '.join(parts)}.")
    if len(bench.scenes) <= SCENES_SHOWN:
        yield from (describe_scene(scene, target, kind, next_best=False) for scene in bench.scenes)


def _format_time_range(points: list[Point]) -> str:
    """Return the smallest and the largest run time as text; only one time if both have the same text."""
    spent = sorted((point.timing.advance_s for point in points if point.timing), key=lambda time: time.median)
    ends = dict.fromkeys(format_milliseconds(time) for time in (*spent[:1], *spent[-1:]))
    return f" in {' to '.join(ends)} ms" if ends else ""


def _format_scenes(scenes: list[SceneBench], bench: Bench) -> str:
    """Return the names of scenes, or the number of scenes if the bench has many."""
    if len(scenes) == len(bench.scenes):
        return "every scene"
    if len(bench.scenes) > SCENES_SHOWN:
        return str(len(scenes))
    return formatting.join_words([one.scene.name for one in scenes])


def describe_scene(scene: SceneBench, target: float, kind: ErrorKind, *, next_best: bool = True) -> str:
    """Describe the results of a scene, and name PIC's run time and the best engines.

    Args:
        scene: Results of the scene.
        target: Error that the fastest engine must reach.
        kind: Kind of error.
        next_best: Whether to also name the engine that is second in accuracy.
    """
    exact, parts = scene.exact, list[str]()
    if exact is not None:
        timing = exact.timing
        parts.append(f"PIC takes {format_milliseconds(timing.advance_s)} ms" if timing else "PIC is exact")
    best_points = [curve.best for curve in scene.engines if curve.best is not None]
    sound = [point for point in best_points if point.is_correct]
    if sound:
        parts += _describe_engines(scene, sound[0], target, kind)
        other_points = [point for point in sound if point.engine != sound[0].engine]
        parts += [f"the next engine is {_describe_point(point, kind)}" for point in other_points[:next_best]]
    elif not best_points:
        parts.append("no engine was scored")
    elif (best := best_points[0]).missed_and_spurious:
        parts.append(
            f"every engine misses or invents impacts at every step size; the best is {best.method.phrase}, which "
            f"{format_losses(best)}{_format_run_time(best)} at steps of {formatting.format_step(best.dt_s)}"
        )
    else:
        parts.append("the scene has no error to measure")
    return f"{scene.scene.name}: {'. '.join([parts[0], *map(formatting.capitalise, parts[1:])])}."


def _describe_engines(scene: SceneBench, best: Point, target: float, kind: ErrorKind) -> Iterator[str]:
    target_text, cheap = f"{format_error(target, kind)} error", scene.find_cheapest_engine(target)
    if cheap is None:
        which = "the most accurate engine"
        if best.error > target:  # without run times, no engine is the fastest
            which = f"no engine reaches {target_text} at the tested step sizes. The most accurate"
        yield f"{which} is {_describe_point(best, kind)}"
    elif cheap.at == best.at:
        described = f"{_describe_point(best, kind)}{_format_pic_ratio(scene, best)}"
        yield f"the most accurate engine, and the fastest with at most {target_text}, is {described}"
    else:
        at = f" ms at steps of {formatting.format_step(cheap.dt_s)}"
        cost = f" with {format_milliseconds(cheap.timing.advance_s)}{at}" if cheap.timing else ""
        ratio = _format_pic_ratio(scene, cheap)
        yield f"the fastest engine with at most {target_text} is {cheap.method.phrase}{cost}{ratio}"
        yield f"the most accurate is {_describe_point(best, kind)}"


def _describe_point(point: Point, kind: ErrorKind) -> str:
    error = format_error(point.error, kind)
    step = formatting.format_step(point.dt_s)
    return f"{point.method.phrase} with {error} error{_format_run_time(point)} at steps of {step}"


def _format_run_time(point: Point) -> str:
    return f" in {format_milliseconds(point.timing.advance_s)} ms" if point.timing else ""


def _format_pic_ratio(scene: SceneBench, point: Point) -> str:
    exact = scene.exact
    if exact is None or exact.timing is None or point.timing is None:
        return ""
    return f" ({formatting.format_ratio(read_run_time(point) / read_run_time(exact))} PIC's time)"
