"""Search for settings of a toy engine, whose best settings are known."""

from collections.abc import Sequence
from itertools import pairwise
from typing import cast

import pytest
from tests.cases import each
from tests.scene_builders import disc_at, staged

from carom import Scene
from carom.comparator import Grade
from carom.engines.api import Knob
from carom.execution.job import Method
from carom.model.trace import Setting
from carom.studies.tune.evaluate import Evaluator
from carom.studies.tune.objective import SceneResult
from carom.studies.tune.search import KnobSearch
from carom.studies.tune.search_space import Space, list_values

KNOBS = {
    "threshold": Knob(0.0, 1.0),
    "slop": Knob(1e-9, 1e-3, log=True),
    "mode": Knob(choices=("plain", "swept", "odd")),
    "iterations": Knob(1, 100, log=True),
    "idle": Knob(0.0, 1.0),
}
SPACE = Space({name: list_values(knob) for name, knob in KNOBS.items()})
SHIPPED: dict[str, Setting] = {"threshold": 1.0, "slop": 1e-3, "mode": "plain", "iterations": 8, "idle": 0.5}
SCENES = [staged(f"scene {k}", disc_at(0, 0, 1, 0, r=1), duration_s=1.0) for k in range(6)]


class Toy:
    """An evaluator of an engine that needs threshold 0, mode swept and the smallest slop; no other knob matters.

    Half of the scenes are slow and wrong above a threshold of 0; the others are sampled at best unless swept, and then
    as far off as the slop is large.
    """

    def evaluate(self, method: Method, scenes: Sequence[Scene]) -> list[SceneResult]:
        """Return the results of a method on some scenes."""
        settings = {**SHIPPED, **dict(method.overrides)}
        found = []
        for scene in scenes:
            if SCENES.index(scene) % 2 and float(settings["threshold"]) > 0:
                found.append(SceneResult(Grade.WRONG, missed=1))
            elif settings["mode"] != "swept":
                found.append(SceneResult(Grade.INACCURATE if settings["mode"] == "odd" else Grade.SAMPLED, 1.0))
            else:
                found.append(SceneResult(Grade.CLOSE, float(settings["slop"])))
        return found


@each("seed", [0, *(pytest.param(seed, marks=pytest.mark.long) for seed in range(1, 6))])
def test_search_finds_exactly_the_settings_that_matter(seed: int) -> None:
    """With each of six seeds, the search finds the three settings that matter, and ends some trials early."""
    search = KnobSearch(Method("toy", "default"), SPACE, SCENES, cast(Evaluator, Toy()))
    best = search.run(60, seed)
    assert search.count_abandoned() > 0
    assert dict(best.overrides) == {"threshold": 0.0, "mode": "swept", "slop": 1e-9}
    assert (best.merit.wrong, best.merit.imprecise) == (0, 0)


def test_search_finds_settings_that_help_only_together() -> None:
    """The search finds two settings that make a scene wrong alone and none together."""

    class Valley(Toy):
        def evaluate(self, method: Method, scenes: Sequence[Scene]) -> list[SceneResult]:
            tried = dict(method.overrides)
            fine, bare = tried.get("slop") == 1e-9, tried.get("threshold") == 0.0
            usual = SceneResult(Grade.CLOSE, 1e-6) if fine else SceneResult(Grade.SAMPLED, 1.0)
            first = SceneResult(Grade.WRONG) if fine != bare else usual
            return [usual if SCENES.index(scene) else first for scene in scenes]

    # So few trials that it can't be luck: no more than each knob alone.
    best = KnobSearch(Method("toy", "default"), SPACE, SCENES, cast(Evaluator, Valley())).run(2 * len(KNOBS), 0)
    assert dict(best.overrides) == {"slop": 1e-9, "threshold": 0.0}


def test_search_without_improvement_returns_first_profile() -> None:
    """If no knob has an effect, the search returns the profile that it started from."""
    idle = Space({"idle": SPACE.values["idle"]})
    search = KnobSearch(Method("toy", "default"), idle, SCENES, cast(Evaluator, Toy()))
    assert search.run(10, 0) is search.first


def test_knob_values_include_both_ends_of_the_range() -> None:
    """A knob's values include both ends, geometric if logarithmic; whole numbers and choices occur once."""
    assert list_values(KNOBS["threshold"])[0::16] == (0.0, 1.0)
    slop = [float(value) for value in list_values(KNOBS["slop"])]
    assert (slop[0], slop[-1]) == (1e-9, 1e-3)
    assert [b / a for a, b in pairwise(slop)] == pytest.approx([1e6 ** (1 / 16)] * 16)
    assert list_values(Knob(1, 4)) == (1, 2, 3, 4)
    assert list_values(KNOBS["mode"]) == ("plain", "swept", "odd")
