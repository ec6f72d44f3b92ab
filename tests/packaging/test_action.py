"""The action for an engine's repository: each of its steps is run as the hosting would, in a folder of its own."""

import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import yaml

ROOT = Path(__file__).resolve().parents[2]
ACTION = yaml.safe_load((ROOT / "action.yml").read_text(encoding="utf-8"))
STEPS = {step["name"]: step for step in ACTION["runs"]["steps"]}

#: As the hosting starts `shell: bash`.
BASH = ("bash", "--noprofile", "--norc", "-eo", "pipefail", "-c")


def fill_inputs(text: str, inputs: dict[str, str]) -> str:
    """Return a value with its inputs put in; an input that is not declared is an error."""
    declared = {name: one.get("default", "") for name, one in ACTION["inputs"].items()} | inputs
    assert set(declared) == set(ACTION["inputs"])
    return re.sub(r"\$\{\{ inputs\.([\w-]+) \}\}", lambda found: declared[found[1]], text)


def run_step(step: dict[str, Any], folder: Path, **inputs: str) -> subprocess.CompletedProcess[str]:
    """Run a step in a folder, with this Python's programs first."""
    assert step["shell"] == "bash"
    inputs = {name.replace("_", "-"): value for name, value in inputs.items()}
    told = {name: fill_inputs(value, inputs) for name, value in step["env"].items()}
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    env = {**os.environ, **told, "PATH": path, "GITHUB_STEP_SUMMARY": str(folder / "summary.md")}
    return subprocess.run([*BASH, step["run"]], cwd=folder, env=env, capture_output=True, text=True, check=False)


def test_action_scripts_contain_no_inputs() -> None:
    """Inputs reach scripts as environment variables only: pasted into a script they would be run."""
    scripts = [step["run"] for step in STEPS.values() if "run" in step]
    assert scripts
    assert not [script for script in scripts if "${{" in script]


def test_action_inputs_are_declared_and_used() -> None:
    """Every input that a step of the action reads is declared, and every declared input is read."""
    assert set(re.findall(r"inputs\.([\w-]+)", yaml.safe_dump(ACTION["runs"]))) == set(ACTION["inputs"])


@pytest.mark.long
def test_action_runs_conformance_and_records(tmp_path: Path) -> None:
    """The action runs the suite, and fails if a known failure passes; its summary shows no change of records."""
    few = {"engine": "pymunk", "pytest_arguments": "-k declares -p no:cacheprovider"}
    done = run_step(STEPS["Conformance"], tmp_path, **few)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "2 passed" in done.stdout
    assert (tmp_path / "carom-results" / "conformance.xml").is_file()
    known = '[[known_failure]]\nreason = "x"\ncases = ["pymunk::declares-profiles"]\n'
    (tmp_path / "carom-known-failures.toml").write_text(known)
    done = run_step(STEPS["Conformance"], tmp_path, **few)
    assert done.returncode == 1
    assert "carom-known-failures.toml lists it (x): remove it" in done.stdout

    records = {"engine": "pymunk", "scenes": "paper/late", "records": "before"}
    command = [sys.executable, "-m", "carom", "run", "paper/late", "-e", "pymunk", "--out", "before"]
    subprocess.run([*command, "--fail-on", "never"], cwd=tmp_path, check=True, capture_output=True)
    done = run_step(STEPS["Records"], tmp_path, **records)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "no change" in (tmp_path / "summary.md").read_text().lower()


@pytest.mark.long
@pytest.mark.engines
def test_action_compares_the_installed_build_with_a_release(tmp_path: Path) -> None:
    """The action compares the installed build with the newest release, and the summary has the table."""
    done = run_step(STEPS["History"], tmp_path, engine="pymunk", scenes="paper/late", releases="latest")
    if done.returncode == 3:
        pytest.skip(done.stderr)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "(installed)" in (tmp_path / "summary.md").read_text()
