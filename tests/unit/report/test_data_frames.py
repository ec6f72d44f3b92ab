"""Data frames: the numbers of traces and results, in columns whose names contain the units."""

import sys

import numpy as np
import pytest
from tests.scene_builders import disc_at, require_value, run_cross_check, staged, wall_at

import carom
from carom import Scene
from carom.catalogue import find_scenes
from carom.engines.registry import load_adapter
from carom.errors import MissingExtraError
from carom.execution.observation.engine_run import observe_run


def build_scene() -> Scene:
    """A disc that spins and falls at 45 degrees onto a rough wall, 1 m below it, at 1 s."""
    disc = disc_at(0.0, 1.5, 1.0, -1.0, spin_rad_s=4.0)
    return staged("roll", disc, wall_at(0.0, 0.0, 0.0, 1.0), wall_friction=0.25, duration_s=2.0)


def test_trace_frame_has_one_row_per_impact() -> None:
    """The row has the impact's time, bodies, velocities and spins, and its columns are named with units."""
    pytest.importorskip("pandas")
    trace = carom.solve_pic(build_scene())
    frame = trace.to_pandas()
    (row,) = frame.to_dict("records")
    assert (row["time_s"], row["first"], row["second"]) == (pytest.approx(1.0), 0, -1)
    assert (row["velocity_first_before_x_m_s"], row["velocity_first_before_y_m_s"]) == (1.0, -1.0)
    assert row["velocity_first_after_y_m_s"] == pytest.approx(1.0)
    assert row["spin_first_before_rad_s"] == 4.0
    # Coulomb: the tangential impulse is the coefficient times the normal one, 0.25 of 2 m/s, against the slip.
    assert row["velocity_first_after_x_m_s"] == pytest.approx(0.5)
    assert row["spin_first_after_rad_s"] == require_value(trace.spins)["first_after"][0]
    assert frame.index.name == "impact"


def test_trace_frame_without_impacts_has_all_columns() -> None:
    """Without impacts the frame has no rows but all columns; that of an engine also has the effective times."""
    pytest.importorskip("pandas")
    (entry,) = find_scenes(["paper/missed"])
    missed = observe_run(load_adapter("pit"), entry.scene, "tuned", 1 / 24).to_pandas()
    found = carom.solve_pic(entry.scene).to_pandas()
    assert len(missed) == 0
    assert set(found) - set(missed) == set()
    assert "effective_time_s" in missed


def test_results_frame_has_one_row_per_run() -> None:
    """Each row has the run's grade, counts and errors; a number that was not measured is NaN and not 0."""
    pytest.importorskip("pandas")
    results = run_cross_check(find_scenes(["paper/missed", "paper/late"]), ["pic", "pit"], dts=[1 / 24])
    frame = results.to_pandas()
    assert len(frame) == len(results.rows)
    for (_, said), row in zip(frame.iterrows(), results.rows, strict=True):
        score = require_value(row.score)
        assert (said["scene"], said["engine"], said["dt_s"]) == (row.job.scene.name, row.job.engine, row.job.dt_s)
        assert (said["missed"], said["invented"]) == (len(score.missed), len(score.spurious))
        assert said["grade"] == score.grade.name.lower()
        total = score.total
        for column, value in (
            ("time_error_s", total.time_s),
            ("reported_time_error_s", total.reported_time_s),
            ("direction_error_rad", total.direction_rad),
            ("velocity_error", total.velocity),
            ("final_position_error", total.final_position),
            ("price_paid", score.price_paid),
            ("advance_s", np.nan),
        ):
            assert said[column] == pytest.approx(value, nan_ok=True)


def test_missing_pandas_is_reported_with_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without pandas, `to_pandas` raises a MissingExtraError with `pip install 'carom[pandas]'`."""
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'carom\[pandas\]'"):
        carom.solve_pic(build_scene()).to_pandas()
