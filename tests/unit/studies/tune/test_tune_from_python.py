"""The search for settings from Python: one call, and an answer that prints, shows and draws itself."""

from __future__ import annotations

import numpy as np
import pytest

import carom
from carom.errors import InputError, UnknownNameError

pytest.importorskip("optuna", reason="optuna, extra tune, is not installed")
pytest.importorskip("pymunk", reason="pymunk is not installed")


def test_a_call_gives_settings_that_print_and_draw_themselves() -> None:
    """Its first line is the command line's, and the picture has each scene's errors before and after."""
    pytest.importorskip("matplotlib", reason="matplotlib, extra report, is not installed")
    from matplotlib.figure import Figure

    found = carom.tune("pymunk", ["paper/late"], trials=2, jobs=1)
    assert repr(found).splitlines()[0].startswith(("Nothing better than default was found", "Found in trial "))
    axes = found.plot(Figure().add_subplot())
    lines = {str(line.get_label()): line for line in axes.lines}
    for label, judged in (("default", found.first.judged), ("found", found.best.judged)):
        assert np.asarray(lines[label].get_xdata()) == pytest.approx([one.price for one in judged])
    page = found._repr_html_()
    assert page is not None
    assert "<svg" in page
    assert "trial" in page or "tried" in page


def test_what_makes_no_sense_is_refused_by_name() -> None:
    """An option, a scene and an engine that are none are refused as from the command line."""
    with pytest.raises(InputError, match=r"^trials must be a whole number"):
        carom.tune("pymunk", trials=0)
    with pytest.raises(UnknownNameError, match="paper/late"):
        carom.tune("pymunk", ["paper/lat"])
    with pytest.raises(UnknownNameError, match="pymunk"):
        carom.tune("pymonk")
