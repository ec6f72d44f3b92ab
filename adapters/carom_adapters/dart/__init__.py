"""Adapter of DART (the wheel `dartpy`): a boxed LCP over velocities, three-dimensional, 64-bit floats."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from carom.adapter import Accuracy, Engine, Knob, Profile, Scene, Setting
from carom_adapters.dart.limits import CAPABILITIES, DETECTORS, MIXING
from carom_adapters.dart.world import DartWorld

if TYPE_CHECKING:
    from carom.adapter import World

__all__ = ["DartAdapter", "adapter"]

#: An elastic impact gives back less by twice the mixing, and a velocity loses that at each impact on its way: this is
#: what sixteen make of a velocity, and of an energy.
CHAIN = Accuracy(velocity=16 * 2 * MIXING, energy=16 * 4 * MIXING)


def _default(dt_s: float) -> dict[str, Setting]:
    return {"dt_s": dt_s, "collision_detector": "FCL", "split_impulse": False}


def _tuned(dt_s: float) -> dict[str, Setting]:
    return {
        **_default(dt_s),
        # Spheres against spheres in closed form.
        "collision_detector": "DART",
        # Bodies that overlap are not pushed apart through their velocities.
        "split_impulse": True,
    }


class DartAdapter:
    """DART as it is shipped (`default`), or with exact normals and velocities of impacts alone (`tuned`)."""

    name = "dart"
    engine = Engine("DART", module="dartpy", distribution="dartpy", install="pip install 'carom[dart]'")
    capabilities = CAPABILITIES
    knobs: Mapping[str, Knob] = {
        "collision_detector": Knob(choices=DETECTORS),
        "split_impulse": Knob(choices=(False, True)),
    }
    profiles: Mapping[str, Profile] = {
        "default": Profile(
            "What a user of DART gets: all as shipped, but with the scene's restitution.",
            _default,
            CHAIN,
        ),
        "tuned": Profile(
            "The most exact fixed-step settings known, from Carom's own measurements: DART's own collision detector, "
            "and overlaps that are pushed apart without a trace in the velocities.",
            _tuned,
            CHAIN,
        ),
        "located": Profile(
            "The tuned settings, each step cut at the instant from which on DART's own collision detector finds an "
            "overlap (Carom's own bisection).",
            _tuned,
            CHAIN,
            located=True,
        ),
    }

    def prepare(self, scene: Scene, settings: Mapping[str, Setting]) -> World:
        """Build a world.

        Raises:
            AdapterError: The scene or a setting is outside what DART can do.
        """
        return DartWorld(scene, settings)


adapter = DartAdapter()
