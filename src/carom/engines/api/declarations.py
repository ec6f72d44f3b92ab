"""Declarations of an adapter: its engine, capabilities, profiles and settings."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import Enum

from carom.errors import InputError
from carom.model.trace import Setting


class ContactTimes(Enum):
    """How precise the time of a reported contact is. Each member's value is a phrase for display."""

    SOLVED = "solved for within the step"
    STEP = "reported to the step"
    INFERRED = "inferred by the adapter"
    NONE = "not reported"


class Stamp(Enum):
    """Which instant of a step an engine reports as a contact's time. Each member's value is a phrase for display."""

    START = "the start of the step in which the engine resolved the contact"
    END = "the end of the step in which the engine resolved the contact"
    INSTANT = "the instant of the contact itself"


@dataclass(frozen=True)
class Engine:
    """Description of the engine that an adapter connects to Carom. The engine is not imported for this description.

    Attributes:
        name: Common name of the engine.
        module: Module to import; empty for a method that needs only the adapter.
        distribution: Distribution whose version is reported.
        install: Command that installs the engine, shown if the engine is missing.
        no_wheel_from: First CPython version for which the engine publishes no wheel; empty if there is none.
        oldest: Oldest release that the adapter supports, such as "5.7". An older release counts as unavailable. Empty
            if no release is known to fail.
        newest_tried: Newest release with which the adapter was tested. A newer release is also used, but reported as
            untried. Empty if not known.
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
    """Capabilities that an adapter declares for its engine. Carom skips scenes that need other capabilities.

    Attributes:
        walls: Whether half-plane walls are supported.
        segments: Whether walls can consist of straight edges that discs can hit from both sides.
        arcs: Whether walls can consist of arcs and circles that discs can hit from both sides.
        posts: Whether walls can be circles that discs can hit from outside only. `arcs` implies `posts`.
        wall_materials: Whether each wall can have its own restitution and friction.
        immovable_discs: Whether discs of infinite mass are supported.
        driven_walls: Whether walls can move at a given velocity.
        driven_discs: Whether discs of infinite mass can move and spin at given velocities.
        legs: Whether the velocity of a driven body can change at given instants.
        belts: Whether walls can be conveyors.
        edge_belts: Whether edges and circles can also be conveyors. On both sides, the surface moves to the left for an
            observer who looks from the wall towards the disc.
        gravity: Whether uniform gravity is supported.
        damping: Whether velocities and spins can be damped in proportion to their size (`damping_per_s` of a scene).
        rolling_resistance: Whether rolling resistance between discs and walls is supported; see
            `docs/theory/contact.md`.
        table_friction: Whether a table can slow down all discs at a constant rate until they stop.
        restitution: Smallest and largest coefficient of restitution that is simulated exactly.
        restitution_combine: Rule by which the engine computes a pair's restitution from the restitutions of the two
            bodies; see `carom.engines.api.checks.COMBINE_RULES`. With "pair", each pair has its own restitution.
        restitution_threshold_m_s: Closing speed up to which the engine makes contacts inelastic.
        spin: Whether discs can spin, with the initial spins and moments of inertia of the scene.
        min_inertia_factor: Smallest inertia factor (moment of inertia divided by mass times radius squared) of a disc
            that can turn.
        friction: Smallest and largest coefficient of Coulomb friction that is simulated exactly; 0 is always possible.
        friction_combine: Rule by which the engine computes a pair's friction; see `restitution_combine`.
        tangential_restitution: Whether the scene's tangential restitution is supported.
        max_turn_rad: Largest angle by which the engine turns a disc in one step, even if the disc spins faster.
        max_spin_rad_s: Largest spin that is simulated exactly.
        contact_times: How precise a reported contact time is.
        stamp: Which instant of a step is reported as the contact time.
        continuous_detection: Whether the engine can prevent a body from passing through another body within one step.
        max_speed_m_s: Largest speed that is simulated exactly.
        max_coordinate_m: Largest distance of a disc from the origin that is simulated exactly.
        max_move_m: Largest distance by which the engine moves a body in one step, even if its velocity is larger.
        min_radius_m: Smallest radius of a disc.
        max_radius_m: Largest radius of a disc.
        min_mass_kg: Smallest mass of a disc.
        max_mass_kg: Largest mass of a movable disc.
        float_bits: Width of the engine's floating-point numbers, 32 or 64. Declare 32 also for narrower numbers.
        dimensions: 3 if the engine simulates three-dimensional bodies, even if they stay in a plane; otherwise 2.
        deterministic: Whether two runs of a scene in one process are bit-identical.
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
    """Limits of the errors that a profile may have in addition to PIT's errors.

    The conformance suite tests these limits.

    The defaults are for a method that has only PIT's errors.

    Attributes:
        late_steps: Largest number of steps by which an impact may be later than PIT's impact with the same step size.
        velocity: Largest amount by which a velocity error after an impact may exceed PIT's, as a fraction of the
            scene's largest speed.
        energy: Largest fraction of the kinetic energy that elastic impacts gain or lose. A fraction below a millionth
            is ignored.
        margin_m: Largest distance of two surfaces at which bodies already collide, in metres. The margin is above 0 for
            engines with speculative contacts, which begin before bodies touch. The suite also accepts the results of
            bodies that collide at exactly this distance; see `carom.conformance.contact_margin`.
    """

    late_steps: float = 0.0
    velocity: float = 0.0
    energy: float = 0.0
    margin_m: float = 0.0


@dataclass(frozen=True)
class Profile:
    """A named set of engine settings, as a function of the step size.

    Attributes:
        description: One sentence: the purpose of this profile and the source of its settings.
        settings: Function that returns all settings by name, including ``dt_s``, for a step size in seconds.
        accuracy: Declared accuracy with these settings.
        located: Whether Carom shortens steps so that they end when bodies begin to touch. In this case, `prepare` must
            return a `CuttableWorld`.
        capabilities: Capabilities with these settings, if they differ from the adapter's.
        changed: Reasons why settings of the profile `default` differ from the engine's defaults, by the setting's name
            in the engine.
    """

    description: str
    settings: Callable[[float], Mapping[str, Setting]]
    accuracy: Accuracy = Accuracy()
    located: bool = False
    capabilities: Capabilities | None = None
    changed: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Knob:
    """Values of a setting that ``carom tune`` may try: a range or a list of choices.

    Attributes:
        low: Smallest value; a whole number if the setting is a whole number.
        high: Largest value, of the same type.
        log: Whether values are sampled on a logarithmic scale; `low` must then be above 0.
        choices: The possible values, if there is no range.

    Raises:
        InputError: A range and choices are both given or both missing, or the range is empty or not finite.
    """

    low: int | float | None = None
    high: int | float | None = None
    log: bool = False
    choices: tuple[Setting, ...] = ()

    def __post_init__(self) -> None:
        if self.choices:
            if self.low is not None or self.high is not None:
                raise InputError(f"a Knob must have either choices or low and high, but this Knob has both: {self}")
            return
        low, high = self.low, self.high
        if low is None or high is None or type(low) is not type(high) or not -math.inf < low < high < math.inf:
            raise InputError(f"a Knob needs choices, or low < high of the same type, got low={low} and high={high}")
        if self.log and not low > 0:
            raise InputError(f"low of a Knob with a logarithmic scale must be above 0, got {low}")

    @property
    def example(self) -> Setting:
        """One of the possible values."""
        return self.choices[0] if self.low is None else self.low
