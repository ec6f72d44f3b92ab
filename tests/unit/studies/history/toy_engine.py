"""A toy engine whose releases differ in a known way, and a registry that serves them without a network."""

from pathlib import Path

import pytest
from tests.installed_adapters import clear_entry_point_caches, write_distribution

from carom.execution import describe_engines
from carom.studies.history.registry_clients import CLIENTS, ClientError

#: Discs that overlap and approach at the end of a step get the fraction of their velocities that the release keeps.
ADAPTER = """
import json, sys
from importlib import metadata
import numpy as np
from carom.engines.api import Capabilities, Contact, Engine, Observation, Profile

class World:
    def __init__(self, scene, settings):
        import toyengine
        self.engine, self.dt, self.steps, self.contacts = toyengine, settings["dt_s"], 0, ()
        self.settings = settings
        self.x = np.array([d.position_m for d in scene.discs]); self.v = np.array([d.velocity_m_s for d in scene.discs])
        self.reach = sum(d.radius_m for d in scene.discs)

    def advance(self, steps):
        for _ in range(steps):
            self.x = self.x + self.v * self.dt
            self.contacts = ()
            d, u = self.x[1] - self.x[0], self.v[1] - self.v[0]
            if d @ d < self.reach**2 and d @ u < 0:
                n = d / np.hypot(*d)
                push = (1 + self.engine.KEEPS) / 2 * (u @ n) * n
                self.v = self.v + [push, -push]
                self.contacts = (Contact(0, 1, self.steps * self.dt, tuple(n)),)
            self.steps += 1

    def observe(self):
        return Observation(self.x.copy(), self.v.copy(), self.contacts)

    def close(self):
        pass

class Adapter:
    name = "toy"
    engine = Engine("Toy engine", module="toyengine", distribution="toyengine", oldest="1.0")
    capabilities = Capabilities(walls=False, immovable_discs=False)
    profiles = {name: Profile("A toy.", lambda dt_s: {"dt_s": dt_s}) for name in ("default", "tuned")}

    def prepare(self, scene, settings):
        return World(scene, settings)

adapter = Adapter()
"""

#: For each release: the fraction of the velocity that an impact keeps.
RELEASES = {"0.9": 1.0, "1.0": 1.0, "1.1": 1.0, "1.2": 0.5, "1.3": 0.5, "1.4": 1.0}


class Toys:
    """A registry that serves the toy engine."""

    def __init__(self) -> None:
        self.installed: list[str] = []
        self.reached = True

    def list_versions(self, package: str) -> tuple[str, ...]:
        """Return the releases of `RELEASES`, and one that can't be installed."""
        assert package == "toyengine"
        if not self.reached:
            raise ClientError("pip: no network")
        return (*reversed(RELEASES), "2.0")

    def install(self, package: str, version: str, folder: Path) -> tuple[str, ...]:
        """Write a release into a folder."""
        if version not in RELEASES or not self.reached:
            raise ClientError("pip: ERROR: No matching distribution found for toyengine==2.0")
        (folder / "toyengine.py").write_text(f"KEEPS = {RELEASES[version]}\n")
        write_distribution(folder, package, {}, version=version)
        self.installed.append(version)
        return (f"{package}=={version}",)


def install_toys(site: Path, patch: pytest.MonkeyPatch) -> Toys:
    """Register the toy's adapter, and serve its registry instead of pip's."""
    write_distribution(site, "carom-toy", {"toy": "carom_toy:adapter"})
    (site / "carom_toy.py").write_text(ADAPTER)
    patch.syspath_prepend(site)
    patch.setattr(describe_engines, "_KNOWN", {})
    found = Toys()
    patch.setitem(CLIENTS, "pip", found)
    patch.setenv("XDG_CACHE_HOME", str(site / "cache"))
    clear_entry_point_caches()
    return found
