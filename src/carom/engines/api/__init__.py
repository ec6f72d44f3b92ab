"""Adapter interface: everything that the author of an engine adapter imports from Carom.

An adapter connects an engine to Carom. An adapter is any object with the attributes of `Adapter`; no base class is
needed. Carom finds an adapter by its entry point in the group ``carom.adapters``. For each scene that `capabilities`
allows, Carom calls `prepare`, which builds the scene in the engine and returns it as a `World`. Carom then takes steps,
reads the states, joins a contact of several steps into one impact, and computes the impact's time.
``docs/reference/adapters.md`` shows how to write an adapter in about 45 lines.
"""

from carom.engines.api.checks import require_sound, require_supported, unsupported_reason
from carom.engines.api.declarations import Accuracy, Capabilities, ContactTimes, Engine, Knob, Profile, Stamp
from carom.engines.api.helpers import (
    StepClock,
    factored_frictions,
    factored_restitutions,
    flattened,
    is_fast,
    oriented_contact,
    pair_of,
    reach,
)
from carom.engines.api.interfaces import (
    Adapter,
    CodedAdapter,
    Contact,
    CuttableWorld,
    Imported,
    Observation,
    QuietWorld,
    ReadingAdapter,
    TimedWorld,
    World,
)
from carom.engines.api.reading import one_coefficient, wall_towards
from carom.engines.api.units import scaled, unscaled
from carom.errors import AdapterError
from carom.model.scene import Disc, Need, Scene, Wall
from carom.model.trace import Setting, wall_body, wall_index
from carom.model.walls import Chain, Ring

__all__ = [
    "Accuracy",
    "Adapter",
    "AdapterError",
    "Capabilities",
    "Chain",
    "CodedAdapter",
    "Contact",
    "ContactTimes",
    "CuttableWorld",
    "Disc",
    "Engine",
    "Imported",
    "Knob",
    "Need",
    "Observation",
    "Profile",
    "QuietWorld",
    "ReadingAdapter",
    "Ring",
    "Scene",
    "Setting",
    "Stamp",
    "StepClock",
    "TimedWorld",
    "Wall",
    "World",
    "factored_frictions",
    "factored_restitutions",
    "flattened",
    "is_fast",
    "one_coefficient",
    "oriented_contact",
    "pair_of",
    "reach",
    "require_sound",
    "require_supported",
    "scaled",
    "unscaled",
    "unsupported_reason",
    "wall_body",
    "wall_index",
    "wall_towards",
]
