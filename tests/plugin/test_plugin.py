"""A third-party adapter, found and run as its author's users would."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import carom
from carom import Disc, Scene, Wall, registry
from carom.comparator import Grade
from carom.runner import Status

HERE = Path(__file__).parent
DOCS = HERE.parents[1] / "docs"


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """The plug-in on the path with its metadata, as an editable install leaves it."""
    info = tmp_path / "carom_penalty-0.1.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: carom-penalty\nVersion: 0.1\n")
    (info / "entry_points.txt").write_text("[carom.adapters]\npenalty = carom_penalty:adapter\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.syspath_prepend(str(HERE))
    registry._entry_points.cache_clear()  # noqa: SLF001 - a test may forget what was found before
    yield
    registry._entry_points.cache_clear()  # noqa: SLF001 - and must not leave what it found
    sys.modules.pop("carom_penalty", None)


def test_the_documentation_quotes_the_code_that_is_run() -> None:
    """The adapter printed in docs/adapters.md is this file, to the letter."""
    assert (HERE / "carom_penalty.py").read_text().rstrip() in (DOCS / "adapters.md").read_text()


@pytest.mark.usefixtures("installed")
def test_a_third_party_adapter_is_found() -> None:
    """An adapter of another distribution is listed with its own name, version and distribution."""
    info = next(info for info in carom.engines() if info.name == "penalty")
    assert (info.engine, info.version, info.distribution) == ("Penalty springs", "0.1", "carom-penalty")
    assert info.available


@pytest.mark.usefixtures("installed")
def test_a_soft_contact_of_many_steps_is_one_impact_and_its_path_turns_half_a_contact_late() -> None:
    """Penalty springs keep a head-on contact for pi / omega: one impact, velocities exchanged, turned half of it late.

    Two unit masses and a spring k are an oscillator of omega = sqrt(2 k); the relative coordinate leaves along the
    line on which it would have come, had it bounced at the deepest point of an instant pi / (2 omega) after contact.
    """
    scene = Scene(
        name="soft",
        discs=[
            Disc(position_m=(0, 0), velocity_m_s=(1, 0), radius_m=0.5),
            Disc(position_m=(2, 0), velocity_m_s=(-1, 0), radius_m=0.5),
        ],
        duration_s=1.5,
    )
    trace = carom.run(scene, "penalty", dt=1e-4, profile="default")
    assert len(trace.impacts) == 1
    assert trace.effective_time_s is not None
    contact_s, half_s = 0.5, math.pi / (2 * math.sqrt(2e4))
    # The spring acts from the first step that sees an overlap: the instant is known to a step either way.
    assert trace.effective_time_s[0] == pytest.approx(contact_s + half_s, abs=2e-4)
    # Symplectic Euler conserves the oscillator's energy to first order in omega dt.
    assert trace.impacts["velocity_first_after"][0][0] == pytest.approx(-1, abs=math.sqrt(2e4) * 1e-4)


@pytest.mark.usefixtures("installed")
def test_a_third_party_adapter_is_scored_and_skipped_like_any_other() -> None:
    """It is scored on what it declares to support, and skipped with the reason on what it does not."""
    still = [Disc(position_m=(0, 0), radius_m=1)]
    walled = Scene(name="walled", discs=still, walls=[Wall(point_m=(-2, 0), normal=(1, 0))], duration_s=1)
    results = carom.cross_check(
        [walled, Scene(name="open", discs=still, duration_s=1)],
        ["penalty"],
        timing=False,
        dts=[1 / 60],
        profiles=["tuned"],
    )
    assert [(row.status, row.grade) for row in results.rows] == [(Status.UNSUPPORTED, None), (Status.RAN, Grade.EXACT)]
    assert "walls" in results.rows[0].reason
