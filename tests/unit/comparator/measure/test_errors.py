"""Errors of several runs are measured together, in groups that limit memory."""

import numpy as np
import pytest
from tests.cases import each

import carom
from carom.comparator.match_impacts import match_impacts
from carom.comparator.measure import errors
from carom.comparator.measure.errors import MatchedRun, measure_errors
from carom.comparator.scales import compute_scales


@each("name", ["classics/gas", "contact/struck", "gravity/box"])
def test_runs_measured_together_have_the_errors_of_each_run_alone(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Errors of runs do not depend on the runs that are measured with them, and on the size of a group."""
    reference = carom.solve_pic(name)
    scales = compute_scales(reference.scene, reference)
    pits = [carom.solve_pit(name, frame_rate_hz=rate_hz) for rate_hz in (24.0, 60.0, 240.0)]
    runs = [MatchedRun(reference, pit, match_impacts(reference, pit)) for pit in pits]
    alone = [found for run in runs for found in measure_errors([run], scales)]
    for most_joined in (1, 10**9):
        monkeypatch.setattr(errors, "MOST_JOINED", most_joined)
        together = list(measure_errors(runs, scales))
        np.testing.assert_equal([one.of_impacts for one in together], [one.of_impacts for one in alone])
        np.testing.assert_equal([one.ends for one in together], [one.ends for one in alone])
        assert repr([one.largest for one in together]) == repr([one.largest for one in alone])
