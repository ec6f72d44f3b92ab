"""`carom.tune` from Python: text, table and plot of the result."""

from dataclasses import replace

import numpy as np
import pytest
from tests.scene_builders import require_value
from tests.unit.studies.tune.hand_written_profiles import assert_as_good, compute_merits

import carom
from carom.studies.tune.objective import Merit

pytest.importorskip("optuna", reason="optuna, extra tune, is not installed")
pytest.importorskip("pymunk", reason="pymunk is not installed")


@pytest.mark.usefixtures("in_process")
def test_tune_result_prints_and_plots_errors() -> None:
    """The result of `carom.tune` prints its answer first and plots each scene's error before and after."""
    pytest.importorskip("matplotlib", reason="matplotlib, extra report, is not installed")
    from matplotlib.figure import Figure

    found = carom.tune("pymunk", ["paper/late"], trials=2, jobs=1)
    assert repr(found).splitlines()[0].startswith(("No better settings than default were found", "pymunk: "))
    axes = found.plot(Figure().add_subplot())
    lines = {str(line.get_label()): line for line in axes.lines}
    for label, results in (("default", found.first.results), ("found settings", found.best.results)):
        assert np.asarray(lines[label].get_xdata()) == pytest.approx([one.error_ratio for one in results])
    page = require_value(found._repr_html_())
    assert "<svg" in page
    assert "trial" in page or "tried" in page


@pytest.mark.long
def test_tune_compares_with_existing_profiles() -> None:
    """The result has a row for each existing profile, located last, and names equal and better ones."""
    found = carom.tune("pymunk", ["paper/late", "gravity/bouncing-ball"], trials=1, jobs=1)
    text = " ".join(repr(found).split())
    assert [*found.others] == ["tuned", "located"]
    assert [one.grade for one in found.others["located"].results][1] is None
    assert "Not run: located (discs fall onto walls or immovable discs" in text
    named = ("default ", "tuned ", "located ")
    names = [line.split()[0] for line in repr(found).splitlines() if line.startswith(named) and "equally" not in line]
    assert names[-1] == "located"
    own = "default" if found.best is found.first else "found settings"
    tie = replace(found, others={"tuned": found.best, "located": found.best})
    assert f"{own} and tuned are equally good." in " ".join(repr(tie).split())
    best = replace(found.best, merit=Merit(0, 0, 0))
    better = " ".join(repr(replace(found, others={"tuned": best, "located": best})).split())
    assert "The existing profile tuned is better." in better
    assert "equally good" not in better


@pytest.mark.long
def test_pymunk_settings_are_as_good_as_tuned_profile() -> None:
    """On `classics`, the settings found for pymunk are no worse than `tuned` in wrong and not-close scenes."""
    found, written = compute_merits("pymunk", ["tuned"], 60)
    assert_as_good(found, written)
