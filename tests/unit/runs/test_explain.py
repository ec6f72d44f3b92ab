"""The plan in words: what is skipped, and why."""

from __future__ import annotations

import re
from typing import Any

import pytest

from carom.errors import UnknownNameError
from carom.runs import reference
from carom.runs.execute import cross_check
from carom.runs.explain import explain
from carom.runs.job import Status
from carom.runs.plan import Options, plan_of
from carom.runs.pool import InProcess
from carom.scenes import catalogue


def plan(name: str, **options: Any) -> str:
    return "\n".join(explain(plan_of([catalogue()[name]], Options(**options))))


def test_two_discs_need_no_queue() -> None:
    """Of two discs the plan says that the closed form is enough, and how many frames PIT looks at."""
    text = plan("paper/late", engines=["pit"])
    assert "the closed form, without queue or cells" in text
    looked_at = re.search(r"(\d+) of 24 frames are looked at", text)
    assert looked_at is not None
    assert 0 < int(looked_at[1]) < 24
    assert "none are kept, as no report is written" not in text
    assert "pit default: skipped: another profile has the very same settings" in text


def test_what_is_not_drawn_is_not_kept() -> None:
    """Without a report no states are kept, and the plan says so."""
    assert "none are kept, as no report is written" in plan("paper/late", engines=["pit"], samples=False)


def test_an_engine_is_followed_while_anything_can_happen() -> None:
    """After the last impact of two discs an engine is stopped; in a box it is followed to the end."""
    assert "stopped once their own state shows nothing but free flight" in plan("paper/late", engines=["pit"])
    assert "followed through all 60 steps" in plan("classics/gas", engines=["pit"], dts=[1 / 60])


def test_a_falling_scene_is_planned_like_any_other() -> None:
    """Under gravity PIC has a form of its own, and PIT looks at every frame, since no bound tells it which to skip."""
    text = plan("gravity/falling-pair", engines=["pit"], dts=[1 / 60])
    assert "PIC: event-driven along parabolas" in text
    assert "75 of 75 frames are looked at" in text


def test_phases_that_can_be_run_are_counted() -> None:
    """The plan counts the phases to which the scene can be shifted."""
    assert "phases: 5 of 5" in plan("paper/late", engines=["pit"], phases=5)


def test_an_engine_that_is_not_known_is_refused() -> None:
    """An unknown engine is an error, not an empty plan."""
    with pytest.raises(UnknownNameError, match="no engine is named 'nonsense'"):
        plan("paper/late", engines=["nonsense"])


@pytest.mark.parametrize("profiles", [None, ["all"], ["tuned", "default"]])
def test_what_is_explained_is_what_is_run(profiles: list[str] | None) -> None:
    """The steps at which the plan says that a profile is run are those of the rows that ran, and no other row ran."""
    scene, names = catalogue()["paper/late"], ["pic", "pit", "pymunk"]
    results = cross_check([scene], names, profiles=profiles, timing=False, samples=False, pool=InProcess())
    ran: dict[str, list[str]] = {}
    for row in results.rows:
        if row.status is Status.RAN:
            ran.setdefault(f"{row.job.engine} {row.job.profile}", []).append(f"{row.job.dt_s:.6g}")
    text = plan("paper/late", engines=names, profiles=profiles)
    explained = dict(re.findall(r"^  (\S+ \S+): run at ([\d.e, -]+) s", text, re.MULTILINE))
    assert {method: steps.split(", ") for method, steps in explained.items()} == ran


def test_a_scene_without_a_reference_is_not_planned(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where PIC has more impacts than a cross-check follows, the plan says that nothing is run, in the rows' words."""
    monkeypatch.setattr(reference, "MOST_IMPACTS", 3)
    row = cross_check([catalogue()["classics/gas"]], ["pit"], timing=False, samples=False, pool=InProcess()).rows[0]
    assert row.status is Status.UNSUPPORTED
    assert f"nothing is run: {row.reason}" in plan("classics/gas", engines=["pit"])
