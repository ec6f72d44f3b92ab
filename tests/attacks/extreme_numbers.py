"""An adapter in this process that returns random numbers: sound ones, their neighbours, extremes of floats, NaN."""

import dataclasses
import math
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from random import Random
from shutil import rmtree
from typing import Any
from unittest import mock

import numpy as np
from tests.attacks.guard import check_strict_json, try_act
from tests.in_process_pool import InProcessPool
from tests.installed_adapters import clear_entry_point_caches, write_distribution
from tests.unit.execution.stubs import Makes, Still

from carom import Scene, cross_check
from carom.catalogue import all_scenes
from carom.engines.api import Capabilities, Contact, Engine, Observation, Setting
from carom.execution.job import Status
from carom.report.render.markdown import render_markdown
from carom.report.results_file.results_jsonl import format_records
from carom.studies.cross_check.document import build_report, cross_check_document
from carom.studies.cross_check.grid import build_grid
from carom.studies.cross_check.sections.scenes import pack_replays

NAME = "wild-numbers"
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


class World(Still):
    """A world of discs whose observations are drawn by lot."""

    def __init__(self, scene: Scene, draw: Random, wildness: str) -> None:
        self.scene, self.draw, self.wildness, self.steps = scene, draw, wildness, 0

    def advance(self, steps: int) -> None:
        self.steps += steps

    def observe(self) -> Observation:
        return _draw_observation(self.draw, self.wildness, self.scene, self.steps)


class WildAdapter(Makes):
    """The adapter of such worlds; each try sets what is drawn."""

    name, engine = NAME, Engine("Wild")
    capabilities = Capabilities(
        restitution=(0.0, 1.0), gravity=True, spin=True, friction=(0.0, 10.0), tangential_restitution=True
    )
    draw, wildness = Random(), "near"

    def prepare(self, scene: Scene, settings: Mapping[str, Setting]) -> World:
        del settings
        return World(scene, self.draw, self.wildness)


ADAPTER = WildAdapter(None)


def attack(rng: Random, folder: Path) -> Iterator[str]:
    """Engines that return extreme numbers.

    Only this engine's result is affected, and the report is strict JSON.
    """
    while True:
        scene, seed = all_scenes()[rng.choice(SCENES)].scene, rng.random()
        ADAPTER.draw, ADAPTER.wildness = Random(seed), rng.choice(("near", "small", "wild", "types"))
        with _install_adapter(folder / "site"):
            lost = try_act(partial(_find_loss, scene, folder / "report", whole=rng.random() < WHOLE), limit_s=60.0)
        yield lost and f"{scene.name}, {ADAPTER.wildness}, seed {seed!r}: {lost}"


@contextmanager
def _install_adapter(site: Path) -> Iterator[None]:
    """Install the adapter for this process, by a distribution in a folder of its own."""
    rmtree(site, ignore_errors=True)
    write_distribution(site, "wild_numbers", {NAME: f"{__name__}:ADAPTER"})
    with mock.patch.object(sys, "path", [str(site), *sys.path]):
        clear_entry_point_caches()
        yield
    clear_entry_point_caches()


def _find_loss(scene: Scene, out: Path, *, whole: bool) -> str:
    """Return what is wrong after a cross-check and its report; empty where nothing is."""
    rmtree(out, ignore_errors=True)
    dts = [scene.duration_s / STEPS]
    results = cross_check([scene], ["pit", NAME], dts=dts, profiles=["tuned"], timing=False, pool=InProcessPool())
    if whole:
        build_report(results).write(out)
    else:
        render_markdown(cross_check_document(results))
        list(pack_replays(build_grid(results)))
    check_strict_json(format_records(results))
    rows = {row.job.engine: row for row in results.rows}
    if rows["pit"].status is not Status.RAN:
        return f"the other row, too: {rows['pit'].reason[:300]!r}"
    wild = rows[NAME]
    if (wild.score is None) is (wild.status is Status.RAN) or (wild.score is None and not wild.reason):
        return f"a row without a score and without a reason: {wild.status} {wild.reason!r}"
    return f"not refused, and not scored: {wild.reason[:300]!r}" if "can't be scored" in wild.reason else ""


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
    of_state = wildness if wildness != "types" else "near" if draw.random() < 0.9 else "wild"

    def draw_array(sound: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
        flat = [_draw_number(draw, of_state, float(value)) if draw.random() < 0.2 else value for value in sound.flat]
        return np.array(flat, np.float64).reshape(sound.shape)

    start, discs = scene.arrays, len(scene.discs)
    count = draw.choice((0, 0, 1, 1, 3)) if discs + len(scene.walls) > 1 else 0
    return Observation(
        draw_array(start.position_m),
        draw_array(start.velocity_m_s),
        tuple(_draw_contact(draw, wildness, scene, steps) for _ in range(count)),
        spin_rad_s=draw_array(np.zeros(discs) if start.spins is None else start.spins),
    )


def _draw_contact(draw: Random, wildness: str, scene: Scene, steps: int) -> Contact:
    """Return a contact of any two bodies, some numbers of which are drawn by lot."""
    discs, walls = len(scene.discs), len(scene.walls)
    first = draw.randrange(discs if walls else discs - 1)
    second = draw.choice([*range(first + 1, discs), *range(-walls, 0)])
    wall_stands = second < 0 and draw.random() < 0.95

    def alter(value: Any) -> Any:
        if isinstance(value, tuple):
            # The second and the last of a contact's four values belong to the second body.
            return tuple(
                one if wall_stands and len(value) == 4 and k % 2 else alter(one) for k, one in enumerate(value)
            )
        return value if value is None or draw.random() < 0.5 else _draw_number(draw, wildness, value)

    angle, time_s = draw.uniform(0.0, math.tau), scene.duration_s / STEPS * (steps - draw.random())
    impulse, still = draw.choice((None, 1.0)), (0.0, 0.0)
    velocities = ((1.0, 0.0), still, (-1.0, 0.0), still) if draw.random() < 0.6 else None
    spins = None if velocities is None else (0.0,) * 4
    sound = Contact(first, second, time_s, (math.cos(angle), math.sin(angle)), impulse, velocities, impulse, spins)
    names = ["impulse_n_s", "tangential_impulse_n_s", "velocities", "spins_rad_s", *["time_s"][draw.randrange(20) :]]
    return dataclasses.replace(sound, **{name: alter(getattr(sound, name)) for name in names})
