"""A third-party adapter, found and run as its author's users would."""

from __future__ import annotations

import subprocess
import sys
import zipfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.distribution import forget, lay
from tests.lengths import long_after
from tests.stage import disc_at, staged, wall_at

import carom
from carom.comparator import Grade, Verdict
from carom.conformance.cases import cases
from carom.conformance.subject import Subject
from carom.runs.job import Status
from carom.runs.options import Limited

HERE = Path(__file__).parent
DOCS = HERE.parents[1] / "docs"


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """The plug-in on the path with its metadata, as an editable install leaves it."""
    lay(tmp_path, "carom-penalty", {"penalty": "carom_penalty:adapter"}, "0.1")
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.syspath_prepend(str(HERE))
    forget()
    yield
    forget()
    sys.modules.pop("carom_penalty", None)


def _lines_of_code(text: str) -> int:
    lines = [line.strip() for line in text.splitlines()]
    return sum(bool(line) and not line.startswith(("#", '"""')) for line in lines)


@pytest.mark.parametrize("file", ["carom_penalty.py", "carom-known-failures.toml"])
def test_the_documentation_quotes_the_files_that_are_run(file: str) -> None:
    """What docs/adapters.md prints as the adapter's and its known failures' file are these files, to the letter."""
    assert (HERE / file).read_text().rstrip() in (DOCS / "adapters.md").read_text()


@pytest.mark.long
def test_the_documented_project_builds(tmp_path: Path) -> None:
    """The `pyproject.toml` of docs/adapters.md, beside the adapter of that page, is a wheel with its entry point."""
    page = (DOCS / "adapters.md").read_text()
    begin = page.index("[build-system]")
    (tmp_path / "pyproject.toml").write_text(page[begin : page.index("```", begin)])
    (tmp_path / "carom_penalty.py").write_text((HERE / "carom_penalty.py").read_text())
    command = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-index", "--no-build-isolation", "."]
    subprocess.run(command, cwd=tmp_path, check=True)
    (wheel,) = tmp_path.glob("*.whl")
    with zipfile.ZipFile(wheel) as files:
        assert "carom_penalty.py" in files.namelist()
        assert b"penalty = carom_penalty:adapter" in files.read("carom_penalty-0.1.dist-info/entry_points.txt")


def test_an_adapter_is_forty_lines() -> None:
    """The adapter that the documentation builds, engine included, has no more than 45 lines of code."""
    assert 40 <= _lines_of_code((HERE / "carom_penalty.py").read_text()) <= 45


def test_the_documentation_tells_every_check() -> None:
    """docs/adapters.md has a row for each check of the suite."""
    subject = Subject("pymunk", Limited())  # which has a profile of each kind
    checks = {case.name.partition("[")[0] for case in cases(subject)}
    told = {line.split("`")[1] for line in (DOCS / "adapters.md").read_text().splitlines() if line.startswith("| `")}
    assert checks <= told, checks - told


@pytest.mark.long
@pytest.mark.usefixtures("installed")
def test_a_third_party_adapter_is_found() -> None:
    """An adapter of another distribution is listed with its own name, version and distribution."""
    info = next(info for info in carom.engines() if info.name == "penalty")
    assert (info.engine, info.version, info.distribution) == ("Penalty springs", "0.1", "carom-penalty")
    assert info.available


@pytest.mark.usefixtures("installed", "in_process")
@pytest.mark.parametrize(("profile", "contact_steps"), long_after(1, [("default", 4), ("tuned", 2)]))
def test_a_soft_contact_of_many_steps_is_one_impact_and_its_path_turns_half_a_contact_late(
    profile: str, contact_steps: int
) -> None:
    """Springs keep a head-on contact for N steps: one impact, velocities exchanged, the path turned N / 2 steps late.

    With the frequency 2 sin(pi / 2N) / dt, semi-implicit Euler turns overlap and approach (x, v) into (-x, -v) in N
    steps, wherever in its step the contact began. From x = v (t - t0) it comes out on x = -v (t - t0 - N dt): the two
    lines meet N dt / 2 after the contact.
    """
    scene = staged("soft", disc_at(0, 0, 1), disc_at(2, 0, -1), duration_s=1.5)
    dt_s = 1 / 241
    trace = carom.run(scene, "penalty", dt=dt_s, profile=profile)
    assert len(trace.impacts) == 1
    assert trace.effective_time_s is not None
    # Some 240 steps, each rounding positions of 1 m by half an ulp.
    rounding = 240 * 2.0**-53
    assert trace.effective_time_s[0] == pytest.approx(0.5 + contact_steps * dt_s / 2, abs=rounding)
    assert trace.impacts["velocity_first_after"][0][0] == pytest.approx(-1, abs=rounding / dt_s)


@pytest.mark.long
@pytest.mark.usefixtures("installed")
def test_a_third_party_adapter_is_scored_and_skipped_like_any_other() -> None:
    """It is scored on what it declares to support, and skipped with the reason on what it does not."""
    still = [disc_at(0, 0, r=1)]
    walled = staged("walled", *still, wall_at(-2, 0, 1, 0), duration_s=1)
    results = carom.cross_check(
        [walled, staged("open", *still, duration_s=1)],
        ["penalty"],
        timing=False,
        dts=[1 / 60],
        profiles=["tuned"],
    )
    unsupported, ran = results.rows
    assert (unsupported.status, unsupported.grade) == (Status.UNSUPPORTED, None)
    assert "walls" in unsupported.reason
    assert (ran.status, ran.grade) == (Status.RAN, Grade.UNGRADED)  # nothing happens there that could be graded
    assert ran.score is not None
    assert ran.score.verdicts == (Verdict.NO_IMPACT,)
