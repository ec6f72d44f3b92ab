"""The event-driven kernel against the run that solves every pair anew, to the bit: two algorithms, one answer.

Every second scene lies on whole numbers, where impacts, walls and edges of cells come at one instant: there an order of
ties, or an edge taken for an impact, shows. Restitution 0, .5 and 1, immovable discs, unequal radii, walls along the
axes and oblique, each up to three times.
"""

from __future__ import annotations

import math
import random

import pytest
from tests.validation.small_scenes import impacts_of, small_scene

from carom import Scene, solve_pic, solve_pic_framewise
from carom.solvers.event_driven.run import EventDrivenRun
from carom.solvers.plain.run import AllPairsRun

#: Scenes of a test: enough that starting it costs nothing beside them.
BATCH = 100


def everything(run: EventDrivenRun | AllPairsRun) -> dict[str, object]:
    """Return all that a run gives, in its bits."""
    return {
        "impacts": run.log.array().tobytes(),
        "ambiguous": run.log.ambiguous(),
        "positions": run.positions().tobytes(),
        "velocities": run.velocities().tobytes(),
        "time_s": run.time_s,
        "impacts_per_disc": run.impacts_per_disc().tolist(),
    }


def taken(run: EventDrivenRun | AllPairsRun, scene: Scene, impacts: int) -> dict[str, object]:
    outcome = run.advance_to(scene.duration_s, impacts)
    return {"outcome": outcome, **everything(run)}


def differences(number: int) -> list[str]:
    """Return what differs between the kernel and all pairs."""
    scene, impacts = small_scene(number), impacts_of(number)
    one, other = taken(EventDrivenRun(scene), scene, impacts), taken(AllPairsRun(scene), scene, impacts)
    return [f"small_scene({number}), {impacts} impacts: {name}" for name in one if one[name] != other[name]]


def no_differences(numbers: range) -> None:
    assert [text for number in numbers for text in differences(number)] == []


@pytest.mark.parametrize("batch", range(4))
def test_the_kernel_gives_the_bits_of_all_pairs(batch: int) -> None:
    """Every field of every impact, the final state, the outcome and what is ambiguous are the same bits."""
    no_differences(range(batch * BATCH, (batch + 1) * BATCH))


@pytest.mark.long
@pytest.mark.parametrize("batch", range(4, 200))
def test_the_kernel_gives_the_bits_of_all_pairs_in_many_more_scenes(batch: int) -> None:
    """So they are in 18,000 scenes more."""
    no_differences(range(batch * BATCH, (batch + 1) * BATCH))


@pytest.mark.parametrize("frame_rate_hz", [0.7, 60.0])
def test_frames_change_no_bit(frame_rate_hz: float) -> None:
    """Algorithm 2, which stops at every frame, gives the trace of event-driven PIC, whatever the frame rate."""
    for number in range(40):
        scene = small_scene(number)
        # Half the time of its first impacts: a collapse would go on without end.
        end_s = solve_pic(scene, max_impacts=30).end_time_s
        scene = scene.model_copy(update={"duration_s": max(end_s / 2, 0.01)})
        plain, framewise = solve_pic(scene), solve_pic_framewise(scene, frame_rate_hz=frame_rate_hz)
        assert framewise.impacts.tobytes() == plain.impacts.tobytes()
        assert framewise.ambiguous == plain.ambiguous
        assert framewise.outcome is plain.outcome
        assert framewise.final_position_m.tobytes() == plain.final_position_m.tobytes()
        assert framewise.final_velocity_m_s.tobytes() == plain.final_velocity_m_s.tobytes()


def cells_change_no_bit(numbers: range) -> None:
    for number in numbers:
        scene, impacts = small_scene(number), impacts_of(number)
        narrow = taken(EventDrivenRun(scene), scene, impacts)
        for cell_factor in (1.5, 3.0, math.inf):
            wide = taken(EventDrivenRun(scene, cell_factor=cell_factor), scene, impacts)
            assert wide == narrow, f"small_scene({number}), cell_factor {cell_factor}"


def pieces_change_no_bit(numbers: range) -> None:
    rng = random.Random(1)
    for number in numbers:
        scene, impacts = small_scene(number), impacts_of(number)
        whole = EventDrivenRun(scene)
        expected = taken(whole, scene, impacts)
        run = EventDrivenRun(scene)
        for time_s in sorted(rng.uniform(0.0, whole.time_s) for _ in range(3)):
            run.advance_to(time_s, rng.randint(0, impacts))
        assert taken(run, scene, impacts) == expected, f"small_scene({number}), in pieces"

        first = EventDrivenRun(scene)
        first.advance_to(scene.duration_s, impacts // 2)
        second = EventDrivenRun(scene, resume=first.state())
        resumed = taken(second, scene, impacts)
        kept = len(first.log.array())
        resumed["impacts"] = first.log.array().tobytes() + second.log.array().tobytes()
        resumed["ambiguous"] = (*first.log.ambiguous(), *(kept + row for row in second.log.ambiguous()))
        assert resumed == expected, f"small_scene({number}), resumed"


def test_cells_change_no_bit() -> None:
    """Wider cells, or one for all, give the same bits in scenes full of ties."""
    cells_change_no_bit(range(500))


def test_pieces_and_resumed_runs_change_no_bit() -> None:
    """A run taken forward in pieces, by time and by count, or taken up again from its state, gives the same bits."""
    pieces_change_no_bit(range(500))


@pytest.mark.long
@pytest.mark.parametrize("batch", range(1, 20))
def test_neither_cells_nor_pieces_change_a_bit_in_many_more_scenes(batch: int) -> None:
    """So they do in 9,500 scenes more."""
    numbers = range(batch * 500, (batch + 1) * 500)
    cells_change_no_bit(numbers)
    pieces_change_no_bit(numbers)
