"""Adapters that report wrong spins: on a rough scene, each is graded inaccurate or wrong."""

import math
from collections.abc import Mapping
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
from tests.cases import each, release_after

from carom import compare, solve_pic, solve_pit
from carom.catalogue import all_scenes
from carom.comparator import Grade, Verdict
from carom.engines.api import Observation, Scene, Setting, World
from carom.execution.observation.engine_run import observe_run
from carom_adapters.pic import PicAdapter

DT = 1 / 60

#: Where the one right answer has a spin that is not 0; bounces without end are left out, and what takes seconds.
ROUGH = ("grip", "slide", "edge", "throw-slide", "throw-stick", "gearing", "english-stick", "plates", "superball-table")


def scale_spins(seen: Observation, factor: float) -> Observation:
    """Return the observation with all spins multiplied by a factor; spins that are not reported are 0."""
    contacts = []
    for contact in seen.contacts:
        a, b, c, d = (factor * spin for spin in contact.spins_rad_s or (0.0, 0.0, 0.0, 0.0))
        contacts.append(replace(contact, spins_rad_s=(a, b, c, d)))
    spins = np.zeros(len(seen.position_m)) if seen.spin_rad_s is None else factor * seen.spin_rad_s
    return replace(seen, spin_rad_s=spins, contacts=tuple(contacts))


class SpoiltAdapter(PicAdapter):
    """PIC with spins multiplied by a factor; if the factor is 0, impacts are also without friction."""

    def __init__(self, factor: float) -> None:
        self.factor = factor

    def prepare(self, scene: Scene, settings: Mapping[str, Setting]) -> World:
        if not self.factor:
            still = [disc.model_copy(update={"spin_rad_s": 0.0}) for disc in scene.discs]
            scene = Scene(**{**dict(scene), "discs": still, "friction": 0.0, "wall_friction": 0.0})
        world: Any = super().prepare(scene, settings)
        parts = {name: getattr(world, name) for name in ("settings", "advance", "close")}
        return SimpleNamespace(**parts, observe=lambda: scale_spins(world.observe(), self.factor))


def grade_spoilt_pic(name: str, factor: float) -> tuple[Grade, set[Verdict]]:
    """Return grade and verdicts of a run of a rough scene."""
    scene = all_scenes()[f"spin/{name}"].scene
    trace = observe_run(SpoiltAdapter(factor), scene, "tuned", DT)
    score = compare(solve_pic(scene), trace, sampling=solve_pit(scene, frame_rate_hz=1 / DT))
    return score.grade, set(score.verdicts)


@each("name", [*ROUGH[::3], *release_after(0, ROUGH)])
@each("factor", release_after(1, [-1.0, 1 + 1e-6, 1.001]))
def test_wrong_spins_are_inaccurate_with_a_spin_verdict(name: str, factor: float) -> None:
    """Wrong spins are inaccurate by a verdict about spin alone; a reversal without an impact is wrong."""
    assert grade_spoilt_pic(name, 1.0) == (Grade.EXACT, {Verdict.CONFORMS})
    grade, verdicts = grade_spoilt_pic(name, factor)
    # A spin at the start that is turned round in the first step is one that turned with nothing near.
    turned = factor < 0.0 and any(disc.spin_rad_s for disc in all_scenes()[f"spin/{name}"].scene.discs)
    assert grade is (Grade.WRONG if turned else Grade.INACCURATE)
    assert (Verdict.TURNED_ALONE in verdicts) == turned
    assert verdicts & {Verdict.WRONG_SPIN, Verdict.ANGULAR, Verdict.SPINS}
    assert Verdict.WRONG_VELOCITY not in verdicts


@each("name", ROUGH[::3])
def test_adapter_without_friction_and_spin_is_inaccurate(name: str) -> None:
    """Smooth impacts without spin, reported for a rough scene, are inaccurate or worse, with a wrong spin."""
    grade, verdicts = grade_spoilt_pic(name, 0.0)
    assert grade.is_at_least_as_bad_as(Grade.INACCURATE)
    assert Verdict.WRONG_SPIN in verdicts


def test_spin_of_nan_ends_the_run() -> None:
    """A state with a spin of NaN cuts the run short, and the run is graded wrong."""
    grade, verdicts = grade_spoilt_pic("grip", math.nan)
    assert grade is Grade.WRONG
    assert Verdict.CUT_SHORT in verdicts
