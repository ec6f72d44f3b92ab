"""A third-party adapter: a penalty engine (discs that overlap push each other apart like springs), and its adapter."""

import itertools
import math

import numpy as np

from carom.engines.api import Accuracy, AdapterError, Capabilities, Contact, Engine, Need, Observation, Profile


class PenaltyWorld:
    def __init__(self, scene, settings):
        self.settings, self.discs = settings, scene.discs
        self.position = np.array([disc.position_m for disc in scene.discs])
        self.velocity = np.array([disc.velocity_m_s for disc in scene.discs])
        self.steps, self.contacts = 0, []

    def advance(self, steps):
        dt, contact_steps = self.settings["dt_s"], self.settings["contact_steps"]
        # With this frequency, semi-implicit Euler turns a spring by half a period in a whole number of steps.
        frequency = 2 * math.sin(math.pi / (2 * contact_steps)) / dt
        for _ in range(steps):
            self.contacts = []
            for (i, first), (j, second) in itertools.combinations(enumerate(self.discs), 2):
                line = self.position[j] - self.position[i]
                overlap = first.radius_m + second.radius_m - math.hypot(*line)
                if overlap > 0 and not (first.immovable and second.immovable):
                    impulse = frequency**2 * overlap * dt / (1 / first.mass_kg + 1 / second.mass_kg)
                    self.contacts.append(Contact(i, j, self.steps * dt, tuple(line / math.hypot(*line)), impulse))
            for contact in self.contacts:
                push = contact.impulse_n_s * np.array(contact.normal)
                self.velocity[contact.first] -= push / self.discs[contact.first].mass_kg
                self.velocity[contact.second] += push / self.discs[contact.second].mass_kg
            self.position += self.velocity * dt
            self.steps += 1

    def observe(self):
        return Observation(self.position.copy(), self.velocity.copy(), tuple(self.contacts))

    def close(self):
        pass


def contacts_of(steps, accuracy):
    return Profile(f"Contacts of {steps} steps.", lambda dt: {"dt_s": dt, "contact_steps": steps}, accuracy)


class PenaltyAdapter:
    name = "penalty"
    engine = Engine("Penalty springs", distribution="carom-penalty")
    capabilities = Capabilities(walls=False)
    profiles = {"default": contacts_of(4, Accuracy(2, 0.05, 0.01)), "tuned": contacts_of(2, Accuracy(1, 0.02, 0.02))}

    def prepare(self, scene, settings):
        if unknown := (scene.needs - {Need.IMMOVABLE}) | (settings.keys() - {"dt_s", "contact_steps"}):
            raise AdapterError(f"penalty springs know no {', '.join(unknown)}")
        return PenaltyWorld(scene, settings)


adapter = PenaltyAdapter()
