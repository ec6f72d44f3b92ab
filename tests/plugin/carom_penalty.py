"""A third-party adapter: a penalty engine (overlapping discs push each other apart like springs), and its adapter."""

import math

import numpy as np

from carom.adapter import Capabilities, Contact, ContactTimes, Engine, Observation, Profile


class PenaltyWorld:
    def __init__(self, scene, settings):
        self.settings = dict(settings)
        self.position = np.array([disc.position_m for disc in scene.discs])
        self.velocity = np.array([disc.velocity_m_s for disc in scene.discs])
        self.radius = [disc.radius_m for disc in scene.discs]
        self.inverse_mass = np.array([[1 / disc.mass_kg] for disc in scene.discs])
        self.steps, self.contacts = 0, ()

    def advance(self, steps):
        dt, stiffness = self.settings["dt_s"], self.settings["stiffness_n_m"]
        for _ in range(steps):
            found, force = [], np.zeros_like(self.position)
            for i in range(len(self.radius)):
                for j in range(i + 1, len(self.radius)):
                    line = self.position[j] - self.position[i]
                    distance = math.hypot(*line)
                    overlap = self.radius[i] + self.radius[j] - distance
                    if overlap > 0:
                        force[i] -= stiffness * overlap * line / distance
                        force[j] += stiffness * overlap * line / distance
                        normal = (line[0] / distance, line[1] / distance)
                        found.append(Contact(i, j, self.steps * dt, normal, stiffness * overlap * dt))
            self.velocity = self.velocity + force * self.inverse_mass * dt
            self.position = self.position + self.velocity * dt
            self.steps, self.contacts = self.steps + 1, tuple(found)

    def observe(self):
        return Observation(self.position, self.velocity, self.contacts)

    def close(self):
        pass


class PenaltyAdapter:
    name = "penalty"
    engine = Engine("Penalty springs", distribution="carom-penalty")
    capabilities = Capabilities(walls=False, contact_times=ContactTimes.STEP)
    profiles = {
        "default": Profile("A soft spring.", lambda dt: {"dt_s": dt, "stiffness_n_m": 1e4}),
        "tuned": Profile("As stiff as the step lets it be.", lambda dt: {"dt_s": dt, "stiffness_n_m": 0.1 / dt**2}),
    }

    def prepare(self, scene, settings):
        return PenaltyWorld(scene, settings)


adapter = PenaltyAdapter()
