"""THE SEAM: all of Carom that the author of an engine adapter imports.

An adapter is any object with the attributes of `Adapter`; no base class is needed. Register it under the entry-point
group ``carom.adapters`` and the harness finds it. The harness drives the world that `prepare` returns: it measures,
joins the steps of one contact into one impact, derives the effective times, and skips scenes by what `capabilities`
declares.
``docs/adapters.md`` builds one in forty lines.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from typing import TYPE_CHECKING, Protocol, runtime_checkable

from carom.errors import AdapterError
from carom.scene import Disc, Need, Scene, Wall
from carom.trace import Setting, wall_body

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

__all__ = [
    "Accuracy",
    "Adapter",
    "AdapterError",
    "Capabilities",
    "Contact",
    "ContactTimes",
    "CuttableWorld",
    "Disc",
    "Engine",
    "Need",
    "Observation",
    "Profile",
    "Scene",
    "Setting",
    "Stamp",
    "Wall",
    "World",
    "require_sound",
    "require_supported",
    "unsupported_reason",
    "wall_body",
]

Vector = tuple[float, float]

#: The engines count steps in a C int.
MAX_STEPS = 2**31 - 1

#: Bits of a float after the leading one, by its width (IEEE 754).
MANTISSA_BITS = {16: 10, 32: 23, 64: 52}


class ContactTimes(Enum):
    """What the time that an engine gives a contact means; the value is the sentence shown."""

    SOLVED = "solved for within the step"
    STEP = "reported to the step"
    INFERRED = "inferred by the adapter"
    NONE = "not reported"


class Stamp(Enum):
    """Which instant of its step an engine's contact time is; the value is the sentence shown."""

    START = "the start of the step in which the engine answered the contact"
    END = "the end of the step in which the engine answered the contact"
    INSTANT = "the instant of the contact itself"


@dataclass(frozen=True)
class Engine:
    """Which engine an adapter drives, known without importing it.

    Attributes:
        name: What people call the engine.
        module: Module to import; empty for a method that needs no installation of its own.
        distribution: Distribution whose version counts.
        install: The command that installs it, shown where it is missing.
        no_wheel_from: First CPython version for which the engine publishes no wheel, if any.
    """

    name: str
    module: str = ""
    distribution: str = ""
    install: str = ""
    no_wheel_from: tuple[int, int] | None = None


@dataclass(frozen=True)
class Capabilities:
    """What an engine can do, declared. The harness skips on this alone, and says so.

    Attributes:
        walls: Half-plane walls.
        immovable_discs: Discs of infinite mass.
        gravity: Uniform gravity.
        restitution: Least and greatest coefficient of restitution that is simulated as asked for.
        restitution_combine: How the engine combines two bodies' coefficients: "product", "maximum", "pair", "none".
        restitution_threshold_m_s: Contacts that close at no more than this are made inelastic.
        contact_times: What a reported contact time means.
        stamp: Which instant of a step it is.
        continuous_detection: Whether a body can be kept from tunnelling through another within one step.
        max_speed_m_s: Greatest speed that is simulated as asked for.
        max_coordinate_m: Greatest distance from the origin that is simulated.
        max_move_m: Greatest distance that a body moves in one step, whatever its velocity.
        min_radius_m: Least radius of a disc that is simulated.
        max_radius_m: Greatest radius of a disc that is simulated.
        min_mass_kg: Least mass of a disc that is simulated.
        max_mass_kg: Greatest mass of a movable disc that is simulated.
        float_bits: Width of the engine's floating-point numbers.
        dimensions: 2, or 3 where discs are bodies in space, held or not held in a plane.
        deterministic: Whether two runs in one process are identical to the bit.
    """

    walls: bool = True
    immovable_discs: bool = True
    gravity: bool = False
    restitution: tuple[float, float] = (1.0, 1.0)
    restitution_combine: str = "pair"
    restitution_threshold_m_s: float = 0.0
    contact_times: ContactTimes = ContactTimes.STEP
    stamp: Stamp = Stamp.START
    continuous_detection: bool = False
    max_speed_m_s: float = math.inf
    max_coordinate_m: float = math.inf
    max_move_m: float = math.inf
    min_radius_m: float = 0.0
    max_radius_m: float = math.inf
    min_mass_kg: float = 0.0
    max_mass_kg: float = math.inf
    float_bits: int = 64
    dimensions: int = 2
    deterministic: bool = True


@dataclass(frozen=True)
class Accuracy:
    """What a profile owns up to, beyond what PIT pays for looking once a step; the conformance suite holds it to that.

    The default is the promise of a method without an error of its own.

    Attributes:
        late_steps: Most steps by which one impact turns the path later than PIT might at the same step.
        velocity: Greatest error of a velocity after an impact beyond PIT's at the same step, over the scene's greatest
            speed.
        energy: Greatest part of the kinetic energy that elastic impacts gain or lose; what is below a millionth never
            counts.
    """

    late_steps: float = 0.0
    velocity: float = 0.0
    energy: float = 0.0


@dataclass(frozen=True)
class Profile:
    """A named, attributed set of engine settings, a function of the step.

    Attributes:
        description: One sentence: what this profile stands for, and where its settings come from.
        settings: Takes the step in seconds, gives every setting by name; ``dt_s`` is among them.
        accuracy: What results with these settings are promised to be no worse than.
        located: Whether the harness cuts the steps so that they end where bodies begin to touch; `prepare` must then
            return a `CuttableWorld`.
        capabilities: What the engine can do with these settings, where that is not what the adapter declares.
    """

    description: str
    settings: Callable[[float], Mapping[str, Setting]]
    accuracy: Accuracy = Accuracy()
    located: bool = False
    capabilities: Capabilities | None = None


@dataclass(frozen=True, slots=True)
class Contact:
    """One contact that an engine reports for its last step.

    Attributes:
        first: The disc.
        second: The other disc, of a higher number, or a wall, ``wall_body(k)``.
        time_s: The time that the engine gives the contact, seconds from the start.
        normal: Unit vector from first to second.
        impulse_n_s: Impulse along the normal, newton seconds, 0 for a contact that did nothing; None where the engine
            does not tell.
        velocities: Velocities of first and second just before and just after, ``(first before, second before, first
            after, second after)``, from a method that knows them; such a contact is an impact as it stands. None from
            an engine: the harness then reads the velocities from the states around the contact.
    """

    first: int
    second: int
    time_s: float
    normal: Vector
    impulse_n_s: float | None = None
    velocities: tuple[Vector, Vector, Vector, Vector] | None = None


@dataclass(frozen=True, slots=True)
class Observation:
    """State of a world after its last step, and the contacts of that step.

    Attributes:
        position_m: Centres, shape ``(n, 2)``, metres.
        velocity_m_s: Velocities, shape ``(n, 2)``, metres a second.
        contacts: Contacts of the last step.
        warning: What the engine's own warning counters say; not empty means that the state is not to be trusted.
    """

    position_m: NDArray[np.float64]
    velocity_m_s: NDArray[np.float64]
    contacts: tuple[Contact, ...] = ()
    warning: str = ""


class World(Protocol):
    """One scene, built in one engine, at time 0."""

    @property
    def settings(self) -> Mapping[str, Setting]:
        """The settings really used, read back from the engine where it can be read."""

    def advance(self, steps: int) -> None:
        """Take `steps` steps. This is the timed path: as near to the engine's own loop as its interface allows."""

    def observe(self) -> Observation:
        """Return the present state and the contacts of the last step. Never timed."""

    def close(self) -> None:
        """Release what the engine holds. Called once, also after an error."""


@runtime_checkable
class CuttableWorld(World, Protocol):
    """A world whose steps can be cut and taken back, for a profile that is ``located``."""

    def cut(self, dt_s: float) -> None:
        """Make the coming steps `dt_s` seconds long; contacts keep carrying the time from the start."""

    def touching(self) -> frozenset[tuple[int, int]]:
        """Return the pairs of bodies that the engine's own contact test finds in contact now, numbered as in `Contact`.

        Called after `advance`; neither the state nor the contacts that `observe` returns may change by it.
        """

    def save(self) -> object:
        """Return whatever `restore` needs to come back to the present state and time."""

    def restore(self, state: object) -> None:
        """Come back to a state that `save` returned."""


@runtime_checkable
class Adapter(Protocol):
    """What the harness needs to know of an engine. Reading these attributes must not import the engine."""

    @property
    def name(self) -> str:
        """Short name, the one given to ``--engine``."""

    @property
    def engine(self) -> Engine:
        """The engine behind the adapter."""

    @property
    def capabilities(self) -> Capabilities:
        """What the engine can do."""

    @property
    def profiles(self) -> Mapping[str, Profile]:
        """Profiles by name; ``default`` and ``tuned`` at least."""

    def prepare(self, scene: Scene, settings: Mapping[str, Setting]) -> World:
        """Build the scene with settings of one of the profiles. Timed on its own, not by the step clock."""


def require_sound(
    engine: str,
    scene: Scene,
    settings: Mapping[str, Setting],
    known: Sequence[str],
    at_least: Mapping[str, float] | None = None,
) -> None:
    """Refuse what no engine should see: numbers that no validated scene has, and settings that there aren't.

    Engines abort on such numbers, or silently make something else of them, and a scene can have been made without its
    validation. What is beyond an engine's own limits is for `require_supported`, and the adapter, to refuse.

    Args:
        engine: What the message calls the engine.
        scene: The scene.
        settings: The settings asked for.
        known: Names of all settings but ``dt_s``.
        at_least: Least values of settings that have one.

    Raises:
        AdapterError: Names the field or setting, and its value.
    """
    for name, setting in settings.items():
        if name not in ("dt_s", *known):
            raise AdapterError(f"{engine}: no setting {name!r}; there are: {', '.join(('dt_s', *known))}")
        if setting != setting:
            raise AdapterError(f"{engine}: {name} must be a number, got {setting}")
        if not isinstance(setting, str) and at_least and not setting >= at_least.get(name, -math.inf):
            raise AdapterError(f"{engine}: {name} must be at least {at_least[name]:g}, got {setting}")
    dt_s = settings["dt_s"]
    if isinstance(dt_s, str) or not 0 < dt_s < math.inf:
        raise AdapterError(f"{engine}: dt_s must be above 0 and finite, got {dt_s}")
    for i, disc in enumerate(scene.discs):
        for field, value, sound in (
            ("position_m", disc.position_m, all(map(math.isfinite, disc.position_m))),
            ("velocity_m_s", disc.velocity_m_s, all(map(math.isfinite, disc.velocity_m_s))),
            ("radius_m", disc.radius_m, 0 < disc.radius_m < math.inf),
            ("mass_kg", disc.mass_kg, disc.mass_kg > 0),
        ):
            if not sound:
                raise AdapterError(f"{engine}: discs[{i}].{field} is {value}, which no disc has")
    for field, value in (("restitution", scene.restitution), ("wall_restitution", scene.wall_restitution)):
        if not 0 <= value <= 1:
            raise AdapterError(f"{engine}: {field} must lie in 0 to 1, got {value}")
    if not all(map(math.isfinite, scene.gravity_m_s2)):
        raise AdapterError(f"{engine}: gravity_m_s2 must be finite, got {scene.gravity_m_s2}")


def unsupported_reason(scene: Scene, capabilities: Capabilities, dt_s: float) -> str:
    """Return why a method that declares these capabilities can't run the scene; empty where it can."""
    needs = scene.needs
    for need, supported in (
        (Need.WALLS, capabilities.walls),
        (Need.IMMOVABLE, capabilities.immovable_discs),
        (Need.GRAVITY, capabilities.gravity),
    ):
        if need in needs and not supported:
            suffix = " yet: gravity_m_s2 must be [0, 0]" if need is Need.GRAVITY else ""
            return f"the scene has {need.value}, which this method does not support{suffix}"
    low, high = capabilities.restitution
    used = [("restitution", scene.restitution)] if len(scene.discs) > 1 else []
    used += [("wall_restitution", scene.wall_restitution)] if scene.walls else []
    for name, value in used:
        if not low <= value <= high:
            return f"{name} is {value}, and this method simulates {low:g} to {high:g} as asked for"
    fastest = max(math.hypot(*disc.velocity_m_s) for disc in scene.discs)
    if fastest > capabilities.max_speed_m_s:
        return f"a disc moves at {fastest:g} m/s, and this method's limit is {capabilities.max_speed_m_s:g} m/s"
    speeds = sorted((math.hypot(*disc.velocity_m_s) for disc in scene.discs), reverse=True)
    closing, threshold = sum(speeds[:2]), capabilities.restitution_threshold_m_s
    if 0 < closing <= threshold and any(value > 0 for _, value in used):
        slow = f"no two bodies close at more than {closing:g} m/s"
        return f"{slow}, and this method makes contacts of up to {threshold:g} m/s inelastic"
    if fastest * dt_s > capabilities.max_move_m:
        moved = f"a disc at {fastest:g} m/s moves {fastest * dt_s:g} m in a step of {dt_s:g} s"
        return f"{moved}, and this method moves none by more than {capabilities.max_move_m:g} m"
    for name, disc in ((f"discs[{i}].radius_m", disc) for i, disc in enumerate(scene.discs)):
        if not capabilities.min_radius_m <= disc.radius_m <= capabilities.max_radius_m:
            limits = f"{capabilities.min_radius_m:g} to {capabilities.max_radius_m:g} m"
            return f"{name} is {disc.radius_m:g}, and this method simulates {limits}"
    for name, disc in ((f"discs[{i}].mass_kg", disc) for i, disc in enumerate(scene.discs)):
        if not (disc.immovable or capabilities.min_mass_kg <= disc.mass_kg <= capabilities.max_mass_kg):
            limits = f"{capabilities.min_mass_kg:g} to {capabilities.max_mass_kg:g} kg, or an immovable disc"
            return f"{name} is {disc.mass_kg:g}, and this method simulates {limits}"
    farthest = max(max(abs(c) for c in disc.position_m) + disc.radius_m for disc in scene.discs)
    if farthest > capabilities.max_coordinate_m:
        return f"a disc reaches to {farthest:g} m, and this method's limit is {capabilities.max_coordinate_m:g} m"
    # Where positions are rounded by more than a disc is large, there is no telling where it is.
    rounding, smallest = farthest * 2.0 ** -MANTISSA_BITS[capabilities.float_bits], min(d.radius_m for d in scene.discs)
    if rounding > smallest:
        floats = f"{capabilities.float_bits}-bit floats"
        return (
            f"a disc reaches to {farthest:g} m, where {floats} round by more than the smallest radius, {smallest:g} m"
        )
    if scene.duration_s / dt_s > MAX_STEPS:
        return f"{scene.duration_s:g} s in steps of {dt_s:g} s are more steps than an engine can count"
    return ""


def require_supported(engine: str, scene: Scene, capabilities: Capabilities, dt_s: float) -> None:
    """Refuse a scene that the declared capabilities exclude, in the words in which the harness skips it.

    One limit is left to the harness: below which closing speed contacts are inelastic belongs to a profile, and
    `prepare` is given settings.

    Args:
        engine: What the message calls the engine.
        scene: The scene, sound as `require_sound` has it.
        capabilities: What the adapter declares.
        dt_s: Step, seconds.

    Raises:
        AdapterError: With the capability as the reason.
    """
    if reason := unsupported_reason(scene, replace(capabilities, restitution_threshold_m_s=0.0), dt_s):
        raise AdapterError(f"{engine}: {reason}")
