"""A broken twin: the penalty engine with one false statement each. The conformance suite must find every one."""

import dataclasses
import math
import random

import numpy as np
from carom_penalty import PenaltyAdapter, PenaltyWorld

from carom.engines.api import Profile


class TurnsWrong(PenaltyWorld):
    """Leaves an impact in a direction that is 30 degrees off."""

    def advance(self, steps):
        for _ in range(steps):
            touched = {contact.first for contact in self.contacts}
            super().advance(1)
            for disc in touched - {contact.first for contact in self.contacts}:
                turn = math.radians(30)
                x, y = self.velocity[disc]
                self.velocity[disc] = (x * math.cos(turn) - y * math.sin(turn), x * math.sin(turn) + y * math.cos(turn))


class StampsEarly(PenaltyWorld):
    """Dates its contacts back by a tenth of a second, so as to look like an engine that predicts."""

    def observe(self):
        seen = super().observe()
        early = (dataclasses.replace(contact, time_s=contact.time_s - 0.1) for contact in seen.contacts)
        return dataclasses.replace(seen, contacts=tuple(early))


class Guesses(PenaltyWorld):
    """Starts each run a little differently."""

    def __init__(self, scene, settings):
        super().__init__(scene, settings)
        self.velocity += 1e-9 * np.array([[random.random(), random.random()] for _ in scene.discs])


class Rounds(PenaltyWorld):
    """Uses another stiffness than it was asked for, and says so."""

    def __init__(self, scene, settings):
        super().__init__(scene, {**settings, "contact_steps": 3})


class Talks(PenaltyWorld):
    """Prints."""

    def advance(self, steps):
        print("step", self.steps)  # noqa: T201 - what is wrong with it
        super().advance(steps)


class Aborts(PenaltyWorld):
    """Takes its process with it."""

    def advance(self, steps):  # noqa: ARG002 - the seam's
        import os

        os.abort()


class Shortens(PenaltyWorld):
    """Moves no disc by more than 2 m in a step, and leaves its velocity as it is."""

    def advance(self, steps):
        for _ in range(steps):
            before = self.position.copy()
            super().advance(1)
            self.position = before + np.clip(self.position - before, -2, 2)


class Keeps(PenaltyWorld):
    """Keeps twelve thousand bytes of each world for ever."""

    kept = []

    def close(self):
        self.kept.append(bytearray(12_000))
        super().close()


class Twin(PenaltyAdapter):
    def __init__(self, name, world=PenaltyWorld, **capabilities):
        self.name, self.world = name, world
        self.capabilities = dataclasses.replace(PenaltyAdapter.capabilities, **capabilities)

    def prepare(self, scene, settings):
        # Nothing is refused: what this engine does not know, it leaves out in silence.
        return self.world(scene, {name: settings[name] for name in ("dt_s", "contact_steps")})


class Promises(Twin):
    """Owns up to no error of its own."""

    profiles = {
        name: Profile(profile.description, profile.settings) for name, profile in PenaltyAdapter.profiles.items()
    }


class Cuts(Twin):
    """Has a profile whose steps are cut, and a world that can't be cut."""

    profiles = {
        **PenaltyAdapter.profiles,
        "located": dataclasses.replace(PenaltyAdapter.profiles["tuned"], located=True),
    }


turns_wrong = Twin("turns-wrong", TurnsWrong)
stamps_early = Twin("stamps-early", StampsEarly)
guesses = Twin("guesses", Guesses)
rounds = Twin("rounds", Rounds)
talks = Twin("talks", Talks)
aborts = Twin("aborts", Aborts)
keeps_worlds = Twin("keeps-worlds", Keeps)
claims_walls = Twin("claims-walls", walls=True)
claims_sweeping = Twin("claims-sweeping", continuous_detection=True)
claims_precision = Promises("claims-precision")
claims_limits = Twin("claims-limits", min_radius_m=1e-3, max_radius_m=1e3, max_move_m=1e2)
shortens = Twin("shortens", Shortens)
claims_cutting = Cuts("claims-cutting")
