"""Forms of a method that give the same bits, on random scenes of every kind: see `tests/random_scenes.py`.

Mirroring a scene, or measuring it in other units, changes its trace in the same way.
"""

import math
import random
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import pytest
from tests.cases import each, release_after
from tests.random_scenes import KINDS, SMALL, TABLES, draw_scene, draw_small_scene, draw_table, number_of_impacts
from tests.transformed_scenes import Map, assert_transformed, in_units, mirror, transform_scene, turn_quarter
from tests.unit.solvers.pit.run_forms import list_compiled_forms, start_plain_run
from tests.unit.solvers.run_kinds import all_pairs, collect_run_bits

from carom import Scene, Trace, solve_pic, solve_pic_framewise, solve_pit
from carom.catalogue import catalogue
from carom.model.trace import Outcome
from carom.solvers.event_driven.run import EventDrivenRun
from carom.solvers.pic import start_pic_run
from carom.solvers.pit.clock import FrameClock
from carom.solvers.pit.solve import start_pit_run
from carom.solvers.run import Run

#: Scenes of a kind by their numbers: a few, and hundreds with `-m long`.
BATCHES = [range(6), range(6, 24), *(range(first, first + 114) for first in range(24, 480, 114))]
#: Kinds of few discs, and tables, have more scenes; half of all scenes of discs and half-planes are rough.
TIMES = dict.fromkeys(KINDS, 1) | dict.fromkeys(SMALL, 6) | dict.fromkeys(TABLES, 1)
GRAVITY = (0.25, -1.0)
#: Other laws that slow or pull discs, for which PIC has a separate class of runs.
LAWS: dict[str, dict[str, Any]] = {
    "falling": {"gravity_m_s2": GRAVITY},
    "damped": {"damping_per_s": 0.25},
    "on a table": {"table_deceleration_m_s2": 0.25},
}

Bits = dict[str, object]

each_batch = each("batch", release_after(1, BATCHES))


def scale_range(batch: range, more: float) -> range:
    """Return a batch with a multiple of the numbers."""
    return range(int(batch.start * more), int(batch.stop * more))


def draw_scene_with_law(law: dict[str, Any], kind: str, number: int) -> Scene:
    """Return the scene of a kind and a number under a law; with table deceleration, without friction and spin."""
    scene = draw_scene(kind, number, rough=number % 4 > 1 and "table_deceleration_m_s2" not in law)
    return Scene(**{**dict(scene), **law})


class RunRequest(NamedTuple):
    """Request for a run: scene, largest number of impacts, and what is recorded."""

    scene: Scene
    impacts: int
    options: dict[str, Any]


def draw_run_request(kind: str, number: int) -> RunRequest:
    """Return the request with a number.

    Some requests record only a range of impacts, and some use contacts of finite duration (TC model).
    """
    rng = random.Random(f"asked {number}")
    if kind in TABLES:  # enough impacts for several epochs of a disc or two
        return RunRequest(draw_table(kind, number), 120, {"contact_duration_s": rng.choice([0.0, 0.0, 1e-3])})
    window_s = (1.0, 8.0) if rng.random() < 0.2 else (-math.inf, math.inf)
    options = {"contact_duration_s": rng.choice([0.0, 0.0, 0.1]), "window_s": window_s}
    return RunRequest(draw_scene(kind, number, rough=number % 4 > 1), number_of_impacts(number), options)


def run_to_end(run: Run, request: RunRequest) -> Bits:
    """Return the results of a run at its end."""
    return collect_run_bits(run, run.advance_to(request.scene.duration_s, request.impacts))


def run_in_pieces(run: Run, request: RunRequest, ends_s: float) -> Bits:
    """Advance a run in several parts, up to times and numbers of impacts, and read its state between the parts."""
    rng = random.Random(request.scene.name)
    for time_s in sorted(rng.uniform(0.0, ends_s) for _ in range(3)):
        run.advance_to(time_s, rng.randint(0, request.impacts))
        collect_run_bits(run, Outcome.COMPLETED)
    return run_to_end(run, request)


def run_resumed(request: RunRequest) -> Bits:
    """Advance a run half the way and continue another run from its state. Join the records of both runs."""
    first = EventDrivenRun(request.scene, **request.options)
    first.advance_to(request.scene.duration_s, request.impacts // 2)
    second = EventDrivenRun(request.scene, resume=first.state(), **request.options)
    found = run_to_end(second, request)
    for name, rows in (("impacts", first.log.array()), ("spins", first.log.spins()), ("edges", first.log.edges())):
        if rows is not None:
            later = found[name]
            assert isinstance(later, bytes)
            found[name] = rows.tobytes() + later
    kept = len(first.log)
    return {**found, "ambiguous": (*first.log.ambiguous(), *(kept + row for row in second.log.ambiguous()))}


def run_with_cells(factor: float) -> Callable[[RunRequest, float], Bits]:
    return lambda request, _: run_to_end(EventDrivenRun(request.scene, cell_factor=factor, **request.options), request)


#: Counts that both loops have.
COUNTS = ("impacts", "wall_impacts", "predictions", "epochs")
#: Each function gets the request, and the time at which the core's run of the request ended.
PIC_FORMS: dict[str, Callable[[RunRequest, float], Bits]] = {
    "cells": run_with_cells(1.0 + 2.0**-20),  # with a factor of 1, a run with few discs has no cells
    "wider cells": run_with_cells(1.5),
    "wide cells": run_with_cells(3.0),
    "one cell": run_with_cells(math.inf),
    "in pieces": lambda request, ends_s: run_in_pieces(
        EventDrivenRun(request.scene, **request.options), request, ends_s
    ),
    "resumed": lambda request, _: run_resumed(request),
}


def list_different_fields(expected: Bits, found: Bits, what: str) -> list[str]:
    """Return in which of its fields a form differs."""
    return [f"{what}: {name}" for name in expected if found[name] != expected[name]]


def compare_forms(request: RunRequest, what: str) -> tuple[EventDrivenRun, list[str]]:
    """Return the kernel's run of a request, and the fields in which each form of PIC differs."""
    kernel, plain = EventDrivenRun(request.scene, **request.options), all_pairs(request.scene, **request.options)
    expected = run_to_end(kernel, request)
    found = list_different_fields(
        expected, run_in_pieces(plain, request, kernel.time_s), f"{what}, all pairs, in pieces"
    )
    found += [f"{what}, counts: {name}" for name in COUNTS if kernel.counts[name] != plain.counts[name]]
    for name, form in PIC_FORMS.items():
        found += list_different_fields(expected, form(request, kernel.time_s), f"{what}, {name}")
    return kernel, found


#: Numbers of scenes of each kind. Tables have half as many as other kinds; the last numbers are 1,920 for tables and
#: 960 for driven bodies.
DRAWN = [(kind, scale_range(BATCHES[0], 0.5 if kind in TABLES else TIMES[kind])) for kind in TIMES]
DRAWN += [(kind, range(len(BATCHES[0]) // 2, len(BATCHES[0]))) for kind in TABLES]
DRAWN += [(kind, scale_range(batch, TIMES[kind])) for batch in BATCHES[1:] for kind in TIMES]
DRAWN += [
    (kind, range(first, first + 120))
    for kind, end in zip(TABLES, (1920, 960), strict=True)
    for first in range(480, end, 120)
]


@each("kind, numbers", release_after(len(TIMES), DRAWN))
def test_all_forms_of_pic_are_bit_identical(kind: str, numbers: range) -> None:
    """All pairs, cells of any width, runs in pieces and resumed runs give the bits of the kernel."""
    different, impacts = list[str](), 0
    for number in numbers:
        kernel, found = compare_forms(draw_run_request(kind, number), f"{kind} {number}")
        different += found
        impacts += kernel.impacts
    assert different == []
    assert impacts > len(numbers)


#: Each kind under one law, in turn, and with `-m long` under the others.
EACH_LAW = [(kind, law) for turn in range(3) for k, kind in enumerate(KINDS) for law in [list(LAWS)[(k + turn) % 3]]]


@pytest.mark.parametrize(("kind", "law"), release_after(len(KINDS), EACH_LAW))
@each_batch
def test_runs_in_pieces_are_bit_identical_under_every_law(kind: str, law: str, batch: range) -> None:
    """With gravity, damping or table deceleration a run in pieces has the bits of one without pauses."""
    for number in scale_range(batch, 1 / 4):
        request = RunRequest(draw_scene_with_law(LAWS[law], kind, number), min(number_of_impacts(number), 25), {})
        run = start_pic_run(request.scene)
        expected = run_to_end(run, request)
        found = run_in_pieces(start_pic_run(request.scene, all_pairs=number % 2 == 0), request, run.time_s)
        assert list_different_fields(expected, found, f"{kind} {number} {law}") == []


# PIT ------------------------------------------------------------------------------------------------------------------


def run_frames(form: Callable[[Scene, FrameClock], Any], scene: Scene, clock: FrameClock) -> Bits:
    run = form(scene, clock)
    return {**collect_run_bits(run, run.advance_to(scene.duration_s)), "frames": run.frames}


def run_frames_in_pieces(form: Callable[[Scene, FrameClock], Any], scene: Scene, clock: FrameClock) -> Bits:
    """Stop between frames, at frames and in the past, and read the state of the run there."""
    run, rng = form(scene, clock), random.Random(scene.name)
    for part in (0.0, rng.random(), 0.5, rng.random(), 0.25):
        run.advance_to(part * scene.duration_s)
        collect_run_bits(run, Outcome.COMPLETED)
        run.advance_to(clock.time_s(run.frames) if clock.time_s(run.frames) < scene.duration_s else 0.0)
    return {**collect_run_bits(run, run.advance_to(scene.duration_s)), "frames": run.frames}


@pytest.mark.parametrize("kind", TIMES)
@each_batch
def test_all_forms_of_pit_are_bit_identical(kind: str, batch: range) -> None:
    """PIT runs that skip tests or sweep, in one go or in pieces, have the bits of a run that makes every test."""
    impacts = 0
    for number in scale_range(batch, 2 / 3):
        gravity = GRAVITY if number % 4 == 2 else (0.0, 0.0)
        scene = (
            draw_table(kind, number)
            if kind in TABLES
            else draw_scene(kind, number, rough=number % 4 == 3, gravity=gravity)
        )
        scene = scene.model_copy(update={"duration_s": min(scene.duration_s, 4.0)}) if kind == "table" else scene
        clock = FrameClock(rate_hz=scene.frame_rate_hz) if number % 2 else FrameClock(step_s=1 / scene.frame_rate_hz)
        forms = list_compiled_forms()
        expected = run_frames(start_plain_run, scene, clock)
        for name, form in forms.items():
            different = list_different_fields(
                expected, run_frames(form, scene, clock), f"drawn({kind!r}, {number}), {name}"
            )
            assert different == []
        name = sorted(forms)[number % len(forms)]
        pieces = run_frames_in_pieces(forms[name], scene, clock)
        assert list_different_fields(expected, pieces, f"drawn({kind!r}, {number}), {name}, in pieces") == []
        impacts += len(solve_pit(scene).impacts)
    assert impacts > 0


@each("turn", [0, *release_after(0, [1, 2])])
def test_pit_in_pieces_is_bit_identical_under_every_law(turn: int) -> None:
    """PIT in pieces gives the bits of a whole run also with gravity, damping or table deceleration."""
    for kind, law in EACH_LAW[turn * len(KINDS) : (turn + 1) * len(KINDS)]:
        scene = draw_scene_with_law(LAWS[law], kind, 3)
        clock = FrameClock(rate_hz=scene.frame_rate_hz)
        whole, pieces = (taking(start_pit_run, scene, clock) for taking in (run_frames, run_frames_in_pieces))
        assert list_different_fields(whole, pieces, f"{kind} {law}") == []


# Mirrors and units ----------------------------------------------------------------------------------------------------

SOLVERS: dict[str, Callable[[Scene], Trace]] = {
    "pic": lambda scene: solve_pic(scene, max_impacts=60),
    "framewise": solve_pic_framewise,
    "pit": solve_pit,
}
#: How far each unit is changed: well within `carom.support.limits`, which also have to hold the scene.
MOST = 500
#: Powers of two by which lengths, times and masses are multiplied: extreme values, and values at which a sum, a product
#: or a square of sizes first requires scaling, or the square of a speed underflows.
UNITS = [
    (-100, 430, 0),
    *((power, 0, 0) for power in (MOST, -MOST, 196, 201)),
    *((0, power, 0) for power in (MOST, -MOST, -199, 200)),
    *((0, 0, power) for power in (MOST, -MOST)),
    *((MOST, MOST, 3), (-MOST, -MOST, -3), (MOST // 2, -MOST // 2, MOST), (-17, 20, -5)),
]


def build_symmetric_scenes() -> list[Any]:
    """Return scenes of the catalogue, one of eight to begin with, and drawn ones, smooth and rough, under each law."""
    found = [pytest.param([entry.scene for entry in list(catalogue().values())[::8]], id="catalogue")]
    others = [entry.scene for k, entry in enumerate(catalogue().values()) if k % 8]
    found.append(pytest.param(others, id="catalogue, the others", marks=pytest.mark.release))
    for law, fields in {"floating": {}, **LAWS}.items():
        scenes = []
        for number in range(4 if law == "floating" else 2):
            scene = draw_small_scene(
                number, rough=number % 2 == 1 and law != "on a table", restitutions=(0.5, 0.75, 1.0)
            )
            scenes.append(Scene(**{**dict(scene), **fields, "duration_s": 6.0}))
        found.append(pytest.param(scenes, id=law))
    return found


each_symmetric = each("scenes", build_symmetric_scenes())


@pytest.mark.parametrize("solver", ["pic", *release_after(0, ["framewise"])])
@pytest.mark.parametrize("turn", [mirror, turn_quarter])
@each_symmetric
def test_mirrored_scene_has_the_mirrored_trace_to_the_bit(scenes: list[Scene], turn: Map, solver: str) -> None:
    """Mirroring a scene or turning it by a quarter does exactly the same to its trace."""
    # IEEE arithmetic treats signs and axes alike.
    for scene in scenes:
        assert_transformed(SOLVERS[solver](scene), SOLVERS[solver](transform_scene(scene, turn, turn, turn)), turn)


@pytest.mark.parametrize(
    ("solver", "units"),
    release_after(2, [("pic", UNITS[::4]), ("pit", UNITS[1::4]), *((name, UNITS) for name in SOLVERS)]),
)
@each_symmetric
def test_scaling_units_by_powers_of_two_changes_no_mantissa(
    scenes: list[Scene], solver: str, units: Sequence[tuple[int, int, int]]
) -> None:
    """Scaling lengths, times and masses by 2^-500 to 2^500 changes exponents and no other bit of a trace."""
    for scene in scenes:
        plain = SOLVERS[solver](scene)
        pulled = any(scene.gravity_m_s2) or scene.table_deceleration_m_s2 > 0.0
        for length, time, mass in units:
            if pulled and abs(length - 2 * time) > MOST:  # an acceleration has the time squared
                length, time = length // 3, time // 3  # noqa: PLW2901 - what the limits hold
            factors = {"length": 2.0**length, "time": 2.0**time}
            other = SOLVERS[solver](in_units(scene, **factors, mass=2.0**mass))
            assert_transformed(plain, other, length=factors["length"], time=factors["time"])
