"""Runs on a table are judged by its law: what is right is exact or sampled, and what is not is found."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import pytest
from tests.drawn import slowing
from tests.lengths import long_after
from tests.stage import disc_at

from carom import Disc, Scene, compare, solve_pic
from carom.adapter import Contact, Observation
from carom.comparator import Grade
from carom.comparator.shift import begun_earlier
from carom.registry import load_adapter
from carom.runs.observe import observe_run
from carom.scenes import find_scenes
from carom_adapters.pic import PicAdapter

if TYPE_CHECKING:
    from carom.adapter import Adapter, Setting, World
    from carom.comparator.compare import Score

DT_S = 1 / 60
ON_TABLES = [entry.scene for entry in find_scenes(["contact/table-*"])]


class Otherwise(PicAdapter):
    """PIC of a scene in which a field is another."""

    def __init__(self, field: str, factor: float) -> None:
        self._field, self._factor = field, factor

    def prepare(self, scene: Scene, settings: Mapping[str, Setting]) -> World:
        """Run that scene."""
        value = self._factor * getattr(scene, self._field)
        return super().prepare(scene.model_copy(update={self._field: value}), settings)


class Silent(PicAdapter):
    """PIC seen as an engine: it tells its contacts to the step, and leaves velocities to be read off the states."""

    def prepare(self, scene: Scene, settings: Mapping[str, Setting]) -> World:
        """Run the scene."""
        world = super().prepare(scene, settings)
        observe = world.observe

        def seen() -> Observation:
            now = observe()
            told = (Contact(one.first, one.second, one.time_s // DT_S * DT_S, one.normal, 1.0) for one in now.contacts)
            return replace(now, contacts=tuple(told))

        world.observe = seen  # type: ignore[method-assign] # as an engine would be seen
        return world


def judged(scene: Scene, adapter: Adapter, dt_s: float = DT_S) -> Score:
    sampling = observe_run(load_adapter("pit"), scene, "tuned", dt_s)
    return compare(solve_pic(scene), observe_run(adapter, scene, "tuned", dt_s), sampling=sampling)


@pytest.mark.long
@pytest.mark.parametrize("seed", range(12))
def test_pit_is_no_worse_than_sampled_on_a_table(seed: int) -> None:
    """Of random tables none is inaccurate beside PIT at all phases of its step."""
    assert judged(slowing(seed), load_adapter("pit")).grade not in {Grade.INACCURATE, Grade.PARTED_INACCURATE}


@pytest.mark.parametrize("factor", long_after(1, [1.01, 0.0, 0.99, 2.0]))
@pytest.mark.parametrize("scene", ON_TABLES, ids=lambda scene: scene.name)
def test_another_deceleration_is_no_better_than_inaccurate(scene: Scene, factor: float) -> None:
    """Whether or not anything is met: each step changes velocities by that part of the table's less or more."""
    score = judged(scene, Otherwise("table_deceleration_m_s2", factor))
    assert score.grade in {Grade.INACCURATE, Grade.WRONG, Grade.PARTED_INACCURATE}
    assert score.local_truth is not None
    # At full speed a dt / v is 1.7e-3, and near the stop half of the part; what changes by over 1 % turns by itself.
    assert score.local_truth.slipped > 1e-3 or score.local_truth.invented > 0


def pair() -> Scene:
    """Return two discs that meet aside from the line of their centres, at no step's end."""
    return Scene(
        name="pair",
        discs=[disc_at(0.0, 0.0, 2.0, 0.1, r=0.25), disc_at(1.7, 0.2, 0.0, -0.1, r=0.25)],
        table_deceleration_m_s2=0.8,
        duration_s=2.0,
    )


def test_a_wrong_coefficient_is_found_on_a_table() -> None:
    """A run with nine tenths of the restitution is inaccurate, and off by a tenth."""
    score = judged(pair(), Otherwise("restitution", 0.9))
    assert score.local_truth is not None
    assert score.local_truth.grade is Grade.INACCURATE
    assert score.local_truth.restitution[1] == pytest.approx(0.1, rel=1e-9)


def test_effective_times_of_an_engine_are_those_of_paths_on_a_table() -> None:
    """States alone give PIC's instant back, and the velocities there."""
    reference = solve_pic(pair())
    observed = observe_run(Silent(), pair(), "tuned", DT_S)
    assert observed.effective_time_s == pytest.approx(reference.impacts["time_s"], abs=1e-14)
    for name in ("velocity_first_before", "velocity_second_before", "velocity_first_after", "velocity_second_after"):
        assert observed.impacts[name][0] == pytest.approx(reference.impacts[name][0], abs=1e-13)


def test_a_step_beyond_the_end_leaves_out_what_stops_in_it() -> None:
    """A disc that stops after the scene's end, and before the last look, moves at the end as fast as PIC has it."""
    scene = Scene(
        name="stops", discs=[Disc(position_m=(0, 0), velocity_m_s=(1, 0), radius_m=0.25)],
        table_deceleration_m_s2=1.0, duration_s=0.995,
    )  # fmt: skip
    observed = observe_run(load_adapter("pic"), scene, "tuned", 0.3)
    assert observed.end_time_s == pytest.approx(0.995, abs=1e-15)
    assert observed.final_velocity_m_s[0, 0] == pytest.approx(0.005, abs=1e-15)
    assert observed.final_position_m[0, 0] == pytest.approx(0.5 - 0.005**2 / 2, abs=1e-15)


def test_a_scene_on_a_table_begins_earlier_or_later() -> None:
    """Begun a tenth of a second earlier, the same impact comes a tenth later; not where discs meet on the way back."""
    (first,) = solve_pic(pair()).impacts["time_s"]
    earlier = begun_earlier(pair(), 0.1)
    assert earlier.duration_s == pytest.approx(2.1)
    assert solve_pic(earlier).impacts["time_s"][0] == pytest.approx(first + 0.1, abs=1e-14)
    behind = pair().model_copy(update={"discs": [*pair().discs, disc_at(-0.55, 0.0, r=0.25)]})
    assert begun_earlier(Scene(**dict(behind)), 0.1).duration_s == pytest.approx(1.9)
