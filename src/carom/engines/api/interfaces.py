"""Types of the adapter interface: adapters, the worlds that they build in engines, and the observed states."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from carom.engines.api.declarations import Capabilities, Engine, Profile
from carom.model.scene import Scene
from carom.model.trace import Setting

Vector = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Contact:
    """One contact that an engine reports for its last step.

    Attributes:
        first: The disc.
        second: The other disc, with a higher number, or a wall, ``wall_body(k)``.
        time_s: Time of the contact as reported by the engine, in seconds from the start.
        normal: Unit vector from first to second.
        impulse_n_s: Impulse along the normal, in newton seconds; 0 for a contact without effect, None if the engine
            reports no impulse.
        velocities: Velocities just before and after the contact, ``(first before, second before, first after, second
            after)``. If `velocities` is not None, the contact becomes one impact with these velocities. If None, Carom
            uses the velocities of the states before and after the contact.
        tangential_impulse_n_s: Impulse of friction on `second`, in newton seconds, along the normal turned by +90
            degrees. `first` receives the opposite impulse. The sign stays the same if the bodies are exchanged. None if
            the engine reports no impulse of friction.
        spins_rad_s: Spins of the two bodies, in the order of `velocities`; 0 for a wall. None if no disc turns.
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
        position_m: Centres, shape ``(n, 2)``, in metres.
        velocity_m_s: Velocities, shape ``(n, 2)``, in metres per second.
        contacts: Contacts of the last step.
        warning: Warnings of the engine; empty if there is none. A state with a warning is not reliable.
        spin_rad_s: Spins, counterclockwise, shape ``(n,)``, in radians per second; None if the adapter has no spins, or
            no disc turns.
    """

    position_m: NDArray[np.float64]
    velocity_m_s: NDArray[np.float64]
    contacts: tuple[Contact, ...] = ()
    warning: str = ""
    spin_rad_s: NDArray[np.float64] | None = None


class World(Protocol):
    """A scene that an adapter has built in an engine. A new world is at time 0."""

    @property
    def settings(self) -> Mapping[str, Setting]:
        """The settings in use, read back from the engine if possible."""

    def advance(self, steps: int) -> None:
        """Take `steps` steps.

        Carom measures the run time of this call, so the adapter should do little except the engine's steps.
        """

    def observe(self) -> Observation:
        """Return the present state and the contacts of the last step. The call is not timed."""

    def close(self) -> None:
        """Release the engine's resources. Carom calls this method once, also after an error."""


@runtime_checkable
class TimedWorld(World, Protocol):
    """A world that measures the run time of its own steps, so that communication with a program does not count."""

    @property
    def seconds(self) -> float:
        """Total seconds of all steps so far, by a monotonic clock."""


@runtime_checkable
class QuietWorld(World, Protocol):
    """A world that can take many steps in one call while nothing touches. This optional interface saves run time."""

    def take_quiet_steps(
        self, position_m: NDArray[np.float64], velocity_m_s: NDArray[np.float64], spin_rad_s: NDArray[np.float64]
    ) -> int:
        """Take steps until a step has contacts or a warning. Return the number of steps taken.

        For n discs and at most k steps, the arrays have the shapes ``(k, n, 2)``, ``(k, n, 2)`` and ``(k, n)``. The
        state after each step is written to one row of each array. After the call, `observe` returns the state and
        contacts of the last step. Carom calls `observe` once before the first call.
        """


@runtime_checkable
class CuttableWorld(World, Protocol):
    """A world whose steps can be shortened and undone, as profiles with ``located`` require."""

    def cut(self, dt_s: float) -> None:
        """Set the size of the next steps, in seconds. Contact times are still measured from the start of the run."""

    def touching(self) -> frozenset[tuple[int, int]]:
        """Return the pairs of bodies that touch at this time, according to the engine's own contact test.

        Bodies are numbered as in `Contact`.

        Carom calls this method after `advance`. The call must not change the state or the contacts that `observe`
        returns.
        """

    def save(self) -> object:
        """Return the present state and time in a form that `restore` accepts."""

    def restore(self, state: object) -> None:
        """Return to a state that `save` returned."""


@runtime_checkable
class Adapter(Protocol):
    """Connects an engine to Carom. Reading the attributes must not import the engine."""

    @property
    def name(self) -> str:
        """Short name, for ``--engine``."""

    @property
    def engine(self) -> Engine:
        """The engine that the adapter connects to Carom."""

    @property
    def capabilities(self) -> Capabilities:
        """Capabilities of the engine."""

    @property
    def profiles(self) -> Mapping[str, Profile]:
        """Profiles by name: at least ``default`` and ``tuned``."""

    def prepare(self, scene: Scene, settings: Mapping[str, Setting]) -> World:
        """Build a scene in the engine, with the settings of a profile.

        Carom measures the time of this call separately.
        """


@runtime_checkable
class CodedAdapter(Adapter, Protocol):
    """An adapter that can write a scene as a program for its engine, for ``carom engines NAME --show``."""

    def code(self, scene: Scene, settings: Mapping[str, Setting], heading: str) -> str:
        """Return a program or a model file that computes exactly what the world from `prepare` computes.

        This method must not import the engine, and the program must not import Carom. The program takes the steps of
        the scene, and then prints one line ``x y vx vy spin`` for each disc.

        Args:
            scene: The scene.
            settings: The settings, as for `prepare`. Carom does not call this method for profiles with ``located``.
            heading: Text for the first comment of the code.

        Raises:
            AdapterError: The engine does not support the scene or a setting.
        """


@dataclass(frozen=True)
class Imported:
    """A scene that was read from a file of an engine.

    Attributes:
        scene: The scene, in the units of the file.
        dropped: Short descriptions of all parts of the file that scenes do not support; empty if there are none.
    """

    scene: Scene
    dropped: tuple[str, ...] = ()


@runtime_checkable
class ReadingAdapter(Adapter, Protocol):
    """An adapter that can read files of its engine as scenes, for ``carom import``."""

    def read(self, content: bytes, name: str, duration_s: float) -> Imported:
        """Read a file as a scene, and list the parts of the file that a scene cannot contain.

        Carom calls this method in a worker process.

        Args:
            content: Content of the file. The content is not trusted: no part of it may be executed.
            name: Name of the scene.
            duration_s: Duration of the scene, in seconds, because files of engines do not contain a duration.

        Raises:
            AdapterError: The file has another format, or contains something that must not be executed.
            SceneError: The supported part of the file is not a valid scene.
        """
