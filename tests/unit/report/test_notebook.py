"""Notebook output: pictures that show the result, escaped names, and text if no picture is possible."""

import html
import re
from collections import Counter

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle
from matplotlib.quiver import Quiver
from tests.cases import each
from tests.scene_builders import alter_impact, disc_at, run_cross_check, staged, wall_at

import carom
from carom import Scene
from carom.catalogue import find_scenes
from carom.errors import InputError
from carom.report.outcome_marks import mark_of, mark_of_grade

HOSTILE = "<script>alert('x')</script>&$\\frac$"


@pytest.fixture(scope="module")
def scene() -> Scene:
    """Two discs that meet obliquely over a wall."""
    discs = disc_at(0.0, 0.0, 2.0, 0.1), disc_at(3.0, 0.25, -1.0, 0.0, r=0.25)
    return staged(HOSTILE, *discs, wall_at(0.0, -2.0, 0.0, 1.0), duration_s=2.0, frame_rate_hz=8)


def strip_tags(page: str | None) -> str:
    """Return the text that a page shows."""
    return html.unescape(re.sub(r"<[^>]+>", "", page or ""))


def list_circles(axes: object) -> list[Circle]:
    return [artist for artist in axes.get_children() if isinstance(artist, Circle)]  # type: ignore[attr-defined]


def test_notebook_cell_has_text_and_one_picture(scene: Scene) -> None:
    """Each object is shown as its text and one picture; a name with tags and dollars is shown literally."""
    reference, observed = carom.solve_pic(scene), carom.solve_pit(scene)
    results = run_cross_check([scene], ["pic", "pit"], dts=[1 / 8])
    for thing in (scene, reference, observed, results, carom.certify(scene)):
        page = thing._repr_html_()
        assert page
        assert page.count("<svg") == 1
        assert "<script" not in page
        assert str(thing) in strip_tags(page)


def test_score_is_shown_as_a_table(scene: Scene) -> None:
    """The table has the grade, the measured errors and the verdicts with their reasons, and no "n/a"."""
    score = carom.compare(carom.solve_pic(scene), carom.solve_pit(scene))
    page = score._repr_html_() or ""
    assert page.count("<table") == 1
    for said in (mark_of_grade(score.grade, 64).sentence, "final velocity", score.findings[0].reason):
        assert said in strip_tags(page)
    assert "n/a" not in page


def test_notebook_without_matplotlib_shows_text(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without matplotlib objects have no HTML, and a plot raises an ImportError with the install command."""
    monkeypatch.setattr("carom.report.files.importlib.util.find_spec", lambda _: None)
    reference = carom.solve_pic(scene)
    assert scene._repr_html_() is None
    assert carom.replay(reference, reference)._repr_html_() is None
    with pytest.raises(ImportError, match=r"pip install 'carom\[report\]'"):
        scene.plot()


def test_large_scene_is_shown_without_a_picture() -> None:
    """A scene of 100 discs is shown as text only, since the discs would be too small to see."""
    discs = (disc_at(k % 10, k // 10, r=0.25) for k in range(100))
    page = staged("many", *discs, duration_s=1.0)._repr_html_()
    assert re.findall(r"<\w+", page or "") == ["<div", "<pre"]


@each("bad", [np.nan, np.inf])
@each("field", ["time_s", "normal", "velocity_first_after"])
def test_non_finite_trace_is_shown_as_text(scene: Scene, field: str, bad: float) -> None:
    """A trace with NaN or infinity is shown as text; plot and replay are refused with the name of the field."""
    trace = carom.solve_pic(scene)
    broken = alter_impact(trace, 0, **{field: bad})
    assert re.findall(r"<\w+", broken._repr_html_() or "") == ["<div", "<pre"]
    with pytest.raises(InputError, match=f"{field}.*can't be drawn"):
        broken.plot(Figure().add_subplot())
    with pytest.raises(InputError, match=f"{field}.*can't be replayed"):
        carom.replay(trace, broken)


def test_scene_plot_shows_the_start_on_given_axes(scene: Scene) -> None:
    """Each disc is drawn to scale at its position, with its velocity as an arrow."""
    axes = Figure().add_subplot()
    assert scene.plot(axes) is axes
    assert axes.get_aspect() == 1.0
    drawn = {(*np.array(circle.get_center()).tolist(), circle.get_radius()) for circle in list_circles(axes)}
    assert drawn == {(*disc.position_m, disc.radius_m) for disc in scene.discs}
    (arrows,) = [artist for artist in axes.collections if isinstance(artist, Quiver)]
    assert np.column_stack([arrows.U, arrows.V]).tolist() == [list(disc.velocity_m_s) for disc in scene.discs]


def test_trace_plot_shows_paths_and_impacts(scene: Scene) -> None:
    """A disc's line turns at the impact, where both discs are drawn touching, and ends at the final position."""
    trace = carom.solve_pic(scene)
    (impact,) = trace.impacts
    axes = trace.plot(Figure().add_subplot())
    turns = []
    for k, disc in enumerate(scene.discs):
        turn = np.array(disc.position_m) + impact["time_s"] * np.array(disc.velocity_m_s)
        points = axes.lines[k].get_xydata()
        assert points == pytest.approx(np.array([disc.position_m, turn, trace.final_position_m[k]]), abs=1e-12)
        assert any(circle.get_center() == pytest.approx(turn, abs=1e-12) for circle in list_circles(axes))
        turns.append(turn)
    assert np.hypot(*(turns[1] - turns[0])) == pytest.approx(0.75, abs=1e-12)


def test_motion_along_a_line_is_drawn_against_time() -> None:
    """If all discs are on one line, the vertical axis is time, and the dots are the trace's impacts."""
    (entry,) = find_scenes(["classics/cradle-gaps"])
    trace = carom.solve_pic(entry.scene)
    axes = trace.plot(Figure().add_subplot())
    assert axes.get_ylabel() == "time in s"
    dots = np.concatenate([line.get_ydata() for line in axes.lines if line.get_marker() == "o"])
    assert sorted(dots) == pytest.approx(sorted(np.repeat(trace.impacts["time_s"], 2)))


def test_results_plot_counts_marks(scene: Scene) -> None:
    """The bar of each mark is as long as the number of runs with it."""
    results = run_cross_check([scene], ["pic", "pit"], dts=[1 / 8, 1 / 16])
    axes = results.plot(Figure().add_subplot())
    methods = [label.get_text() for label in axes.get_yticklabels()]
    drawn: Counter[tuple[str, str]] = Counter()
    for bars in axes.containers:
        for method, bar in zip(methods, bars, strict=True):
            assert isinstance(bar, Rectangle)
            drawn[method, str(bars.get_label())] += round(bar.get_width())
    marks = [(row.job.method.name, mark_of(row)) for row in results.rows]
    assert +drawn == Counter((method, f"{mark.symbol} {mark.word}") for method, mark in marks)


def test_plot_without_axes_uses_a_pyplot_figure(scene: Scene) -> None:
    """A plot without axes is drawn in pyplot's current figure, which notebooks show."""
    from matplotlib import pyplot as plt

    axes = scene.plot()
    assert plt.gcf() is axes.figure
    plt.close(axes.figure)


def test_side_by_side_plots_have_the_same_scale(scene: Scene) -> None:
    """Both traces are drawn with the same limits, which contain the one that goes farther."""
    from matplotlib import pyplot as plt

    far = carom.solve_pit(scene, frame_rate_hz=1)  # looks so seldom that the discs pass through
    several = carom.plot_beside(carom.solve_pic(scene), far)
    assert len(several) == 2
    assert {axes.get_xlim() for axes in several} == {several[0].get_xlim()}
    assert {axes.get_ylim() for axes in several} == {several[0].get_ylim()}
    (low, high) = several[0].get_xlim()
    assert low < min(far.final_position_m[:, 0])
    assert max(far.final_position_m[:, 0]) < high
    assert [axes.get_title() for axes in several] == ["pic", "pit"]
    plt.close("all")


def test_side_by_side_plot_of_two_scenes_is_refused(scene: Scene) -> None:
    """`plot_beside` refuses traces of two scenes, which have no common scale, and a call without traces."""
    with pytest.raises(InputError, match="the traces belong to two scenes"):
        carom.plot_beside(carom.solve_pic(scene), carom.solve_pic("paper/missed"))
    with pytest.raises(InputError, match="at least one trace"):
        carom.plot_beside()
