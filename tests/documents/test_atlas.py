"""The tables of the engines' pages say what the rows of a cross-check and a stress campaign say."""

from typing import Any

import pytest
from docs.figures import atlas, atlas_methods
from docs.figures.raw_records import read_raw_records
from tests.scene_builders import run_cross_check

from carom.catalogue import find_scenes
from carom.report.results_file.results_jsonl import format_records

pytestmark = pytest.mark.long  # it runs a cross-check

NAMES = ["paper/late", "paper/missed", "engines/near-miss", "engines/slow-pair"]
STRESS: dict[str, Any] = {
    "command": "carom stress",
    "methods": [{"engine": "pit", "profile": "tuned"}],
    "lines": [
        {"name": "slow", "cells": [{"ending": "stands", "value": 1e-9, "reason": ""}]},
        {"name": "grazing", "cells": [{"ending": "gives_way", "value": 0.003, "reason": "wrong by .11"}]},
        {"name": "duration", "cells": [{"ending": "not_run", "value": None, "reason": "unsupported: too long"}]},
    ],
}

HAZARDS: list[dict[str, Any]] = [
    {"table": "group", "of": "engines/near-miss", "engine": "pit", "profile": "default", "starts_off": 5, "starts": 32}
    | {"least": 0.0, "median": 0.1, "most": 0.25},
    {"table": "group", "of": "engines/slow-pair", "engine": "pit", "profile": "default", "refused": "too slow"},
    {"table": "gas", "of": "engines/gas-of-25", "engine": "pit", "profile": "tuned", "starts_off": 16, "starts": 16}
    | {"least": -0.5, "median": -0.4, "most": -0.3},
]


@pytest.fixture(scope="module")
def records(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Head and rows of PIC and PIT on a few scenes, as the file has them."""
    results = run_cross_check(find_scenes(NAMES), ["pic", "pit"], certified=False)
    path = tmp_path_factory.mktemp("atlas") / "results.jsonl"
    path.write_text(format_records(results), encoding="utf-8")
    return read_raw_records(path)


def test_atlas_has_grades_and_failure_points_of_each_method(
    records: tuple[dict[str, Any], list[dict[str, Any]]],
) -> None:
    """A profile's row has its scenes by grade, impacts and failure points; Carom's methods have none."""
    (pit,) = (method for method in atlas_methods.methods_of(records[1], []) if method.engine == "pit")
    coarse = [row for row in records[1] if row["engine"] == "pit" and row["refinement"] == 0]
    assert sorted(row["grade"] for row in coarse) == ["sampled", "sampled", "ungraded", "wrong"]
    assert atlas_methods.grades(pit) == "2 sampled, 1 wrong, 1 ungraded"
    assert atlas_methods.impacts(pit) == "1 / 0"
    ends = {name: atlas_methods.breaking(STRESS, name, pit) for name in ("slow", "grazing", "duration", "tunnelling")}
    assert ends == {"slow": "passes to 1e-9", "grazing": "0.003", "duration": "unsupported", "tunnelling": "-"}
    data = atlas.measured(*records, [], STRESS, HAZARDS, ("carom run", "carom run --dt 1/60", "carom stress"))
    assert data["commands"] == ["carom run", "carom run --dt 1/60", "carom stress"]
    assert data["measured"]["scenes"] == len(NAMES)
    assert data["engines"] == {}, "Carom's own methods are nothing to choose"
    assert not [cell for row in data["needs"]["rows"] for cell in row[1:] if cell.startswith(("pic", "pit"))]
    assert atlas_methods.gas(atlas_methods.methods_of(records[1], [], HAZARDS)[-1]) == "-50 % to -30 % at 16 phases"


def test_best_profile_for_settings_code_is_chosen() -> None:
    """Settings are those of the best profile by grades, never located or cylinder, nor default among equals."""

    def method(profile: str, *grades: str) -> atlas_methods.Method:
        return atlas_methods.Method("some", profile, tuple({"refinement": 0, "grade": grade} for grade in grades), None)

    located, cylinder = method("located", "exact", "exact"), method("cylinder", "inaccurate", "inaccurate")
    shipped, tuned = method("default", "sampled", "wrong"), method("tuned", "sampled", "wrong")
    swept = method("swept", "inaccurate", "inaccurate")
    assert atlas_methods.best([located, cylinder]) is None
    assert atlas_methods.best([shipped, located, tuned]) is tuned
    assert atlas_methods.best([shipped, cylinder, tuned, swept]) is swept


def test_first_choice_meets_the_need_in_most_scenes(records: tuple[dict[str, Any], list[dict[str, Any]]]) -> None:
    """Finer steps are chosen only if they meet a need in more scenes; no method is chosen if none meets it."""
    methods = [method for method in atlas_methods.methods_of(records[1], []) if method.engine == "pit"]
    right = atlas_methods.Need("", lambda scene: scene == "engines/near-miss", lambda row: not row["spurious"])
    assert atlas_methods.choices(right, methods) == ["pit, 1 frame: 1 of 1, -"]
    fine = atlas_methods.Need("", lambda scene: scene == "paper/missed", lambda row: not row["missed"])
    runs = [row for row in records[1] if (row["scene"], row["engine"]) == ("paper/missed", "pit")]
    step = 4 ** min(row["refinement"] for row in runs if not row["missed"])
    assert atlas_methods.choices(fine, methods) == [f"pit, 1/{step} frame: 1 of 1, -"]
    never = atlas_methods.Need("", lambda scene: scene == "paper/late", lambda row: row["grade"] == "exact")
    assert atlas_methods.choices(never, methods) == []


def _build_gas_method(engine: str, outcome: str = "completed", **steps: Any) -> atlas_methods.Method:
    """A method that ran the gas; `steps` is what its steps show otherwise than none at all."""
    none: dict[str, Any] = {"grade": "sampled", "due": 900, "missed": 0, "missed_by_pit": 0, "missed_within": 0}
    none |= {"invented": 0, "early": 0, "ahead": 0, "late_steps": [0.5, 1.0], "ratio": [0.2, 1.0], "energy": 0.0}
    row = {"scene": atlas_methods.CHAOTIC, "refinement": 0, "grade": "diverged", "outcome": outcome}
    return atlas_methods.Method(engine, "tuned", ({**row, "local_truth": none | {"until_s": 20.0} | steps},), None)


def test_gas_ranking_ignores_the_misses_of_pit() -> None:
    """A gas is ranked by misses that PIT does not share, extra and early impacts, error, energy; ended last."""
    ranked = [
        _build_gas_method("same-as-pit", missed=4, missed_by_pit=4, energy=1e-9),
        _build_gas_method("loses", energy=2e-6),
        _build_gas_method("worse", ratio=[0.2, 1.8]),
        _build_gas_method("boundless", ratio=[0.2, None]),
        _build_gas_method("ahead", ahead=1),
        _build_gas_method("early", early=2),
        _build_gas_method("invents", invented=1),
        _build_gas_method("misses", missed=3, missed_by_pit=2),
        _build_gas_method("misses-before", missed=4, missed_by_pit=4, missed_within=2),
        _build_gas_method("ends", outcome="warned"),
    ]
    assert [method.name for method, _ in atlas.crowd(ranked[::-1])] == [method.name for method in ranked]
    rows = [" | ".join(row) for row in atlas.data(atlas.crowd_table(ranked))["rows"]]
    assert "loses tuned | diverged | sampled | 900 | 0 (0) | 0 | 0 | 0.5 | 1 | 2e-6 | 20" in rows
    assert any("not bounded" in row for row in rows)


def test_engine_measured_alone_changes_no_ranking(records: tuple[dict[str, Any], list[dict[str, Any]]]) -> None:
    """An engine that is measured alone gets its own entry with the date; rankings of all engines stay the same."""
    head, rows = records
    there = {**head, "environment": {**head["environment"], "versions": {"numpy": "2.4.6", "newcomer": "1.0"}}}
    ranked = {name: {"rows": [["as it was"]]} for name in ("needs", "crowd", "limits")}
    known: dict[str, Any] = {**ranked, "engines": {"other": {}}, "measured": {"scenes": 43}}
    other = [row | {"engine": "newcomer"} for row in rows if row["engine"] == "pit"]
    atlas.with_alone(known, there, [*rows, *other], HAZARDS)
    assert {name: known[name] for name in ranked} == ranked
    assert set(known["engines"]) == {"other", "newcomer"}
    assert known["alone"] == {"newcomer 1.0": f"{head['environment']['date'][:10]} on 4 scenes"}
