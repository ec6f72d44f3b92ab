"""The adapter of pymunk, each time with one lie about spin or friction. The conformance suite must find every one."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

from numpy.typing import NDArray

from carom.adapter import Contact, Observation, Scene, Setting
from carom_adapters.engine_adapter import EngineAdapter
from carom_adapters.pymunk import PymunkWorld, adapter


class Honest(PymunkWorld):
    """Has no fault."""

    def staged(self, scene: Scene) -> Scene:
        return scene

    def __init__(self, scene: Scene, settings: Mapping[str, Setting]) -> None:
        super().__init__(self.staged(scene), settings)


class OneFriction(Honest):
    """Gives walls the discs' friction."""

    def staged(self, scene: Scene) -> Scene:
        return scene.model_copy(update={"wall_friction": scene.friction})


class Rough(Honest):
    """Rubs three times as much as it is asked to."""

    def staged(self, scene: Scene) -> Scene:
        return scene.model_copy(update={"friction": 3 * scene.friction, "wall_friction": 3 * scene.wall_friction})


class Spheres(Honest):
    """Takes every disc that turns for a sphere."""

    def staged(self, scene: Scene) -> Scene:
        discs = tuple(disc.model_copy(update={"inertia_factor": 0.4}) for disc in scene.discs)
        return scene.model_copy(update={"discs": discs})


class Clamps(Honest):
    """Spins no disc faster than 50 rad/s, and says nothing."""

    def staged(self, scene: Scene) -> Scene:
        discs = tuple(d.model_copy(update={"spin_rad_s": min(d.spin_rad_s, 50.0)}) for d in scene.discs)
        return scene.model_copy(update={"discs": discs})


class Seen(Honest):
    """Shows spins other than they are."""

    def spins(self, spins: NDArray[Any]) -> NDArray[Any] | None:
        return spins

    def contact(self, contact: Contact) -> Contact:
        return contact

    def observe(self) -> Observation:
        seen = super().observe()
        contacts = tuple(self.contact(contact) for contact in seen.contacts)
        spins = None if seen.spin_rad_s is None else self.spins(seen.spin_rad_s)
        return dataclasses.replace(seen, spin_rad_s=spins, contacts=contacts)


class Damps(Seen):
    """Loses spin on the way."""

    def spins(self, spins: NDArray[Any]) -> NDArray[Any] | None:
        left: NDArray[Any] = spins * 0.96**self._clock.now_s
        return left


class Clockwise(Seen):
    """Counts spins the other way round."""

    def spins(self, spins: NDArray[Any]) -> NDArray[Any] | None:
        return -spins


class TellsNone(Seen):
    """Turns discs and does not tell."""

    def spins(self, spins: NDArray[Any]) -> None:  # noqa: ARG002 - the base's
        return None


class TurnsRubs(Seen):
    """Tells friction's impulse on the first body for that on the second."""

    def contact(self, contact: Contact) -> Contact:
        return dataclasses.replace(contact, tangential_impulse_n_s=-(contact.tangential_impulse_n_s or 0.0))


class DoublesRubs(Seen):
    """Tells twice as much friction as there is."""

    def contact(self, contact: Contact) -> Contact:
        return dataclasses.replace(contact, tangential_impulse_n_s=2 * (contact.tangential_impulse_n_s or 0.0))


class Hides(Seen):
    """Tells of no contact that is not head-on: spins change, and nobody knows why."""

    def observe(self) -> Observation:
        seen = super().observe()
        return dataclasses.replace(seen, contacts=seen.contacts if self._clock.now_s < 1.0 else ())


class Forgets(Honest):
    """Leaves out in silence what pymunk can't do."""

    def staged(self, scene: Scene) -> Scene:
        return scene.model_copy(update={"tangential_restitution": 0.0, "wall_tangential_restitution": 0.0})


def toy(name: str, world: type[PymunkWorld] = Honest) -> EngineAdapter:
    """Return an adapter that prepares what pymunk does, in another world."""
    return dataclasses.replace(adapter, name=name, world=world)


def claims(name: str, **capabilities: Any) -> EngineAdapter:
    """Return one that declares what it likes."""
    declared = dataclasses.replace(adapter.capabilities, **capabilities)
    return dataclasses.replace(adapter, name=name, world=Forgets, capabilities=declared)


honest = toy("honest")
one_friction = toy("one-friction", OneFriction)
rough = toy("rough", Rough)
spheres = toy("spheres", Spheres)
clamps = toy("clamps", Clamps)
damps = toy("damps", Damps)
clockwise = toy("clockwise", Clockwise)
tells_none = toy("tells-none", TellsNone)
turns_rubs = toy("turns-rubs", TurnsRubs)
doubles_rubs = toy("doubles-rubs", DoublesRubs)
hides = toy("hides", Hides)
claims_nothing = claims("claims-nothing", spin=False, friction=(0.0, 0.0))
claims_limits = claims(
    "claims-limits", max_spin_rad_s=10.0, friction=(0.01, 5.0), min_inertia_factor=0.1, tangential_restitution=False
)
claims_turns = claims("claims-turns", max_turn_rad=1.0)
