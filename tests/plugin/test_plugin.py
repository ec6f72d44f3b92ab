"""A third-party adapter: its documentation, installation and conformance."""

from __future__ import annotations

import os
import re
import shutil
import sys
import sysconfig
import venv
import zipfile
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

import pytest
from tests.cases import each, release_after
from tests.installed_adapters import clear_entry_point_caches, write_distribution
from tests.packaging.building import ROOT, install, make_wheel, run
from tests.scene_builders import disc_at, require_value, staged

import carom
from carom.conformance.adapter_under_test import Subject
from carom.conformance.cases import list_cases
from carom.execution.shared_options import LimitOptions

HERE = Path(__file__).parent
#: The adapter as its author published it, built with Carom 0.1 (57060cb): old code still runs.
BUILT_WITH_0_1 = HERE / "carom_penalty-0.1-py2.py3-none-any.whl"
#: Variables of an environment in which Carom is found only where it is installed.
NO_PATH = {"PYTHONPATH": ""}
#: Where adapters imported the interface from when 0.1 was released.
OLD_PATH = b"carom.adapter"
DOCS = HERE.parents[1] / "docs"


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """The plug-in on the path with its metadata, as an editable install leaves it."""
    write_distribution(tmp_path, "carom-penalty", {"penalty": "carom_penalty:adapter"}, "0.1")
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.syspath_prepend(str(HERE))
    clear_entry_point_caches()
    yield
    clear_entry_point_caches()
    sys.modules.pop("carom_penalty", None)


@each("file", ["carom_penalty.py", "carom-known-failures.toml"])
def test_documentation_quotes_the_tested_files(file: str) -> None:
    """docs/reference/adapters.md quotes the adapter and its known failures file to the letter."""
    assert (HERE / file).read_text().rstrip() in (DOCS / "reference" / "adapters.md").read_text()


@pytest.mark.release
def test_documented_pyproject_builds_a_wheel(tmp_path: Path) -> None:
    """The `pyproject.toml` of docs/reference/adapters.md builds a wheel with its entry point."""
    page = (DOCS / "reference" / "adapters.md").read_text()
    begin = page.index("[build-system]")
    (tmp_path / "pyproject.toml").write_text(page[begin : page.index("```", begin)])
    (tmp_path / "carom_penalty.py").write_text((HERE / "carom_penalty.py").read_text())
    make_wheel(tmp_path, tmp_path, {})
    (wheel,) = tmp_path.glob("*.whl")
    with zipfile.ZipFile(wheel) as files:
        assert "carom_penalty.py" in files.namelist()
        assert b"penalty = carom_penalty:adapter" in files.read("carom_penalty-0.1.dist-info/entry_points.txt")


def test_documentation_lists_every_check() -> None:
    """docs/reference/adapters.md has a row for each check of the conformance suite."""
    subject = Subject("pymunk", LimitOptions())  # which has a profile of each kind
    checks = {case.name.partition("[")[0] for case in list_cases(subject)}
    rows = [line for line in (DOCS / "reference" / "adapters.md").read_text().splitlines() if line.startswith("| `")]
    told = {name for row in rows for name in re.findall(r"`([\w-]+)`", row.split("|")[1])}
    assert checks <= told, checks - told


@pytest.mark.usefixtures("installed", "in_process")
@pytest.mark.parametrize(("profile", "contact_steps"), release_after(1, [("default", 4), ("tuned", 2)]))
def test_soft_contact_is_one_impact_half_a_contact_late(profile: str, contact_steps: int) -> None:
    r"""Springs keep a head-on contact for N steps: one impact, velocities exchanged, N / 2 steps late.

    With the frequency 2 sin(pi / 2N) / dt, semi-implicit Euler turns overlap and approach (x, v) into (-x, -v) in N
    steps, wherever in its step the contact began. From x = v (t - t0) it comes out on x = -v (t - t0 - N dt): the
    two lines meet N dt / 2 after the contact.
    """
    scene = staged("soft", disc_at(0, 0, 1), disc_at(2, 0, -1), duration_s=1.5)
    dt_s = 1 / 241
    trace = carom.run(scene, "penalty", dt=dt_s, profile=profile)
    assert len(trace.impacts) == 1
    # Some 240 steps, each rounding positions of 1 m by half an ulp.
    rounding = 240 * 2.0**-53
    assert require_value(trace.effective_time_s)[0] == pytest.approx(0.5 + contact_steps * dt_s / 2, abs=rounding)
    assert trace.impacts["velocity_first_after"][0][0] == pytest.approx(-1, abs=rounding / dt_s)


#: For each adapter of the twin: a case that finds its false statement, and words of the failure.
LIES = {
    "turns-wrong": ("velocities[tuned-classics/oblique-3-4-5]", "(1.8, -2.4) and (3.2, 2.4) m/s"),
    "stamps-early": ("contact-times[tuned]", "has a time outside that step"),
    "guesses": ("determinism[tuned]", "two runs of one scene differ, although determinism is declared"),
    "rounds": ("settings[default]", "a setting differs from the requested one"),
    "talks": ("silent-and-tidy", "the engine prints"),
    "aborts": ("hits[tuned-classics/miss]", "ended by SIGABRT"),
    "keeps-worlds": ("lets-go-of-worlds", "close() does not release the engine's memory"),
    "claims-walls": ("hits[tuned-classics/box]", "13 of 13 impacts are missed"),
    "claims-sweeping": ("continuous-detection", "50 m/s by conservation of momentum and energy"),
    "shortens": ("greatest-move", "a disc that moves 781.25 m per step ends at a wrong position"),
    "claims-cutting": ("cutting[located]", "PenaltyWorld lacks at least one of cut, touching, save and restore"),
    "claims-precision": ("times[default-classics/oblique-3-4-5]", "0.42 s, or up to 0.00417 s later (1 step)"),
}

#: Of two adapters: what is not declared, and how the adapter says so.
NOT_DECLARED = {
    ("claims-precision", "walls"): "walls = False",
    ("claims-precision", "gravity"): "gravity = False",
    ("claims-precision", "restitution below the range"): "restitution = (1.0, 1.0)",
    ("claims-limits", "move"): "max_move_m = 100",
    ("claims-limits", "small radius"): "min_radius_m = 0.001",
    ("claims-limits", "large radius"): "max_radius_m = 1000",
}


@pytest.mark.release
def test_third_party_wheel_passes_the_suite_in_a_fresh_environment(tmp_path: Path) -> None:
    """The wheel built with Carom 0.1, selected by its distribution, passes except for its known failures."""
    make_wheel(ROOT, tmp_path, {})
    venv.create(tmp_path / "venv", with_pip=False)
    python = tmp_path / "venv/bin/python"
    site = Path(
        sysconfig.get_path("purelib", vars={"base": str(tmp_path / "venv"), "platbase": str(tmp_path / "venv")})
    )
    for wheel in (BUILT_WITH_0_1, *tmp_path.glob("*.whl")):
        install(wheel, site)
    lent = dict.fromkeys((sysconfig.get_path("purelib"), sysconfig.get_path("platlib")))
    (site / "lent.pth").write_text("".join(f"{path}\n" for path in lent))
    where = run(
        python, "-c", "import carom, carom_penalty as p; print(carom.__file__, p.__file__)", cwd=tmp_path, env=NO_PATH
    )
    assert all(Path(file).is_relative_to(site) for file in where.stdout.split()), where.stdout
    shutil.copy(HERE / "carom-known-failures.toml", tmp_path)
    options = ("-W", "error", "--carom-engine", "carom-penalty", "-q", "-rs")
    done = run(python, "-m", "pytest", *options, cwd=tmp_path, env=NO_PATH)
    assert "penalty: Penalty springs 0.1 (carom-penalty): " in done.stdout
    assert " 0 failed, " in done.stdout
    assert " 7 known failures" in done.stdout
    assert "the scene has walls, which this method does not support" in done.stdout


@pytest.mark.long
def test_false_declarations_fail_with_values_and_scene(tmp_path: Path) -> None:
    """Each false declaration fails its case with both values, the scene and a command."""
    names = [*LIES, "claims-limits"]
    points = {name: f"carom_penalty_broken:{name.replace('-', '_')}" for name in names}
    write_distribution(tmp_path, "carom-penalty-broken", points)
    chosen = [f"({name} and {case})" for name, (case, _) in LIES.items()]
    chosen.append("(claims-precision and refuses) or (claims-limits and refuses)")
    options = ("--carom-engine", "carom_penalty_broken", "--junitxml", "out.xml", "-k", " or ".join(chosen))
    path = os.pathsep.join([*map(str, (tmp_path, HERE, HERE / "broken")), os.environ.get("PYTHONPATH", "")])
    done = run(sys.executable, "-m", "pytest", *options, cwd=tmp_path, check=False, env={"PYTHONPATH": path})
    assert done.returncode == 1, done.stdout + done.stderr
    failures = {
        f"{case.get('classname', '').rpartition('.')[2]}::{case.get('name')}": failure.text or ""
        for case in ElementTree.parse(tmp_path / "out.xml").iter("testcase")  # noqa: S314 - written a moment ago
        for failure in case.iter("failure")
    }
    for name, (case, words) in LIES.items():
        text = failures[f"{name}::{case}"]
        for phrase in (words, "  expected   ", "  got        ", "  must hold  ", f"--carom-engine {name} -k"):
            assert phrase in text, text
    # The engine must refuse what the adapter does not declare.
    for (name, what), declared in NOT_DECLARED.items():
        text = failures[f"{name}::refuses[{what.replace(' ', '-')}]"]
        assert f"a scene beyond the declared capabilities ({what}) is run" in text
        assert f"because the adapter declares {declared}" in text


def test_wheel_of_0_1_contains_the_documented_adapter() -> None:
    """The module in the wheel is the one in this folder, except for the old import path of the interface."""
    with zipfile.ZipFile(BUILT_WITH_0_1) as wheel:
        old = wheel.read("carom_penalty.py")
    assert old.count(OLD_PATH) == 1
    assert old.replace(OLD_PATH, b"carom.engines.api") == (HERE / "carom_penalty.py").read_bytes()
