"""A bench as a document: how accurate each engine is for what cost."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

from carom.bench.results import Bench, SceneBench
from carom.report import wording
from carom.report.bench_figure import Diagram, diagram_svg
from carom.report.bench_tables import all_tables, cheapest_sentence, noise_sentence, unrun_lines
from carom.report.document import ON_PAPER, Document, Figure, Figures, Lines, Section, Text
from carom.report.made import making

__all__ = ["bench_document", "diagrams_of"]

DIAGRAM_NOTE = (
    "Full marks find every impact, crosses miss or invent some; thin lines: quartiles of run time, and the luckiest "
    "start."
)


def bench_document(bench: Bench, axes: Sequence[Diagram] = tuple(Diagram)) -> Document:
    """Return a bench: for each scene its diagrams, its tables, what is left out, and how it was timed."""
    target = bench.plan.target
    return Document(
        "Carom bench",
        (
            "How accurate for what cost: each mark is one engine's profile at one step.",
            *(
                cheapest_sentence(scene, target) if scene.noise is not None else f"{scene.scene.name}: not timed."
                for scene in bench.scenes
            ),
        ),
        (
            *(section for scene in bench.scenes for section in _scene(bench, scene, axes)),
            *making(bench.environment, bench.command, bench.elapsed_s),
        ),
    )


def diagrams_of(scene: SceneBench, axes: Sequence[Diagram]) -> tuple[Diagram, ...]:
    """Return the diagrams that can be drawn: without run times only the one of errors against steps."""
    return tuple(kind for kind in axes if scene.noise is not None or kind is Diagram.ERROR_DT)


def _scene(bench: Bench, scene: SceneBench, axes: Sequence[Diagram]) -> Iterator[Section]:
    label = bench.plan.error.label
    figures = []
    for kind in diagrams_of(scene, axes):
        figures.append(Figure(partial(diagram_svg, scene, kind, label), f"{kind.heading}. {DIAGRAM_NOTE}"))
        if kind is Diagram.ERROR_TIME:
            draw = partial(diagram_svg, scene, kind, label, whole=True)
            figures.append(Figure(draw, f"{kind.heading}, preparation included. {DIAGRAM_NOTE}"))
    described = (Text(scene.scene.description, ON_PAPER),) if scene.scene.description else ()
    tables = all_tables(scene, bench.plan.error.meaning, bench.plan.target)
    yield Section(scene.scene.name, (*described, Figures(tuple(figures)), *tables))
    left_out = tuple(unrun_lines(scene))
    yield Section("Left out, and why", (Lines(left_out),) if left_out else (), level=3)
    if scene.noise is not None:
        how = (
            f"Timed {scene.timed_at} in {wording.count(scene.rounds, 'round')} of random order (seed "
            f"{bench.plan.seed}), nothing observed and nothing else of this bench running. Noise: "
            f"{noise_sentence(scene.noise)}."
        )
        yield Section("How it was timed", (Text(how),), level=3)
