"""Document and files of `carom bench`: diagrams of accuracy against run time, and tables."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

from carom.report import formatting
from carom.report.document import Block, Document, Figure, Figures, Lines, Media, Section, Text
from carom.report.files import fields_of, format_json
from carom.report.provenance import build_provenance, format_stamp_lines
from carom.report.render.html import render_html
from carom.report.svg import to_separate_svg
from carom.studies.bench import tables
from carom.studies.bench.axes import Diagram
from carom.studies.bench.baseline import PointChange, build_baseline_section, describe_baseline
from carom.studies.bench.figure import render_diagram_png, render_diagram_svg
from carom.studies.bench.headline import describe_bench, describe_scene
from carom.studies.bench.result import Bench, SceneBench
from carom.support.folders import build_file_name, write_files

DIAGRAM_NOTE = (
    "A cross marks a run with missed or invented impacts. All other runs find every impact. Point at a mark, or select "
    "it with the keyboard, to see its numbers and its command."
)


def build_bench_document(
    bench: Bench, axes: Sequence[Diagram] = tuple(Diagram), changes: Sequence[PointChange] | None = None
) -> Document:
    """Return the document of a bench: for each scene its diagrams, tables, omitted points and the conditions of timing.

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
    headline = (*compared, *describe_bench(bench), *_describe_coverage(bench))
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
            f"{noise.probes} times between the runs. The middle half of these times has a range of "
            f"{formatting.format_percent(noise.interquartile)} of the median, and the slowest time is "
            f"{formatting.format_ratio(noise.worst)} the median."
        )
        yield Section("How it was timed", (Text(how, Media.IN_FULL),), level=3)


def _describe_coverage(bench: Bench) -> Iterator[str]:
    """Yield a sentence on the number of points without a score or a run time, if there are any."""
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
