"""What `import carom` and each command load, the types of public names, and that no module imports itself."""

from __future__ import annotations

import importlib
import json
import re
import subprocess
import sys
from pathlib import Path
from types import ModuleType
from typing import assert_type

import grimp
import pytest
from tests.cases import each, release_after

import carom
from carom.engines import api
from carom.execution.describe_engines import EngineList

DOCS = Path(__file__).resolve().parents[2] / "docs"


def test_public_names_resolve_to_their_home_modules() -> None:
    """Each public name is the object of that name in its module; `__all__` is sorted and has each name once."""
    for name in carom.__all__:
        thing = getattr(carom, name)
        assert not isinstance(thing, ModuleType) or (name == "engines" and callable(thing)), name
        assert getattr(importlib.import_module(thing.__module__), name) is thing
    assert set(carom.__all__) <= set(dir(carom))
    assert sorted(set(carom.__all__)) == carom.__all__


#: Import paths of earlier versions, with a name that is documented there and the module that has it now.
EARLIER = {
    "carom.scene": ("Scene", "carom.model.scene"),
    "carom.adapter": ("Adapter", "carom.engines.api"),
    "carom.program.adapter": ("program_adapter", "carom.engines.protocol.adapter"),
    "carom.runs.imported": ("import_scene", "carom.execution.scene_import"),
    "carom.scenes": ("find_scenes", "carom.catalogue"),
    "carom.trace": ("SPIN_DTYPE", "carom.model.trace"),
}


@each("paths", [pytest.param([*EARLIER], marks=pytest.mark.long), *release_after(0, [[path] for path in EARLIER])])
def test_earlier_import_paths_give_the_same_objects(paths: list[str]) -> None:
    """Documented import paths of earlier versions give the same objects, and `carom.scene` stays a function."""
    lines = list[str]()
    for path in paths:
        name, home = EARLIER[path]
        assert getattr(importlib.import_module(path), name) is getattr(importlib.import_module(home), name)
        lines += [f"from {path} import {name}", "import carom", "carom.scene('paper/missed')"]
        lines += [f"print(carom.{path[6:]}.__name__)"] if path != "carom.scene" else []  # the attribute is the function
    done = subprocess.run([sys.executable, "-c", "\n".join(lines)], capture_output=True, text=True, check=True)
    assert done.stdout.split() == [path for path in paths if path != "carom.scene"]


def test_earlier_modules_have_names_that_have_moved() -> None:
    """`carom.scene` and `carom.trace` still have their names that have moved to other modules, and no others."""
    for path, name, home in (
        ("carom.scene", "load_scene", "carom.model.scene_file"),
        ("carom.trace", "free_flights", "carom.model.flights"),
        ("carom.trace", "kinetic_energy", "carom.model.energy"),
    ):
        assert getattr(importlib.import_module(path), name) is getattr(importlib.import_module(home), name)
    with pytest.raises(AttributeError, match=r"carom\.trace.*load_scene"):
        _ = importlib.import_module("carom.trace").load_scene


def list_documented_names(page: str) -> list[str]:
    """Return the names that the reference on this page describes."""
    return re.findall(r"^::: (\S+)$", (DOCS / "reference" / "api" / page).read_text(encoding="utf-8"), re.MULTILINE)


def test_every_public_name_is_documented_once() -> None:
    """The API reference describes exactly the names of `carom.__all__` and, on its own page, of `carom.engines.api`."""
    found = [name for page in ("carom.md", "scenes.md", "methods.md") for name in list_documented_names(page)]
    names = [name.removeprefix("carom.").removeprefix("execution.describe_engines.") for name in found]
    assert sorted(name for name in names if "." not in name) == carom.__all__
    page = (DOCS / "reference" / "api" / "adapter.md").read_text(encoding="utf-8")
    own = [name.removeprefix("carom.engines.api.") for name in list_documented_names("adapter.md")]
    shared = re.findall(r"\[`\w+`\]\[carom\.(\w+)\]", page)  # links to descriptions in `carom`
    assert sorted(own + shared) == sorted(api.__all__)


#: No command that answers on a terminal draws, certifies two discs, searches, or drives an engine in its own process.
NEVER = {"matplotlib", "jinja2", "flint", "distributed", "pandas", "optuna", "pytest", "pymunk", "mujoco", "pybullet"}
NEVER |= {"numpy.ma", "carom.solvers.damped"}  # for a median; for other laws
#: A page, its records, a bar that only a terminal shows, programs as engines, and other commands.
OF_OTHERS = {
    "carom.report.render.html",
    "carom.report.results_file.results_jsonl",
    "xml.etree.ElementTree",
    "rich.progress",
    "carom.engines.protocol.adapter",
    "carom.conformance",
    "carom.studies.stress",
    "carom.studies.tune",
    "carom.cli.commands.stress",
    "carom.cli.commands.bench",
}
OF_RUNS = {
    "carom.execution.workers.worker_main",
    "carom.execution.workers.worker_process",
    "carom.comparator",
    "carom.studies.cross_check.document",
}

COMMANDS = {
    "--help": NEVER
    | OF_OTHERS
    - {"carom.studies.stress", "carom.studies.tune", "carom.cli.commands.stress", "carom.cli.commands.bench"}
    | {"numpy", "pydantic", "rich"},
    "run paper/missed -e pit --dt 1/24": NEVER | OF_OTHERS,
    "run --help": NEVER | OF_OTHERS | OF_RUNS | {"numpy"},
    "scenes paper/missed": NEVER | OF_OTHERS | OF_RUNS,
}

#: Runs a command after an import of the package and a run of PIC, and saves what each of the three has loaded.
SCRIPT = """
import json, sys
before = set(sys.modules)
import carom
imported = sorted({m.partition('.')[0] for m in set(sys.modules) - before if 'cython' not in m})
path, solves = sys.argv.pop(1), json.loads(sys.argv.pop(1))
sys.argv[0] = "carom"
if solves:
    carom.solve_pic(carom.Scene(name='a', discs=[carom.Disc(position_m=(0, 0), radius_m=1)], duration_s=1))
solved = sorted(sys.modules)
from carom.__main__ import main
try:
    main()
finally:
    with open(path, "w") as file:
        json.dump([imported, solved, sorted(sys.modules)], file)
"""


@each("command", release_after(2, COMMANDS))
def test_command_loads_only_modules_that_it_uses(command: str, tmp_path: Path) -> None:
    """`import carom` loads only the standard library, PIC no report, and a command no module that its row excludes."""
    path = tmp_path / "modules.json"
    solves = json.dumps("numpy" not in COMMANDS[command])
    program = [sys.executable, "-c", SCRIPT, str(path), solves, *command.split()]
    subprocess.run(program, capture_output=True, check=False)
    imported, solved, loaded = map(set, json.loads(path.read_text()))
    assert imported - set(sys.stdlib_module_names) == {"carom"}
    assert solved & {"carom.report", "matplotlib", "jinja2", "rich"} == set()
    homes = {"run": "carom.cli.commands.run", "scenes": "carom.cli.commands.scenes", "--help": "carom.cli"}
    assert homes[command.split(maxsplit=1)[0]] in loaded
    assert sorted(loaded & COMMANDS[command]) == []


def test_imports_have_no_cycles() -> None:
    """No chain of imports leads from a module back to itself, including imports under `TYPE_CHECKING`."""
    graph = grimp.build_graph("carom", exclude_type_checking_imports=False)
    modules = graph.modules - {"carom"}  # the package lists its public names, and imports each when it is first used
    assert modules
    circles = {
        module
        for module in modules
        for imported in graph.find_modules_directly_imported_by(module) & modules
        if imported != module and graph.chain_exists(importer=imported, imported=module)
    }
    assert not circles


# The types of what people call, as mypy sees them: `make check` fails if one differs from this file -------------------


def test_public_calls_have_the_asserted_types() -> None:
    """The calls run, and for each of them mypy infers the asserted type, which `make check` verifies."""
    disc = carom.Disc(position_m=(0.0, 0.0), velocity_m_s=(2.0, 0.0), radius_m=0.25)
    other = carom.Disc(position_m=(1.5, 0.1), radius_m=0.25)
    scene = assert_type(carom.Scene(name="two", discs=[disc, other], duration_s=1.0), carom.Scene)
    pic = assert_type(carom.solve_pic(scene), carom.Trace)
    pit = assert_type(carom.solve_pit(scene), carom.Trace)
    score = assert_type(carom.compare(pic, pit, sampling=pit), carom.Score)
    assert_type(score.price_paid, float)
    assert_type(score.missed, tuple[int, ...])
    assert_type(pic.end_time_s, float)
    assert isinstance(score, carom.Score)


def assert_types_of_slow_calls() -> None:
    """Calls that start processes, for mypy alone."""
    assert_type(carom.engines(), EngineList)
    assert_type(carom.run("paper/late", "pit", dt=1 / 24), carom.Trace)
    assert_type(carom.cross_check(["paper/late"], ["pit"]), carom.Results)
    assert_type(carom.cross_check(["paper/late"], ["pit"]).rows[0].grade, carom.comparator.Grade | None)
