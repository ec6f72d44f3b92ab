"""Numbers that an engine could return: they affect only their own row, and a page is written.

The adapter runs in this process, and returns random values: sound numbers, neighbours of them, the extremes of floats,
NaN, and now and then what is of another type. What is tried is the way from the door to the report.
"""

import json
import math
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from random import Random
from shutil import rmtree
from types import ModuleType
from typing import Any
from unittest import mock

import numpy as np
from tests.attacks.guard import HangError, limit_time
from tests.in_process_pool import InProcessPool
from tests.installed_adapters import clear_entry_point_caches, write_distribution

from carom import Scene, cross_check
from carom.catalogue import all_scenes
from carom.engines.api import Contact, Observation
from carom.execution.job import Status
from carom.execution.results import Results
from carom.report.render.markdown import render_markdown
from carom.report.results_file.results_jsonl import format_records
from carom.studies.cross_check.document import build_report, cross_check_document
from carom.studies.cross_check.grid import build_grid
from carom.studies.cross_check.sections.scenes import pack_replays

NAME = "wild-numbers"
SOURCE = """
from carom.engines.api import Capabilities, Engine, Profile

handed_over = None

class World:
    settings = {"dt_s": 0.1}

    def __init__(self, scene):
        self.scene, self.steps = scene, 0

    def advance(self, steps):
        self.steps += steps

    def observe(self):
        return handed_over(self.scene, self.steps)

    def close(self):
        pass

class Adapter:
    name = "wild-numbers"
    engine = Engine("Wild")
    capabilities = Capabilities(
        restitution=(0.0, 1.0), gravity=True, spin=True, friction=(0.0, 10.0), tangential_restitution=True
    )
    profiles = {"tuned": Profile("as it comes", lambda dt: {"dt_s": dt})}

    def prepare(self, scene, settings):
        return World(scene)

adapter = Adapter()
"""
#: Few and quick: of two and three discs, walls, one that can't move, and discs that turn.
SCENES = (
    *("paper/missed", "classics/deflection", "classics/between-fixed", "classics/bank-shot", "classics/galperin-100"),
    *("gravity/falling-pair", "spin/grip", "spin/gearing"),
)
#: In this part of the tries the page is drawn, too, which takes a second.
WHOLE = 0.05
#: Steps of the scene's duration: what is tried does not grow with them.
STEPS = 8

#: The extremes of floats, those of what is scored, and what is next to them.
EXTREMES = (
    *(0.0, -0.0, 5e-324, -5e-324, 2.2e-308, 1e-17, -1e-17, 1e-9, 1.0, -1.0, 1e9, 1e150, -1e150),
    *(6.7e153, -6.7e153, 6.71e153, 1e154, 1e200, -1e200, 1.7e308, -1.7e308),
)
NOT_FINITE = (math.nan, math.inf, -math.inf)


def attack(rng: Random, folder: Path) -> Iterator[str]:
    """Cross-check an engine that returns drawn values, with PIT, and write the report."""
    known = all_scenes()
    scenes = [known[name].scene for name in SCENES]
    while True:
        with _install_adapter(folder) as module:
            scene, wildness = rng.choice(scenes), rng.choice(("near", "small", "wild", "types"))
            seed = rng.random()
            draw = Random(seed)

            def handed_over(scene: Scene, steps: int, draw: Random = draw, wildness: str = wildness) -> Observation:
                return _draw_observation(draw, wildness, scene, steps)

            module.handed_over = handed_over  # type: ignore[attr-defined] # the module's own
            lost = _find_loss(scene, folder, whole=draw.random() < WHOLE)
        yield lost and f"{scene.name}, {wildness}, seed {seed!r}: {lost}"


def _find_loss(scene: Scene, folder: Path, *, whole: bool) -> str:
    """Return what is wrong after a cross-check and its report; empty where nothing is."""
    out = folder / "report"
    rmtree(out, ignore_errors=True)
    try:
        with limit_time(60.0):
            asked: dict[str, Any] = {"dts": [scene.duration_s / STEPS], "profiles": ["tuned"], "timing": False}
            results: Results = cross_check([scene], ["pit", NAME], pool=InProcessPool(), **asked)
            if whole:
                build_report(results).write(out)
                text = (out / "results.jsonl").read_text(encoding="utf-8")
            else:
                text, grid = format_records(results), build_grid(results)
                render_markdown(cross_check_document(results))
                list(pack_replays(grid))
    except HangError:
        return "no end after 60 s"
    except Exception as error:  # noqa: BLE001 - this is what is looked for
        return f"{type(error).__name__}: {str(error)[:300]!r}"
    rows = {row.job.engine: row for row in results.rows}
    if rows["pit"].status is not Status.RAN:
        return f"the other row, too: {rows['pit'].reason[:300]!r}"
    wild = rows[NAME]
    if (wild.score is None) is (wild.status is Status.RAN) or (wild.score is None and not wild.reason):
        return f"a row without a score and without a reason: {wild.status} {wild.reason!r}"
    if "can't be scored" in wild.reason:
        return f"what nobody can score came through the door: {wild.reason[:300]!r}"
    for line in text.splitlines():
        json.loads(line, parse_constant=lambda name: (_ for _ in ()).throw(ValueError(name)))
    return ""


def _draw_number(draw: Random, wildness: str, sound: float) -> Any:
    match wildness:
        case "near":
            return math.nextafter(sound, draw.choice((-math.inf, math.inf))) if draw.random() < 0.5 else sound
        case "small":
            return draw.choice((sound, draw.uniform(-3.0, 3.0), draw.choice((0.0, 1.0, -1.0, 3.0))))
        case "wild":
            wild = NOT_FINITE if draw.random() < 0.02 else EXTREMES
            return draw.choice((sound, draw.choice(wild), draw.uniform(-1.0, 1.0) * 10.0 ** draw.randrange(-320, 308)))
    return draw.choice((sound, sound, sound, None, "1", b"1", 1j, 10**400, True, [], (), {}))


def _draw_observation(draw: Random, wildness: str, scene: Scene, steps: int) -> Observation:
    """Return a state and contacts, most numbers of which are sound or nearly so."""
    if draw.random() < 0.5:  # what is refused at once is never scored
        wildness = "near"
    of_state, discs = "wild" if wildness == "types" and draw.random() < 0.1 else wildness, scene.discs
    if of_state == "types":
        of_state = "near"

    def drawn(sound: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
        flat = [_draw_number(draw, of_state, float(value)) if draw.random() < 0.2 else value for value in sound.flat]
        return np.array(flat, np.float64).reshape(sound.shape)

    spins = scene.arrays.spins
    count = draw.choice((0, 0, 1, 1, 3)) if len(discs) + len(scene.walls) > 1 else 0
    return Observation(
        drawn(np.array([disc.position_m for disc in discs])),
        drawn(np.array([disc.velocity_m_s for disc in discs])),
        tuple(_draw_contact(draw, wildness, scene, steps) for _ in range(count)),
        spin_rad_s=drawn(np.zeros(len(discs)) if spins is None else spins),
    )


def _draw_contact(draw: Random, wildness: str, scene: Scene, steps: int) -> Contact:
    discs, walls = len(scene.discs), len(scene.walls)
    first = draw.randrange(discs if walls else discs - 1)
    second = draw.choice([*range(first + 1, discs), *range(-walls, 0)])
    angle = draw.uniform(0.0, math.tau)
    told = draw.random() < 0.6
    time_s: Any = scene.duration_s / STEPS * (steps - draw.random())
    if draw.random() < 0.05:
        time_s = _draw_number(draw, wildness, time_s)

    def pair(sound: float) -> Any:
        if draw.random() < 0.5:
            return (sound, 0.0)
        return (_draw_number(draw, wildness, sound), _draw_number(draw, wildness, 0.0))

    still = second < 0 and draw.random() < 0.95
    velocities: Any = None
    spins: Any = None
    if told:
        velocities = (
            pair(1.0),
            *(((0.0, 0.0), pair(-1.0), (0.0, 0.0)) if still else (pair(-1.0), pair(-1.0), pair(1.0))),
        )
        spins = tuple(0.0 if still and k % 2 else _draw_number(draw, wildness, 0.0) for k in range(4))
    impulse: Any = draw.choice((None, None, 1.0, _draw_number(draw, wildness, 1.0)))
    return Contact(first, second, time_s, (math.cos(angle), math.sin(angle)), impulse, velocities, impulse, spins)


@contextmanager
def _install_adapter(folder: Path) -> Iterator[ModuleType]:
    """Install the adapter for this process: a distribution in a folder of its own."""
    rmtree(folder / "site", ignore_errors=True)
    (folder / "site").mkdir()
    (folder / "site" / "wild_numbers.py").write_text(SOURCE)
    write_distribution(folder / "site", "wild_numbers", {NAME: "wild_numbers:adapter"})
    with mock.patch.object(sys, "path", [str(folder / "site"), *sys.path]):
        clear_entry_point_caches()
        import wild_numbers  # type: ignore[import-not-found] # written above

        yield wild_numbers
        del sys.modules["wild_numbers"]
    clear_entry_point_caches()
