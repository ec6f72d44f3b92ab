"""Results in a few lines: printable text, ASCII replacements, and the most important numbers."""

import io
import math
from collections.abc import Callable
from dataclasses import replace

from rich.console import Console
from tests.cases import each
from tests.scene_builders import disc_at, run_cross_check, staged, wall_at

import carom
from carom import Scene
from carom.cli.ascii import ERRORS
from carom.report.document import Document
from carom.report.render.terminal import render_terminal
from carom.report.summary import MOST_LINES, WIDTH
from carom.studies.cross_check.document import cross_check_document


def print_document(document: Document, width: int, *, full: bool = False) -> list[str]:
    """Return the lines that a terminal of a width shows."""
    buffer = io.StringIO()
    console = Console(file=buffer, width=width, highlight=False, markup=False)
    for item in render_terminal(document, width, full=full):
        console.print(item)
    return buffer.getvalue().splitlines()


def print_as_line(document: Document, width: int = 80, *, full: bool = False) -> str:
    """Return what a terminal of a width shows, in one line."""
    return " ".join(" ".join(print_document(document, width, full=full)).split())


def test_marks_have_ascii_replacements() -> None:
    """In ASCII each grade has its own sign, and no character is replaced by a question mark."""
    document = cross_check_document(run_cross_check(["paper/missed", "paper/late"], ["pit", "pymunk"], dts=[1 / 60]))
    plain = print_as_line(document, full=True).encode("ascii", ERRORS).decode()
    marks = ("= exact", "~ close", "s sampled", "i inaccurate", "/ diverged", "% diverged inaccurate", "X wrong")
    assert [mark for mark in marks if f"{mark}: " not in plain] == []
    assert "?" not in plain


RIGHT_TO_LEFT = "\N{RIGHT-TO-LEFT OVERRIDE}"


def build_scene(discs: int = 2, name: str = "head-on") -> Scene:
    """Disc 0 reaches disc 1, at rest 3 m on, after the 2 m between them, at 2 s: radii of half a metre, 1 m/s."""
    bodies = (disc_at(3.0 * k, 0.0, float(k == 0)) for k in range(discs))
    return staged(name, *bodies, duration_s=2.75, frame_rate_hz=4.0)


def build_every_kind(of: Scene) -> list[object]:
    reference, observed = carom.solve_pic(of), carom.solve_pit(of)
    results = run_cross_check([of], ["pic", "pit"], dts=[1 / 24])
    return [of, reference, carom.compare(reference, observed), results, carom.certify(of)]


@each("of", [build_scene(), build_scene(20, f"<b>{RIGHT_TO_LEFT}{'x' * 150}")])
def test_repr_of_every_result_is_short_and_printable(of: Scene) -> None:
    """`repr` and `str` are the same few lines of printable characters, whatever the size and the name."""
    for thing in build_every_kind(of):
        lines = repr(thing).splitlines()
        assert lines[0].startswith(type(thing).__name__)
        assert 2 <= len(lines) <= MOST_LINES
        assert max(map(len, lines)) <= WIDTH
        assert all(line.isprintable() for line in lines)
        assert str(thing) == repr(thing)


def build_rough_scene() -> Scene:
    """Three discs, one of them immovable, and a wall, with restitution, friction and gravity."""
    post = disc_at(9.0, 0.0, r=0.25, m=math.inf)
    fields = {"walls": (wall_at(0.0, -2.0, 0.0, 2.0),), "restitution": 0.5, "friction": 0.3}
    fields |= {"discs": (*build_scene().discs, post), "gravity_m_s2": (0.0, -9.81)}
    return build_scene().model_copy(update=fields)


def compare_missed() -> object:
    observed = carom.solve_pit("paper/missed")
    return carom.compare(carom.solve_pic("paper/missed"), observed, sampling=observed)


@each(
    "build, said",
    [
        (build_rough_scene, "'head-on': 3 discs, 1 wall; 2.75 s at 4 frames a second"),
        (build_rough_scene, "restitution 0.5, wall restitution 1, friction 0.3, gravity (0, -9.81) m/s²"),
        (build_rough_scene, "disc 0: at (0, 0) m, (1, 0) m/s, radius 0.5 m, 1 kg"),
        (build_rough_scene, "disc 2: at (9, 0) m, (0, 0) m/s, radius 0.25 m, immovable"),
        (build_rough_scene, "wall 0: through (0, -2) m, normal (0, 1) towards discs"),
        (lambda: build_scene(40), "and 35 more"),
        (
            lambda: carom.solve_pic(build_scene()),
            "'head-on' by pic: 1 impact\n  until 2.75 s: ran to the end of the scene\n"
            "  2 s: disc 0 and disc 1, then at (0, 0) and (1, 0) m/s",
        ),
        (lambda: carom.solve_pit(build_scene()), "by pit at 1/4 s: 1 impact"),
        (lambda: replace(carom.solve_pic(build_scene()), notes=("careful",)), "warning: careful"),
        (compare_missed, "Score: wrong\n  0 of 1 impact found, 1 missed, 0 invented\n"),
        (compare_missed, "error / PIT's: 1\n  an impact is missed ("),
        (lambda: run_cross_check(["paper/missed"], ["pit"], dts=[1 / 24]), "1 run of 1 scene by 1 method"),
        (lambda: run_cross_check(["paper/missed"], ["pit"], dts=[1 / 24]), "pit/tuned: 1 wrong"),
    ],
)
def test_repr_shows_the_numbers_of_a_result(build: Callable[[], object], said: str) -> None:
    """The text of a result has laws and bodies, impacts, a warning, errors with reasons, and grades by method."""
    assert said in repr(build())


def test_exact_grade_shows_32_bit_floats() -> None:
    """A run that declares 32-bit floats is "exact (float32)" everywhere; one without a score is not scored."""
    reference = carom.solve_pic(build_scene())
    score = carom.compare(reference, replace(reference, float_bits=32))
    results = run_cross_check([build_scene()], ["pic"], profiles=["tuned"], dts=[1 / 24])
    narrow = replace(results, rows=tuple(replace(row, score=score) for row in results.rows))
    shown = (repr(score), repr(narrow), score._repr_html_(), narrow._repr_html_())
    assert all("exact (float32)" in (text or "") for text in shown)
    ungraded = replace(narrow, rows=tuple(replace(row, score=None) for row in results.rows))
    assert "not scored" in repr(ungraded)
