"""Each check of spin and friction finds the lie that it is there for, and finds none where there is none."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable, Mapping
from pathlib import Path
from xml.etree import ElementTree

import pytest
from tests.distribution import lay

Pytest = Callable[..., "subprocess.CompletedProcess[str]"]

HERE = Path(__file__).parent

#: Of each toy, the cases that find its lie, and what must be said.
LIES: Mapping[tuple[str, str], str] = {
    ("one-friction", "friction[sliding-greatest]"): "disc 2 leaves with a wrong velocity",
    ("one-friction", "friction[greatest-least]"): "disc 2 leaves with a wrong velocity",
    ("spheres", "inertia[hoop]"): "inertia factor 1: disc 0 leaves with a wrong velocity",
    ("spheres", "inertia[unturnable]"): "inertia factor inf: disc 0 leaves with a wrong velocity",
    ("spheres", "inertia[least]"): "disc 0 leaves with a wrong velocity",
    ("clamps", "greatest-spin"): "a free disc spins otherwise than it did at the start, in step 0",
    ("damps", "greatest-spin"): "a free disc spins otherwise than it did at the start, in step 1",
    ("clockwise", "greatest-spin"): "-100000 rad/s",
    ("clockwise", "friction[least-sliding]"): "leaves with a wrong spin",
    ("tells-none", "greatest-spin"): "no spins are told",
    ("turns-rubs", "rubbing[tuned]"): "are not what changes the velocity",
    ("doubles-rubs", "rubbing[tuned]"): "are not what changes the velocity",
    ("rough", "rubbing[tuned]"): "is more than there can be",
    ("rough", "friction[sliding-sliding]"): "leaves with a wrong velocity",
    ("hides", "rubbing[tuned]"): "but no contact is reported",
    ("claims-nothing", "refuses[spin]"): "since the adapter declares spin = False",
    ("claims-nothing", "refuses[friction]"): "since the adapter declares friction = (0.0, 0.0)",
    ("claims-limits", "refuses[fast-spin]"): "since the adapter declares max_spin_rad_s = 10",
    ("claims-limits", "refuses[friction-below-the-range]"): "since the adapter declares friction = (0.01, 5.0)",
    ("claims-limits", "refuses[friction-above-the-range]"): "since the adapter declares friction = (0.01, 5.0)",
    ("claims-limits", "refuses[small-inertia]"): "since the adapter declares min_inertia_factor = 0.1",
    ("claims-limits", "refuses[tangential-restitution]"): "since the adapter declares tangential_restitution = False",
    ("claims-turns", "refuses[turn]"): "since the adapter declares max_turn_rad = 1",
}


@pytest.fixture
def outcomes(project: Path, run_pytest: Pytest) -> Mapping[tuple[str, str], str]:
    """What is said of each case that fails, and "" of each that does not."""
    site = project.parent / "site"
    shutil.copy(HERE / "carom_spin_toys.py", site)
    names = sorted({name for name, _ in LIES} | {"honest"})
    lay(site, "carom-spin-toys", {name: f"carom_spin_toys:{name.replace('-', '_')}" for name in names})
    lies = " or ".join(f"({name} and {case.partition('[')[0]})" for name, case in LIES)
    chosen = f"({lies} or honest) and (friction or inertia or spin or rubbing or turn or tangential)"
    run_pytest("--carom-engine", "carom-spin-toys", "--carom-profile", "tuned", "--junitxml", "out.xml", "-k", chosen)
    found = {}
    for case in ElementTree.parse(project / "out.xml").iter("testcase"):  # noqa: S314 - written a moment ago
        engine = case.get("classname", "").rpartition(".")[2]
        said = "".join(failure.text or "" for failure in case.iter("failure"))
        found[engine, case.get("name", "")] = said
    return found


@pytest.mark.long
def test_each_lie_about_spin_is_found(outcomes: Mapping[tuple[str, str], str]) -> None:
    """Each lie fails its case with the words for it; the honest one fails none, and is asked all of them."""
    for lie, words in LIES.items():
        assert words in outcomes[lie], (lie, outcomes[lie])
    honest = {case: said for (name, case), said in outcomes.items() if name == "honest"}
    assert not any(honest.values()), honest
    asked = {case.partition("[")[0] for _, case in LIES}
    assert asked <= {case.partition("[")[0] for case in honest}
