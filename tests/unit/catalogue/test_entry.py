import math
from collections.abc import Iterator
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from tests.cases import each
from tests.scene_builders import alter_impact

from carom import solve_pic
from carom.catalogue import CatalogueScene, catalogue, deviation
from carom.model.trace import Trace

ENTRIES = list(catalogue().values())
WITH_IMPACTS = [entry for entry in ENTRIES if entry.known.impacts]


@cache
def solve_entry(entry: CatalogueScene) -> Trace:
    return solve_pic(entry.scene)


def compute_deviation(trace: Trace, entry: CatalogueScene) -> float:
    return deviation(trace, entry.known, entry.scene)


def generate_wrong_traces(entry: CatalogueScene) -> Iterator[tuple[str, Trace, float]]:
    """Yield traces that are not PIC's of a scene: in what, and by how much each deviates."""
    trace, scene = solve_entry(entry), entry.scene
    first, second = trace.impacts["first"][0], trace.impacts["second"][0]
    for k in range(len(trace.impacts)):
        yield f"without impact {k}", replace(trace, impacts=np.delete(trace.impacts, k)), math.inf
    yield "one too many", replace(trace, impacts=np.append(trace.impacts, trace.impacts[-1:])), math.inf
    yield "bodies swapped", alter_impact(trace, 0, first=second, second=first), math.inf
    known = [v for i in entry.known.impacts for v in (i.velocity_first_after, i.velocity_second_after) if v is not None]
    speed = max(math.hypot(*v) for v in (*known, *(disc.velocity_m_s for disc in scene.discs)))
    for name in ("velocity_first_after", *(("velocity_second_after",) if second >= 0 else ())):  # a wall has none
        velocity = trace.impacts[name][0] + np.array([0.01 * speed, 0.0])
        yield f"{name}, of the greatest speed", alter_impact(trace, 0, **{name: velocity}), 0.01
    late = trace.impacts["time_s"][-1] + 0.001 * scene.duration_s
    yield "a time, of the duration", alter_impact(trace, -1, time_s=late), 0.001


def test_deviation_equals_the_change_of_a_trace() -> None:
    """The deviation of a trace is its change over the scene's scale, infinite for another impact."""
    for entry in WITH_IMPACTS:
        for what, trace, off in generate_wrong_traces(entry):
            assert compute_deviation(trace, entry) == pytest.approx(off), (entry.name, what)


@each("name", ["classics/head-on", "classics/gas"])
def test_nan_deviates_infinitely(name: str) -> None:
    """A NaN in an impact or in the final state makes the deviation infinite; of a gas only the final state is known."""
    entry = catalogue()[name]
    trace = solve_entry(entry)
    nothing = np.full_like(trace.final_position_m, math.nan)
    lost = [replace(trace, final_position_m=nothing), replace(trace, final_velocity_m_s=nothing)]
    if entry.known.impacts:
        lost += [alter_impact(trace, 0, time_s=math.nan), alter_impact(trace, 0, velocity_first_after=math.nan)]
    assert [compute_deviation(one, entry) for one in lost] == [math.inf] * len(lost)


def test_doubled_final_velocity_is_detected() -> None:
    """In every scene of the catalogue, a doubled final velocity gives a deviation above 0.05."""
    for entry in ENTRIES:
        trace = solve_entry(entry)
        doubled = replace(trace, final_velocity_m_s=2 * trace.final_velocity_m_s)
        assert compute_deviation(doubled, entry) > 0.05, entry.name


def test_gas_that_flew_through_walls_is_detected() -> None:
    """A gas that flew through its walls deviates by more than 0.1, although it conserves its energy."""
    entry = catalogue()["classics/gas"]
    scene = entry.scene
    velocity = np.array([disc.velocity_m_s for disc in scene.discs])
    position = np.array([disc.position_m for disc in scene.discs]) + velocity * scene.duration_s
    trace = replace(solve_pic(scene), final_position_m=position, final_velocity_m_s=velocity)
    assert compute_deviation(trace, entry) > 0.1


def test_final_overlap_deviates_by_its_depth() -> None:
    """Two discs in the same final position deviate by the depth of their overlap, relative to the scene's extent."""
    entry = catalogue()["classics/gas"]
    trace = solve_entry(entry)
    position = trace.final_position_m.copy()
    position[0] = position[1]
    extent = max(c + disc.radius_m for disc in entry.scene.discs for c in disc.position_m)
    depth = 2 * entry.scene.discs[0].radius_m / extent
    assert compute_deviation(replace(trace, final_position_m=position), entry) == pytest.approx(depth)
