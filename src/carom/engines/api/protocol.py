"""What an adapter is made of: what it declares, the worlds that it prepares, and what these report."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import TYPE_CHECKING, Protocol, runtime_checkable

from carom.errors import InputError
from carom.model.scene import Scene
from carom.model.trace import Setting

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

Vector = tuple[float, float]


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
        oldest: Oldest release that the adapter drives as it says, as "5.7": one that is older is unavailable. Empty
            where none is known to fail.
        newest_tried: Newest release that the adapter was run on. A newer one is run, and said to be untried. Empty
            where nobody has noted it.
    """

    name: str
    module: str = ""
    distribution: str = ""
    install: str = ""
    no_wheel_from: tuple[int, int] | None = None
    oldest: str = ""
    newest_tried: str = ""


@dataclass(frozen=True)
class Capabilities:
    """What an engine can do, declared. The harness skips on this alone, and says so.

    Attributes:
        walls: Half-plane walls.
        segments: Walls of straight edges, from both sides.
        arcs: Walls of arcs and circles, from both sides.
        posts: Circles, from outside; who has arcs need not say so.
        wall_materials: Whether walls can have a restitution and friction of their own.
        immovable_discs: Discs of infinite mass.
        driven_walls: Walls that move at a velocity of their own.
        driven_discs: Discs of infinite mass that move and spin.
        legs: Whether the velocity of a driven body can change at given instants.
        belts: Whether the surface of a wall can run.
        edge_belts: Whether that of edges and circles can, too, to the left of the normal on either side.
        gravity: Uniform gravity.
        damping: Linear damping of velocities and spins, by the scene's law.
        rolling_resistance: Rolling resistance between discs and walls, by the scene's law: `docs/theory/contact.md`.
        table_friction: A table that slows discs down by one deceleration until they stop.
        restitution: Least and greatest coefficient of restitution that is simulated as asked for.
        restitution_combine: Which coefficients of discs and of walls come out as asked for in one scene: a rule of
            `carom.engines.api.checks.COMBINE_RULES`; "pair" for any.
        restitution_threshold_m_s: Contacts that close at no more than this are made inelastic.
        spin: Whether discs turn, as fast at the start and as hard to turn as the scene says.
        min_inertia_factor: Least inertia factor of a disc that can turn.
        friction: Least and greatest coefficient of Coulomb friction that is simulated as asked for; 0 always is.
        friction_combine: The same of friction.
        tangential_restitution: Whether friction can give slip back as asked for.
        max_turn_rad: Greatest angle by which a disc turns in one step, whatever its spin.
        max_spin_rad_s: Greatest spin that is simulated as asked for.
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
        float_bits: Width of the engine's floating-point numbers, 32 or 64; narrower ones are held to 32.
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
    spin: bool = False
    min_inertia_factor: float = 0.0
    friction: tuple[float, float] = (0.0, 0.0)
    friction_combine: str = "pair"
    tangential_restitution: bool = False
    max_turn_rad: float = math.inf
    max_spin_rad_s: float = math.inf
    segments: bool = False
    arcs: bool = False
    wall_materials: bool = False
    damping: bool = False
    rolling_resistance: bool = False
    table_friction: bool = False
    driven_walls: bool = False
    driven_discs: bool = False
    posts: bool = False
    legs: bool = False
    belts: bool = False
    edge_belts: bool = False


@dataclass(frozen=True)
class Accuracy:
    """What a profile owns up to, beyond what checking once per step costs PIT; the conformance suite holds it to that.

    The default is the promise of a method without an error of its own.

    Attributes:
        late_steps: Most steps by which one impact turns the path later than PIT might at the same step.
        velocity: Greatest error of a velocity after an impact beyond PIT's at the same step, over the scene's greatest
            speed.
        energy: Greatest part of the kinetic energy that elastic impacts gain or lose; what is below a millionth never
            counts.
        margin_m: Greatest gap at which bodies are answered as if they touched, metres: that of speculative contacts.
            What it allows is what bodies show that are thicker by it: `carom.conformance.contact_margin`.
    """

    late_steps: float = 0.0
    velocity: float = 0.0
    energy: float = 0.0
    margin_m: float = 0.0


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
        changed: Of a profile that stands for the engine as shipped, all that is not left so, by the engine's own name,
            with the reason. What is not named here is as shipped.
    """

    description: str
    settings: Callable[[float], Mapping[str, Setting]]
    accuracy: Accuracy = Accuracy()
    located: bool = False
    capabilities: Capabilities | None = None
    changed: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Knob:
    """A setting that ``carom tune`` may turn, and how far: between two values, or among some.

    Attributes:
        low: Its least value; of a setting that is a whole number, one.
        high: Its greatest value, of the same kind.
        log: Whether the values between are spread by their ratios; `low` must be above 0 then.
        choices: The values that it may take, instead of a least and a greatest.

    Raises:
        InputError: There is neither a range nor a choice, or both, or the range is empty or not finite.
    """

    low: int | float | None = None
    high: int | float | None = None
    log: bool = False
    choices: tuple[Setting, ...] = ()

    def __post_init__(self) -> None:
        if self.choices:
            if self.low is not None or self.high is not None:
                raise InputError(f"a knob has either choices or low and high, this one has both: {self}")
            return
        low, high = self.low, self.high
        if low is None or high is None or type(low) is not type(high) or not -math.inf < low < high < math.inf:
            raise InputError(f"a knob needs choices, or low below high, both whole or both not, got {low} and {high}")
        if self.log and not low > 0:
            raise InputError(f"low of a knob with a logarithmic scale must be above 0, got {low}")

    @property
    def example(self) -> Setting:
        """A value that it may take, of the kind that the setting is."""
        return self.choices[0] if self.low is None else self.low


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
        tangential_impulse_n_s: Impulse of friction along the normal turned by +90 degrees, newton seconds, on `second`;
            `first` receives the opposite. So it is the same number whichever of the two comes first. None where the
            engine does not tell.
        spins_rad_s: Spins of the two bodies, in the order of `velocities` and with them; 0 of a wall. None where no
            disc turns.
    """

    first: int
    second: int
    time_s: float
    normal: Vector
    impulse_n_s: float | None = None
    velocities: tuple[Vector, Vector, Vector, Vector] | None = None
    tangential_impulse_n_s: float | None = None
    spins_rad_s: tuple[float, float, float, float] | None = None


@dataclass(frozen=True, slots=True)
class Observation:
    """State of a world after its last step, and the contacts of that step.

    Attributes:
        position_m: Centres, shape ``(n, 2)``, metres.
        velocity_m_s: Velocities, shape ``(n, 2)``, metres a second.
        contacts: Contacts of the last step.
        warning: What the engine's own warning counters say; not empty means that the state is not to be trusted.
        spin_rad_s: Spins, counterclockwise, shape ``(n,)``, radians a second; None from an adapter that knows nothing
            of them, and where no disc turns.
    """

    position_m: NDArray[np.float64]
    velocity_m_s: NDArray[np.float64]
    contacts: tuple[Contact, ...] = ()
    warning: str = ""
    spin_rad_s: NDArray[np.float64] | None = None


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
class TimedWorld(World, Protocol):
    """A world that measures its own steps, where the way to it is no part of what the engine costs."""

    @property
    def seconds(self) -> float:
        """Seconds that all steps have taken so far, by a monotonic clock."""


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


@runtime_checkable
class CodedAdapter(Adapter, Protocol):
    """An adapter that writes a world as code of the engine's own, to be pasted: ``carom engines NAME --show``."""

    def code(self, scene: Scene, settings: Mapping[str, Setting], heading: str) -> str:
        """Return a program, or a model, that gives the digits of the world that `prepare` makes, without Carom.

        Nothing of the engine is imported for it. A program takes the steps that cover the scene, and prints each disc
        at their end, a line of ``x y vx vy spin``.

        Args:
            scene: The scene.
            settings: As for `prepare`; a profile that is ``located`` has no code, since its steps are cut.
            heading: What to say first, as a comment.

        Raises:
            AdapterError: The scene or a setting is outside what the engine can do.
        """


@dataclass(frozen=True)
class Imported:
    """A scene that was made of an engine's own file.

    Attributes:
        scene: The scene, in the units of the file.
        dropped: What of the file the scene has no place for, each in a few words; not empty where anything is lost.
    """

    scene: Scene
    dropped: tuple[str, ...] = ()


@runtime_checkable
class ReadingAdapter(Adapter, Protocol):
    """An adapter that reads files of its engine as scenes: ``carom import``."""

    def read(self, content: bytes, name: str, duration_s: float) -> Imported:
        """Return what a file holds as a scene, and all that is lost by that. Called in a worker process.

        Args:
            content: What the file holds. It may come from anybody: nothing of it may be run.
            name: What to call the scene.
            duration_s: How long the scene is, seconds; a file of an engine says no such thing.

        Raises:
            AdapterError: It is no such file, or asks for what must not be run; the message names it.
            SceneError: What is left is no scene.
        """
