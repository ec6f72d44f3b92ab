"""A bench as a document: how accurate each engine is for what cost; with its diagrams and every number as files."""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

from carom.folders import file_name, write_files
from carom.pages import wording
from carom.pages.document import (
    IN_FULL,
    ON_PAPER,
    TERMINAL,
    Block,
    Document,
    Figure,
    Figures,
    Headline,
    Lines,
    Section,
    Text,
)
from carom.pages.files import as_json, fields_of, require_report_extra
from carom.pages.provenance import making, stamp_lines
from carom.pages.render.html import html
from carom.pages.svg import alone
from carom.studies.bench.axes import Diagram
from carom.studies.bench.figure import diagram_png, diagram_svg
from carom.studies.bench.noise import Noise
from carom.studies.bench.result import Bench, SceneBench, cheapest, run_s
from carom.studies.bench.tables import (
    TABLE_NOTE,
    TABLE_SHORT,
    cheapest_engine,
    engine_points,
    error_table,
    exact_or,
    is_floor,
    method_table,
    milliseconds,
    point_name,
    point_table,
    quartiles,
    suite_table,
)

#: The second error whose price is told: one for which checking once per step is no way at all.
FINE = 1e-6

DIAGRAM_NOTE = (
    "Full marks find every impact, crosses miss or invent some; thin lines: quartiles of run time, and the luckiest "
    "start. Point at a mark, or step through them by keyboard, for its numbers and its command."
)


def bench_document(bench: Bench, axes: Sequence[Diagram] = tuple(Diagram)) -> Document:
    """Return a bench: for each scene its diagrams, its tables, what is left out, and how it was timed."""
    targets = sorted({bench.plan.target, FINE}, reverse=True)
    timed = any(scene.noise is not None for scene in bench.scenes)
    suite = (suite_table(bench, targets), Text(TABLE_SHORT, TERMINAL)) if len(bench.scenes) > 1 else ()
    return Document(
        "Carom bench",
        Headline.of((*(_answers(bench, targets) if timed else ()), _scope(bench))),
        (
            Section("Every method", suite),
            *(section for scene in bench.scenes for section in _scene(bench, scene, axes, targets)),
            *making(bench.environment, bench.command, bench.elapsed_s),
        ),
    )


def write_bench(bench: Bench, folder: Path, axes: Sequence[Diagram] = tuple(Diagram)) -> Path:
    """Write `index.html`, `bench.json` and a diagram a scene and pair of axes, replacing older ones.

    Returns:
        The page.

    Raises:
        MissingExtraError: jinja2 or matplotlib, the extra `report`, is not installed.
        InputError: The folder can't be written into, or holds files of others.
    """
    require_report_extra()
    files: dict[str, str | bytes] = {"index.html": html(bench_document(bench, axes)), "bench.json": _json(bench)}
    label, foot = bench.plan.error.label, stamp_lines(bench.environment, bench.command)
    for scene in bench.scenes:
        for kind in _diagrams_of(scene, axes):
            name = f"{file_name(scene.scene.name)}-{kind.value}"
            files[f"{name}.svg"] = alone(diagram_svg(scene, kind, label))
            files[f"{name}.png"] = diagram_png(scene, kind, label, foot)
    return write_files(folder, "bench", files)


def _json(bench: Bench) -> str:
    scenes = [{**fields_of(scene), "scene": scene.scene.name} for scene in bench.scenes]
    return as_json("bench", bench, scenes=scenes)


def _diagrams_of(scene: SceneBench, axes: Sequence[Diagram]) -> tuple[Diagram, ...]:
    """Return the diagrams that can be drawn: without run times only the one of errors against steps."""
    return tuple(kind for kind in axes if scene.noise is not None or kind is Diagram.ERROR_DT)


def _scene(bench: Bench, scene: SceneBench, axes: Sequence[Diagram], targets: Sequence[float]) -> Iterator[Section]:
    """Yield a scene's diagrams and tables; of several scenes a terminal shows the table of all alone."""
    figures = []
    for kind in _diagrams_of(scene, axes):
        for whole in (False, True) if kind is Diagram.ERROR_TIME else (False,):
            draw = partial(diagram_svg, scene, kind, bench.plan.error.label, whole=whole)
            caption = f"{kind.heading}{', preparation included' if whole else ''}. {DIAGRAM_NOTE}"
            figures.append(Figures((Figure(draw, caption),), large=True))
    described = (Text(scene.scene.description, ON_PAPER),) if scene.scene.description else ()
    table = method_table(scene, targets)
    methods: tuple[Block, ...] = (table, Text(TABLE_SHORT, TERMINAL), Text(TABLE_NOTE, IN_FULL))
    if len(bench.scenes) > 1:
        methods = (dataclasses.replace(table, only=IN_FULL), Text(TABLE_NOTE, IN_FULL))
    tables = (error_table(scene, bench.plan.error.meaning), point_table(scene, bench.plan))
    yield Section(scene.scene.name, (*described, *figures[:1], *methods, *figures[1:], *tables))
    left_out = tuple(_unrun(scene))
    yield Section("Left out, and why", (Lines(left_out, IN_FULL),) if left_out else (), level=3)
    if scene.noise is not None:
        how = (
            f"Timed {scene.timed_at} in {wording.count(scene.rounds, 'round')} of random order (seed "
            f"{bench.plan.seed}), nothing observed and nothing else of this bench running. Noise: "
            f"{_quiet(scene.noise)}."
        )
        yield Section("How it was timed", (Text(how, IN_FULL),), level=3)


def _answers(bench: Bench, targets: Sequence[float]) -> Iterator[str]:
    """Say what an error of each target costs: on one scene in full, on several who is the cheapest on how many."""
    for target in targets:
        found = [cheapest_engine(scene, target) for scene in bench.scenes]
        tally = Counter(f"{point.engine} ({point.profile})" for point in found if point is not None)
        if len(found) == 1:
            yield _cheapest_sentence(bench.scenes[0], target)
        elif tally:
            best = wording.listed([f"{name} on {count}" for name, count in tally.most_common()])
            none = f"; no engine reaches it on {found.count(None)}" if None in found else ""
            yield f"Cheapest to an error of {wording.number(target)}, of {len(found)} scenes: {best}{none}."
        else:
            yield f"No engine reaches an error of {wording.number(target)} on any scene, at the steps that were scored."
        if not tally:
            return  # what is beyond all of them, a smaller error is too


def _cheapest_sentence(bench: SceneBench, target: float) -> str:
    """Return the answer to the user's question in a sentence."""
    name, wanted = bench.scene.name, wording.number(target)
    engine = cheapest_engine(bench, target)
    if engine is None or engine.timing is None:
        sound = [point for point in engine_points(bench) if point.sound]
        best = min(sound, key=lambda point: (point.error, run_s(point)), default=None)
        near = f"; the nearest is {exact_or(best.error)}, {point_name(best)}" if best else ""
        return f"{name}: no engine reaches an error of {wanted} at the steps that were run{near}."
    found = engine.timing.ratio
    of_pit = f", {wording.ratio(found.median)} PIT's at that step (quartiles {quartiles(found)})" if found else ""
    sentence = (
        f"{name}: the cheapest way to an error of {wanted} is {engine.engine} ({engine.profile}) at "
        f"{wording.step(engine.dt_s)}: {milliseconds(engine.timing.advance_s)} ms"
        f"{of_pit if engine.engine != 'pit' else ''}"
    )
    pic = cheapest([point for curve in bench.curves if is_floor(curve) for point in curve.points], target)
    if pic is None or pic.timing is None:
        return f"{sentence}."
    times = wording.ratio(run_s(pic) / run_s(engine))
    return f"{sentence}; PIC is exact in {milliseconds(pic.timing.advance_s)} ms, {times} that."


def _scope(bench: Bench) -> str:
    """Say how much was run, how much was not, and why not."""
    points = [point for scene in bench.scenes for curve in scene.curves for point in curve.points]
    methods = len({(point.engine, point.profile) for point in points})
    scenes = bench.scenes[0].scene.name if len(bench.scenes) == 1 else wording.count(len(bench.scenes), "scene")
    said = f"How accurate for what cost: {wording.count(methods, 'method')} on {scenes}"
    unrun, untimed = [p.reason for p in points if p.reason], [p.untimed for p in points if p.untimed]
    left = [f"{len(unrun)} not scored"] * bool(unrun) + [f"{len(untimed)} not timed"] * bool(untimed)
    reasons = {*unrun, *untimed}
    why = f": {reasons.pop()}" if len(reasons) == 1 else ", and the page says why"
    steps = wording.count(max(len({p.dt_s for c in scene.curves for p in c.points}) for scene in bench.scenes), "step")
    return f"{said}, {steps}{f' ({wording.listed(left)} of {len(points)} points{why})' if left else ''}."


def _unrun(bench: SceneBench) -> Iterator[str]:
    """Return a line for each reason for which a point was not scored or not timed."""
    steps: dict[tuple[str, str], dict[str, list[str]]] = {}
    for curve in bench.curves:
        for point in curve.points:
            for what, reason in (("not scored", point.reason), ("not timed", point.untimed)):
                if reason:
                    own = steps.setdefault((what, reason), {})
                    own.setdefault(f"{curve.engine} {curve.profile}", []).append(wording.step(point.dt_s))
    for (what, reason), by_curve in steps.items():
        for at_steps, whose in wording.together((wording.listed(at), who) for who, at in by_curve.items()).items():
            who = "everything" if len(whose) == len(bench.curves) else wording.listed(whose)
            yield f"{who}, {what} at {at_steps}: {reason}"


def _quiet(noise: Noise) -> str:
    return (
        f"the same {wording.number(noise.work_s * 1e3)} ms of fixed work, {noise.probes} times between the visits: "
        f"the middle half within {wording.percent(noise.interquartile)}, the slowest {wording.ratio(noise.worst)} that"
    )
