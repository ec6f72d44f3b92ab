"""The adviser from Python: one call, and an answer that prints, shows and draws itself."""

from __future__ import annotations

import math

import numpy as np
import pytest

import carom
from carom.runs.pool import InProcess
from carom.studies.advise.ask import ShownAdvice


@pytest.fixture(scope="module")
def advice() -> ShownAdvice:
    """Pymunk's steps for two discs, confirmed at four starts."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("carom.studies.advise.step_search.CONFIRM", 4)
        return carom.advise("paper/late", ["pymunk"], profiles=["tuned"], phases=1, pool=InProcess())


def test_a_call_gives_an_answer_that_prints_itself(advice: ShownAdvice) -> None:
    """The first line is the answer, as on the command line; the numbers are those of its fields."""
    (answer,) = advice.answers
    assert answer.never_misses.passes is not None
    first = f"paper/late: to miss no impact, {1.0 / answer.never_misses.passes.dt_s:.4g} steps a second "
    assert repr(advice).splitlines()[0].startswith(first)
    assert advice.code[answer.method] in repr(advice)


def test_a_picture_has_a_line_a_method_and_the_demand(advice: ShownAdvice) -> None:
    """Each step at which a start found the impact is a point at its rate and error, and the demand is a level line."""
    pytest.importorskip("matplotlib", reason="matplotlib, extra report, is not installed")
    from matplotlib.figure import Figure

    axes = advice.plot(Figure().add_subplot())
    found = {str(line.get_label()): line for line in axes.lines}
    rates = [1.0 / trial.dt_s for trial in advice.answers[0].trials if not math.isnan(trial.direction_error_rad)]
    assert np.asarray(found["pymunk tuned"].get_xdata()) == pytest.approx(rates)
    assert np.asarray(found["demand: 1°"].get_ydata()) == pytest.approx([1.0, 1.0])
    page = advice._repr_html_()
    assert page is not None
    assert "<svg" in page
    assert "to miss no impact" in page
