"""Comparison of a bench with an earlier one: which differences count as changes."""

import math
from dataclasses import replace
from pathlib import Path

import pytest
from tests.cases import each
from tests.unit.report.test_terminal import print_as_line
from tests.unit.studies.examples import HERE, build_bench

from carom.errors import InputError
from carom.studies.bench.baseline import BaselineChange, compare_points, read_baseline
from carom.studies.bench.document import build_bench_document, write_bench
from carom.studies.bench.result import Bench

ROUNDS = (1.0, 1.02, 0.99, 1.01, 0.98, 1.0, 1.0)


def build_scaled_bench(factor: float, *, error: float = 1.0, engine: str = "pymunk") -> Bench:
    """Return a bench of one engine whose run times over PIT's and errors are multiples of the usual ones."""
    whole = build_bench()
    curves = []
    for curve in whole.scenes[0].curves:
        mine = curve.engine == engine
        points = []
        for k, point in enumerate(curve.points):
            assert point.timing is not None
            ratios = tuple((factor if mine else 1.0) * (k + 1) * one for one in ROUNDS)
            changed = error if mine else 1.0
            points.append(replace(point, error=changed * point.error, timing=replace(point.timing, ratios=ratios)))
        curves.append(replace(curve, points=tuple(points)))
    return replace(whole, scenes=(replace(whole.scenes[0], curves=tuple(curves)),))


@pytest.fixture(scope="module")
def baseline_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a bench, as it was written."""
    folder = tmp_path_factory.mktemp("earlier")
    bench = build_scaled_bench(1.0)
    write_bench(bench, build_bench_document(bench, ()), folder, axes=())
    return folder


SAME = BaselineChange.SAME


@each(
    "factor, change",
    [(1.3, BaselineChange.REGRESSED), (0.7, BaselineChange.IMPROVED), (1.0, SAME), (1.04, SAME), (0.96, SAME)],
)
def test_change_needs_interval_outside_five_percent(
    baseline_folder: Path, factor: float, change: BaselineChange
) -> None:
    """A run time, relative to PIT's, has changed only if its interval is outside 5 % of the baseline."""
    found = compare_points(build_scaled_bench(factor), read_baseline(baseline_folder, HERE))
    assert {one.time for one in found if one.point.engine == "pymunk"} == {change}
    assert {one.time for one in found if one.point.engine != "pymunk"} == {SAME}
    assert {one.accuracy for one in found} == {SAME}
    assert all(one.low < one.ratio < one.high and math.isclose(one.ratio, factor) for one in found[-12:])
    assert not any(one.point.engine == "pit" for one in found)


def test_baseline_summary_counts_changes_and_names_the_worst(baseline_folder: Path) -> None:
    """The text counts regressed and improved run times and errors, names the worst, or reports no common point."""
    now = build_scaled_bench(1.5, error=2.0)
    found = compare_points(now, read_baseline(baseline_folder, HERE))
    text = print_as_line(build_bench_document(now, changes=found))
    counts = "12 regressed, 0 improved"
    assert text.startswith(f"Run time of {len(found)} points compared with the baseline: {counts}, ")
    assert "worst: paper/late, pymunk " in text
    assert f"Errors: {counts}." in text
    nothing = print_as_line(build_bench_document(now, changes=[]))
    assert "The baseline has none of these points" in nothing


def test_unusable_baseline_is_refused(baseline_folder: Path, tmp_path: Path) -> None:
    """A bench from another machine, a file of another kind and a missing file are refused with the reason."""
    other = tmp_path / "other.json"
    other.write_text("[]")
    for path, here, words in (
        (baseline_folder, replace(HERE, cores=64), "ran on another machine"),
        (other, HERE, r"is not a bench\.json of carom bench"),
        (tmp_path, HERE, r"the baseline .* can't be read"),
    ):
        with pytest.raises(InputError, match=words):
            read_baseline(path, here)
