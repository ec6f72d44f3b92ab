"""Adapters that get spin wrong, driven by the harness as any: none of them is graded well on a rough scene."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from tests.cases import each, release_after
from tests.scene_builders import require_value

from carom import Trace, compare, solve_pic, solve_pit
from carom.catalogue import all_scenes
from carom.comparator import Grade, Verdict
from carom.engines.api import Contact, Observation, Scene, Setting, World
from carom.execution.observation.engine_run import observe_run
from carom_adapters.pic import PicAdapter

DT = 1 / 60

#: Where the one right answer has a spin that is not 0; bounces without end are left out, and what takes seconds.
ROUGH = ("grip", "slide", "edge", "throw-slide", "throw-stick", "gearing", "english-stick", "plates", "superball-table")


@dataclass
class Spoilt:
    """A PIC world whose observations are spoilt before the harness sees them."""

    world: World
    spoil: Callable[[Observation], Observation]

    @property
    def settings(self) -> Mapping[str, Setting]:
        return self.world.settings

    def advance(self, steps: int) -> None:
        self.world.advance(steps)

    def observe(self) -> Observation:
        return self.spoil(self.world.observe())

    def close(self) -> None:
        self.world.close()


class SpoiltAdapter(PicAdapter):
    """PIC, spoilt."""

    def __init__(self, spoil: Callable[[Observation], Observation], *, smooth: bool = False) -> None:
        self.spoil, self.smooth = spoil, smooth

    def prepare(self, scene: Scene, settings: Mapping[str, Setting]) -> World:
        if self.smooth:
            still = [disc.model_copy(update={"spin_rad_s": 0.0}) for disc in scene.discs]
            scene = Scene(**{**dict(scene), "discs": still, "friction": 0.0, "wall_friction": 0.0})
        return Spoilt(super().prepare(scene, settings), self.spoil)


def run_spoilt_pic(name: str, spoil: Callable[[Observation], Observation], *, smooth: bool = False) -> Trace:
    return observe_run(SpoiltAdapter(spoil, smooth=smooth), all_scenes()[f"spin/{name}"].scene, "tuned", DT)


def build_spin_factor(factor: float) -> Callable[[Observation], Observation]:
    """Spoil every spin after an impact; what is before one is what was after the last, as an engine's states are."""

    def spoil(seen: Observation) -> Observation:
        contacts = tuple(scale_spins(contact, factor) for contact in seen.contacts)
        return replace(seen, spin_rad_s=factor * require_value(seen.spin_rad_s), contacts=contacts)

    return spoil


def scale_spins(contact: Contact, factor: float) -> Contact:
    a, b, c, d = (factor * spin for spin in require_value(contact.spins_rad_s))
    return replace(contact, spins_rad_s=(a, b, c, d))


def remove_spins(seen: Observation) -> Observation:
    """A method that declares spin and tells none: zeros, everywhere."""
    contacts = tuple(replace(contact, spins_rad_s=(0.0,) * 4) for contact in seen.contacts)
    return replace(seen, spin_rad_s=np.zeros(len(seen.position_m)), contacts=contacts)


def grade_trace(name: str, trace: Trace) -> tuple[Grade, set[Verdict]]:
    scene = all_scenes()[f"spin/{name}"].scene
    score = compare(solve_pic(scene), trace, sampling=solve_pit(scene, frame_rate_hz=1 / DT))
    return score.grade, set(score.verdicts)


@each("name", ROUGH[::3])
def test_unspoilt_pic_is_exact(name: str) -> None:
    """Without a spoilt spin the same adapter is graded exact, so that the grades below are due to the fault."""
    assert grade_trace(name, run_spoilt_pic(name, lambda seen: seen)) == (Grade.EXACT, {Verdict.CONFORMS})


@each("name", [*ROUGH[::3], *release_after(0, ROUGH)])
@each("factor", release_after(1, [-1.0, 1 + 1e-6, 1.001]))
def test_wrong_spins_are_inaccurate_with_a_spin_verdict(name: str, factor: float) -> None:
    """Wrong spins are inaccurate by a verdict about spin alone; a reversal without an impact is wrong."""
    grade, verdicts = grade_trace(name, run_spoilt_pic(name, build_spin_factor(factor)))
    # A spin at the start that is turned round in the first step is one that turned with nothing near.
    turned = factor < 0.0 and any(disc.spin_rad_s for disc in all_scenes()[f"spin/{name}"].scene.discs)
    assert grade is (Grade.WRONG if turned else Grade.INACCURATE)
    assert (Verdict.TURNED_ALONE in verdicts) == turned
    assert verdicts & {Verdict.WRONG_SPIN, Verdict.ANGULAR, Verdict.SPINS}
    assert Verdict.WRONG_VELOCITY not in verdicts


@each("name", ROUGH[::3])
def test_adapter_without_friction_and_spin_is_inaccurate(name: str) -> None:
    """Smooth impacts without spin, reported for a rough scene, are inaccurate or worse, with a wrong spin."""
    grade, verdicts = grade_trace(name, run_spoilt_pic(name, remove_spins, smooth=True))
    assert grade.is_at_least_as_bad_as(Grade.INACCURATE)
    assert Verdict.WRONG_SPIN in verdicts


def test_spin_of_nan_ends_the_run() -> None:
    """A state with a spin of NaN cuts the run short, and the run is graded wrong."""
    grade, verdicts = grade_trace("grip", run_spoilt_pic("grip", build_spin_factor(math.nan)))
    assert grade is Grade.WRONG
    assert Verdict.CUT_SHORT in verdicts
