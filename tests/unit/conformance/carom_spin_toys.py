"""Copies of pymunk's adapter with one false statement on spin or friction each, which the suite must find."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from carom.engines.api import Contact, Disc, Observation, Scene, Setting
from carom_adapters.pymunk.adapter import adapter
from carom_adapters.pymunk.world import PymunkWorld
from carom_adapters.shared.engine_adapter import EngineAdapter

Staged = Callable[[Scene], Scene]
Seen = Callable[[Observation, float], Observation]


def build_adapter(
    name: str, staged: Staged = lambda scene: scene, seen: Seen = lambda seen, _: seen, **capabilities: Any
) -> EngineAdapter:
    """Return an adapter that declares what it likes, stages another scene, and shows other things than it has seen."""

    class World(PymunkWorld):
        def __init__(self, scene: Scene, settings: Mapping[str, Setting]) -> None:
            super().__init__(staged(scene), settings)

        def observe(self) -> Observation:
            return seen(super().observe(), self._clock.now_s)

    return replace(adapter, name=name, world=World, capabilities=replace(adapter.capabilities, **capabilities))


def change_scene(**fields: Callable[[Scene], Any]) -> Staged:
    """Return what gives a scene other fields."""
    return lambda scene: scene.model_copy(update={name: of(scene) for name, of in fields.items()})


def change_discs(**fields: Callable[[Disc], float]) -> Staged:
    """Return what gives each disc other fields."""

    def other(disc: Disc) -> Disc:
        return disc.model_copy(update={name: of(disc) for name, of in fields.items()})

    return change_scene(discs=lambda scene: tuple(map(other, scene.discs)))


def change_spins(of: Callable[[Any, float], Any]) -> Seen:
    """Return what shows other spins, by those that are and the time."""
    return lambda seen, now_s: seen if seen.spin_rad_s is None else replace(seen, spin_rad_s=of(seen.spin_rad_s, now_s))


def scale_friction_impulses(times: float) -> Seen:
    """Return what tells this many times friction's impulse."""

    def told(contact: Contact) -> Contact:
        return replace(contact, tangential_impulse_n_s=times * (contact.tangential_impulse_n_s or 0.0))

    return lambda seen, _: replace(seen, contacts=tuple(map(told, seen.contacts)))


#: What pymunk can't do is left out in silence.
forgets = change_scene(tangential_restitution=lambda _: 0.0, wall_tangential_restitution=lambda _: 0.0)

honest = build_adapter("honest")
one_friction = build_adapter("one-friction", change_scene(wall_friction=lambda scene: scene.friction))
rough = build_adapter(
    "rough", change_scene(friction=lambda s: 3 * s.friction, wall_friction=lambda s: 3 * s.wall_friction)
)
spheres = build_adapter("spheres", change_discs(inertia_factor=lambda _: 0.4))
clamps = build_adapter("clamps", change_discs(spin_rad_s=lambda disc: min(disc.spin_rad_s, 50.0)))
damps = build_adapter("damps", seen=change_spins(lambda spins, now_s: spins * 0.96**now_s))
clockwise = build_adapter("clockwise", seen=change_spins(lambda spins, _: -spins))
tells_none = build_adapter("tells-none", seen=change_spins(lambda *_: None))
turns_rubs = build_adapter("turns-rubs", seen=scale_friction_impulses(-1.0))
doubles_rubs = build_adapter("doubles-rubs", seen=scale_friction_impulses(2.0))
#: Of a contact that is not head-on it tells nothing: spins change, and nobody knows why.
hides = build_adapter("hides", seen=lambda seen, now_s: seen if now_s < 1.0 else replace(seen, contacts=()))
claims_nothing = build_adapter("claims-nothing", forgets, spin=False, friction=(0.0, 0.0))
claims_limits = build_adapter(
    "claims-limits",
    forgets,
    max_spin_rad_s=10.0,
    friction=(0.01, 5.0),
    min_inertia_factor=0.1,
    tangential_restitution=False,
)
claims_turns = build_adapter("claims-turns", forgets, max_turn_rad=1.0)
