"""Adapter of Carom's own PIC, the predicted instant of collision."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from carom.adapter import (
    AdapterError,
    Capabilities,
    Contact,
    ContactTimes,
    Engine,
    Observation,
    Profile,
    Scene,
    Setting,
    Stamp,
)
from carom.solvers.pic import EventDrivenRun
from carom.solvers.plain.framewise import FramewiseRun
from carom.solvers.units import units_of
from carom.trace import Outcome

if TYPE_CHECKING:
    from carom.adapter import World
    from carom.solvers.falling.run import BallisticRun

__all__ = ["PicAdapter", "adapter"]


class PicWorld:
    """A PIC run, looked at every `dt_s`; how often it is looked at does not change it."""

    def __init__(self, scene: Scene, settings: Mapping[str, Setting]) -> None:
        self.settings = settings
        self._units = units_of(scene)
        self._run = _run(self._units.scene(scene), settings)
        self._dt_s = float(settings["dt_s"])
        self._steps = 0
        self._seen = 0
        self._warning = ""

    def advance(self, steps: int) -> None:
        """Carry out every impact up to the step's end; Algorithm 2 goes there frame by frame."""
        run = self._run
        outcome = Outcome.COMPLETED
        if isinstance(run, FramewiseRun):
            for step in range(self._steps + 1, self._steps + steps + 1):
                outcome = run.advance_frame(self._units.of_seconds(step * self._dt_s))
        else:
            outcome = run.advance_to(self._units.of_seconds((self._steps + steps) * self._dt_s))
        self._steps += steps
        # A disc at rest is no failure: the state stays as it was then, and the harness scores nothing after it.
        if outcome not in {Outcome.COMPLETED, Outcome.AT_REST}:
            self._warning = outcome.value

    def observe(self) -> Observation:
        """Return the state at the last step's end and the impacts since the last look."""
        run, units = self._run, self._units
        new = [units.record(record) for record in run.log.records[self._seen :]]
        self._seen = len(run.log.records)
        contacts = tuple(Contact(r.first, r.second, r.time_s, r.normal, None, r[4:]) for r in new)
        state = units.metres(run.positions()), units.metres_a_second(run.velocities())
        return Observation(*state, contacts, self._warning)

    def close(self) -> None:
        """Nothing to release."""


def _run(scene: Scene, settings: Mapping[str, Setting]) -> EventDrivenRun | FramewiseRun | BallisticRun:
    if scene.gravity_m_s2 != (0.0, 0.0):
        from carom.solvers.falling.run import BallisticRun

        return BallisticRun(scene)
    return FramewiseRun(scene) if settings["form"] == "framewise" else EventDrivenRun(scene)


class PicAdapter:
    """PIC, event-driven (`tuned`) or as the source paper's Algorithm 2 (`default`)."""

    name = "pic"
    engine = Engine("Carom")
    capabilities = Capabilities(
        gravity=True,
        restitution=(0.0, 1.0),
        contact_times=ContactTimes.SOLVED,
        stamp=Stamp.INSTANT,
        continuous_detection=True,
    )
    profiles: Mapping[str, Profile] = {
        "default": Profile(
            "The source paper's Algorithm 2: frame by frame, every pair solved for anew, all impacts of a frame.",
            lambda dt_s: {"dt_s": dt_s, "form": "framewise"},
        ),
        "tuned": Profile(
            "Event-driven: no frames, only the discs of an impact are predicted again.",
            lambda dt_s: {"dt_s": dt_s, "form": "event-driven"},
        ),
    }

    def prepare(self, scene: Scene, settings: Mapping[str, Setting]) -> World:
        """Predict the first impacts.

        Raises:
            AdapterError: There is no such setting.
        """
        for setting in settings:
            if setting not in {"dt_s", "form"}:
                raise AdapterError(f"pic: no setting {setting!r}; there are: dt_s, form")
        return PicWorld(scene, settings)


adapter = PicAdapter()
