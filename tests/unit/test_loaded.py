"""No command loads what it does not use: a table of commands, and what none of their processes has imported."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest
from tests.lengths import long_after

#: No command that answers on a terminal draws, certifies two discs, searches, or drives an engine in its own process.
NEVER = {"matplotlib", "jinja2", "flint", "distributed", "pandas", "optuna", "pytest", "pymunk", "mujoco", "pybullet"}
NEVER |= {"numpy.ma"}  # which NumPy loads for a median
#: A page, its records, a bar that only a terminal shows, programs as engines, and other commands.
OF_OTHERS = {
    "carom.pages.render.html",
    "carom.pages.records",
    "xml.etree.ElementTree",
    "rich.progress",
    "carom.program.adapter",
    "carom.conformance",
    "carom.studies.stress",
    "carom.studies.tune",
    "carom.studies.stress.command",
    "carom.studies.bench.command",
}
OF_RUNS = {"carom.runs.worker", "carom.runs.process", "carom.comparator", "carom.studies.cross_check.document"}

COMMANDS = {
    "--help": NEVER
    | OF_OTHERS
    - {"carom.studies.stress", "carom.studies.tune", "carom.studies.stress.command", "carom.studies.bench.command"}
    | {"numpy", "pydantic", "rich"},
    "run paper/missed -e pit --dt 1/24": NEVER | OF_OTHERS,
    "run --help": NEVER | OF_OTHERS | OF_RUNS | {"numpy"},
    "scenes paper/missed": NEVER | OF_OTHERS | OF_RUNS,
}

SCRIPT = """
import json, sys
from carom.__main__ import main
sys.argv[0] = "carom"
path = sys.argv.pop(1)
try:
    main()
finally:
    with open(path, "w") as file:
        json.dump(sorted(sys.modules), file)
"""


@pytest.mark.parametrize("command", long_after(2, COMMANDS))
def test_a_command_loads_no_more_than_it_uses(command: str, tmp_path: Path) -> None:
    """Of what the table names for a command, its process has imported nothing when it ends."""
    found = tmp_path / "modules.json"
    subprocess.run([sys.executable, "-c", SCRIPT, str(found), *command.split()], capture_output=True, check=False)
    loaded = set(json.loads(found.read_text()))
    homes = {"run": "carom.studies.cross_check.command", "scenes": "carom.cli.scenes", "--help": "carom.cli"}
    assert homes[command.split(maxsplit=1)[0]] in loaded
    assert sorted(loaded & COMMANDS[command]) == []
