"""The short form of each attack, and the campaign itself, which must report a loss."""

import importlib.util
import json
import sys
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from random import Random

import pytest
from tests.attacks import __main__ as campaign
from tests.cases import each, long_until
from tests.fake_clock import Clock

from carom.engines.registry import list_adapter_points

#: Tries of those that take milliseconds each; of the others one or two.
QUICK = {"scenes": 2, "known-failures": 5, "journal-cuts": 9, "journal-garbage": 9, "journal-types": 4, "results": 1}
QUICK |= {"reports": 1, "wild-numbers": 5, "clocks": 1, "imports": 3, "overlays": 1}
SLOW = {"options": 8, "kills": 3, "clusters": 2, "disks": 2, "programs": 20, "play": 10, "sizes": 2, "surroundings": 5}


assert {*QUICK, *SLOW} == {*campaign.ATTACKS}


@pytest.mark.skipif(sys.platform != "linux", reason="processes and limits are Linux's")
@each("name, tries", long_until(len(QUICK), [*QUICK.items(), *SLOW.items()]))
def test_short_attacks_lose_nothing(name: str, tries: int, tmp_path: Path) -> None:
    """A few tries of each attack, always from the same seeds, find no loss and leave no adapter behind."""
    if name == "clusters" and importlib.util.find_spec("distributed") is None:
        pytest.skip("distributed, extra cluster, is missing")
    known, path = set(list_adapter_points()), [*sys.path]
    assert [*islice(campaign.ATTACKS[name][1](Random(name), tmp_path), tries)] == [""] * tries
    assert (set(list_adapter_points()), sys.path) == (known, path), "an attack leaves an adapter to the tests after it"


def test_campaign_adds_up_counts_and_fails_on_a_loss(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Counts add up from call to call; a loss is printed, stored, in the table of the page, and exit code 1."""

    def tries(rng: Random, folder: Path) -> Iterator[str]:
        """Tries.

        All of them.
        """
        del rng
        yield "" if not (folder / "again").exists() else "lost: a line"
        (folder / "again").touch()
        while True:
            yield ""

    page = tmp_path / "page.md"
    page.write_text(f"before\n{campaign.BEGIN}\nstale\n{campaign.END}\nafter\n")
    monkeypatch.setattr(campaign, "ATTACKS", {"mine": (10, tries)})
    # A second passes with each look at the clock, so each call has a minute's tries, however slow the machine is.
    monkeypatch.setattr(campaign, "time", Clock(1.0))
    monkeypatch.setattr(sys, "argv", ["x", "--minutes", "1", "--state", str(tmp_path), "--write", str(page)])
    assert campaign.main() == 0
    first = json.loads((tmp_path / "mine" / campaign.COUNT).read_text())["tried"]
    assert campaign.main() == 1
    count = json.loads((tmp_path / "mine" / campaign.COUNT).read_text())
    assert count["tried"] > first
    assert (count["lost"], count["findings"]) == (1, ["lost: a line"])
    assert "mine: lost: a line" in capsys.readouterr().out
    text = page.read_text()
    assert f"| tries | {count['tried']:,} | 10 | 1 | all of them |" in text
    assert text.startswith("before\n")
    assert text.endswith("after\n")
    assert "stale" not in text
