"""Document and files of `carom bench`: diagrams of accuracy against run time, and tables."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

from carom.report.document import Block, Document, Figure, Figures, Lines, Media, Section, Text
from carom.report.files import fields_of, format_json
from carom.report.provenance import build_provenance, format_stamp_lines
from carom.report.render.html import render_html
from carom.report.svg import to_separate_svg
from carom.studies.bench import tables
from carom.studies.bench.baseline import PointChange, build_baseline_section, describe_baseline
from carom.studies.bench.figure import render_diagram_png, render_diagram_svg
from carom.studies.bench.options import Diagram, ErrorKind
from carom.studies.bench.result import Bench, Point, SceneBench, read_run_time
from carom.support import formatting
from carom.support.folders import build_file_name, write_files

DIAGRAM_NOTE = (
    "A cross marks a run with missed or invented impacts. All other runs find every impact. Point at a mark, or select "
    "it with the keyboard, to see its numbers and its command."
)
#: Largest number of scenes that the headline describes one by one.
SCENES_SHOWN = 2


def build_bench_document(
    bench: Bench, axes: Sequence[Diagram] = tuple(Diagram), changes: Sequence[PointChange] | None = None
) -> Document:
    """Return the document of a bench. Each scene has diagrams, tables, a list of omitted points, and notes on timing.

    Args:
        bench: The bench.
        axes: Diagrams to show.
        changes: Comparison of the points with an earlier bench, or None.
    """
    targets = tables.list_reached_targets(bench)
    suite = (tables.build_suite_table(bench, targets),) if len(bench.scenes) > 1 else ()
    compared = describe_baseline(changes) if changes is not None else ()
    sections = (
        *((build_baseline_section(changes, bench.plan.error),) if changes else ()),
        Section("Every method", suite),
        *(section for scene in bench.scenes for section in _build_scene_sections(bench, scene, axes, targets)),
        *build_provenance(bench.environment, bench.command, bench.elapsed_s),
    )
    headline = (*compared, *_describe_bench(bench), *_describe_coverage(bench))
    return Document("Carom bench", headline, sections)


def write_bench(bench: Bench, document: Document, folder: Path, axes: Sequence[Diagram] = tuple(Diagram)) -> Path:
    """Write `index.html`, `bench.json`, and one diagram per scene and pair of axes.

    Returns:
        The page.

    Raises:
        MissingExtraError: jinja2 or matplotlib is not installed.
        InputError: The folder is not writable, or contains files that Carom did not write.
    """
    scenes = [{**fields_of(scene), "scene": scene.scene.name} for scene in bench.scenes]
    files: dict[str, str | bytes] = {
        "index.html": render_html(document),
        "bench.json": format_json("bench", bench, scenes=scenes),
    }
    kind_of_error, foot = bench.plan.error, format_stamp_lines(bench.environment, bench.command)
    for scene in bench.scenes:
        for kind in _select_diagrams(scene, axes):
            name = f"{build_file_name(scene.scene.name)}-{kind.value}"
            files[f"{name}.svg"] = to_separate_svg(render_diagram_svg(scene, kind, kind_of_error))
            files[f"{name}.png"] = render_diagram_png(scene, kind, kind_of_error, foot)
    return write_files(folder, "bench", files)


def _select_diagrams(scene: SceneBench, axes: Sequence[Diagram]) -> tuple[Diagram, ...]:
    """Return the diagrams that can be drawn. Only the diagram of error against step size needs no run times."""
    return tuple(kind for kind in axes if scene.noise is not None or kind is Diagram.ERROR_DT)


def _build_scene_sections(
    bench: Bench, scene: SceneBench, axes: Sequence[Diagram], targets: Sequence[float]
) -> Iterator[Section]:
    """Yield the sections of a scene. A terminal shows only one table for several scenes."""
    figures = []
    for kind in _select_diagrams(scene, axes):
        draw = partial(render_diagram_svg, scene, kind, bench.plan.error)
        figures.append(Figures((Figure(draw, f"{kind.heading}. {DIAGRAM_NOTE}"),), large=True))
    described = (Text(scene.scene.description, Media.ON_PAPER),) if scene.scene.description else ()
    answer_text = Text(describe_scene(scene, bench.plan.target, bench.plan.error), Media.IN_FULL)
    table = tables.build_method_table(scene, bench.plan.error, targets)
    note = Text(tables.TABLE_NOTE, Media.IN_FULL)
    methods: tuple[Block, ...] = (table, Text(tables.TABLE_SHORT, Media.TERMINAL), note)
    if len(bench.scenes) > 1:
        methods = (table._replace(only=Media.IN_FULL), note)
        described = (answer_text, *described)
    points = tables.build_point_table(scene, bench.plan)
    yield Section(scene.scene.name, (*described, *figures[:1], *methods, *figures[1:], points))
    left_out = tuple(_describe_missing_points(scene))
    yield Section("Omitted points", (Lines(left_out, Media.IN_FULL),) if left_out else (), level=3)
    if (noise := scene.noise) is not None:
        how = (
            f"The runs were timed at {scene.timed_at} in {formatting.format_count(scene.rounds, 'round')} of random "
            f"order (seed {bench.plan.seed}). During a timed run, the bench runs nothing else and does not observe "
            f"the engine. To measure noise, fixed work of {formatting.format_number(noise.work_s * 1e3)} ms was timed "
            f"{noise.probes} times between the runs. The middle half of these times spans "
            f"{formatting.format_percent(noise.interquartile)} of the median, and the longest time is "
            f"{formatting.format_ratio(noise.worst)} the median."
        )
        yield Section("How it was timed", (Text(how, Media.IN_FULL),), level=3)


def _describe_bench(bench: Bench) -> Iterator[str]:
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
    target_text = f"{tables.format_error(target, kind)} error"
    if fastest:
        most_common = sorted(fastest.items(), key=lambda item: -len(item[1]))
        best = formatting.join_words([f"{name} on {_format_scenes(scenes, bench)}" for name, scenes in most_common])
        parts.append(f"the fastest engine with at most {target_text} is {best.removesuffix(' on every scene')}")
    unreached = [scene for scene, point in results if point is None]
    lossy = [scene for scene in unreached if not any(curve.best and curve.best.is_correct for curve in scene.engines)]
    if lossy:
        parts.append(f"every engine misses or invents impacts on {_format_scenes(lossy, bench)}")
    if len(unreached) > len(lossy):
        rest = formatting.format_count(len(unreached) - len(lossy), "scene") if fastest or lossy else "any scene"
        parts.append(f"no engine reaches {target_text} on {rest}")
    yield formatting.capitalise(f"{'; '.join(parts)}.")
    if len(bench.scenes) <= SCENES_SHOWN:
        yield from (describe_scene(scene, target, kind, next_best=False) for scene in bench.scenes)


def _format_time_range(points: list[Point]) -> str:
    """Return the smallest and the largest run time as text; only one time if both have the same text."""
    spent = sorted((point.timing.advance_s for point in points if point.timing), key=lambda time: time.median)
    ends = dict.fromkeys(tables.format_milliseconds(time) for time in (*spent[:1], *spent[-1:]))
    return f" in {' to '.join(ends)} ms" if ends else ""


def _format_scenes(scenes: list[SceneBench], bench: Bench) -> str:
    """Return the names of scenes, or the number of scenes if the bench has many."""
    if len(scenes) == len(bench.scenes):
        return "every scene"
    if len(bench.scenes) > SCENES_SHOWN:
        return formatting.format_count(len(scenes), "scene")
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
        parts.append(f"PIC takes {tables.format_milliseconds(timing.advance_s)} ms" if timing else "PIC is exact")
    best_points = [curve.best for curve in scene.engines if curve.best is not None]
    sound = [point for point in best_points if point.is_correct]
    if sound:
        parts += _describe_engines(scene, sound[0], target, kind)
        other_points = [point for point in sound if point.engine != sound[0].engine]
        parts += [f"the next best engine is {_describe_point(point, kind)}" for point in other_points[:next_best]]
    elif not best_points:
        parts.append("no engine was scored")
    elif (best := best_points[0]).missed_and_spurious:
        parts.append(
            f"every engine misses or invents impacts at every step size; the best is {best.method.phrase}, which "
            f"{tables.format_losses(best)}{_format_run_time(best)} at steps of {formatting.format_step(best.dt_s)}"
        )
    else:
        parts.append("no error could be measured")
    return f"{scene.scene.name}: {'. '.join([parts[0], *map(formatting.capitalise, parts[1:])])}."


def _describe_engines(scene: SceneBench, best: Point, target: float, kind: ErrorKind) -> Iterator[str]:
    target_text = f"{tables.format_error(target, kind)} error"
    cheap = scene.find_cheapest_engine(target)
    if cheap is None:
        which = "the most accurate engine"
        if best.error > target:  # without run times, the fastest engine is unknown
            which = f"no engine reaches {target_text} at the tested step sizes. The most accurate"
        yield f"{which} is {_describe_point(best, kind)}"
    elif cheap.at == best.at:
        described = f"{_describe_point(best, kind)}{_format_pic_ratio(scene, best)}"
        yield f"the most accurate engine, and the fastest with at most {target_text}, is {described}"
    else:
        at = f" ms at steps of {formatting.format_step(cheap.dt_s)}"
        cost = f" with {tables.format_milliseconds(cheap.timing.advance_s)}{at}" if cheap.timing else ""
        ratio = _format_pic_ratio(scene, cheap)
        yield f"the fastest engine with at most {target_text} is {cheap.method.phrase}{cost}{ratio}"
        yield f"the most accurate is {_describe_point(best, kind)}"


def _describe_point(point: Point, kind: ErrorKind) -> str:
    error = tables.format_error(point.error, kind)
    step = formatting.format_step(point.dt_s)
    return f"{point.method.phrase} with {error} error{_format_run_time(point)} at steps of {step}"


def _format_run_time(point: Point) -> str:
    return f" in {tables.format_milliseconds(point.timing.advance_s)} ms" if point.timing else ""


def _format_pic_ratio(scene: SceneBench, point: Point) -> str:
    exact = scene.exact
    if exact is None or exact.timing is None or point.timing is None:
        return ""
    return f" ({formatting.format_ratio(read_run_time(point) / read_run_time(exact))} PIC's time)"


def _describe_coverage(bench: Bench) -> Iterator[str]:
    """Yield a sentence that counts the points without a score or a run time, if there are any."""
    points = [point for scene in bench.scenes for point in scene.points]
    unrun, untimed = [p.reason for p in points if p.reason], [p.untimed for p in points if p.untimed]
    parts = [
        f"{len(reasons)} of {len(points)} points could not be {action}"
        for reasons, action in ((unrun, "scored"), (untimed, "timed"))
        if reasons
    ]
    if parts:
        all_reasons = {*unrun, *untimed}
        why = f": {all_reasons.pop()}" if len(all_reasons) == 1 else "; the page lists the reasons"
        yield f"{formatting.join_words(parts)}{why}."


def _describe_missing_points(bench: SceneBench) -> Iterator[str]:
    """Yield a line for each reason why points were not scored or not timed."""
    missing = formatting.group_by(
        ((problem, reason), (point.method.label, formatting.format_step(point.dt_s)))
        for point in bench.points
        for problem, reason in (("not scored", point.reason), ("not timed", point.untimed))
        if reason
    )
    for (problem, reason), points in missing.items():
        by_curve = formatting.group_by(points)
        by_steps = formatting.group_by((formatting.join_words(steps), subject) for subject, steps in by_curve.items())
        for at_steps, subjects in by_steps.items():
            subject = "everything" if len(subjects) == len(bench.curves) else formatting.join_words(subjects)
            yield f"{subject}, {problem} at {at_steps}: {reason}"
