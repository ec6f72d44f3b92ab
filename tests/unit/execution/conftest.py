"""A distribution of hostile adapters, which Carom finds by entry points like any installed distribution."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from tests.installed_adapters import clear_entry_point_caches, write_distribution

#: An adapter in whose world nothing moves, to be made another.
STANDING = """
import os, sys, time
from dataclasses import replace
import numpy as np
from carom.engines.api import Capabilities, Contact, Engine, Observation, Profile

class Standing:
    settings = {"dt_s": 0.1}

    def __init__(self, scene, act):
        self.scene, self.act, self.steps = scene, act, 0

    def advance(self, steps):
        self.steps += steps

    def observe(self):
        position = np.array([disc.position_m for disc in self.scene.discs])
        return Observation(position, np.array([disc.velocity_m_s for disc in self.scene.discs]))

    def close(self):
        pass

class Adapter:
    engine, capabilities = Engine("Hostile"), Capabilities()

    def __init__(self, name, act=""):
        self.name, self.act = name, act or name
        self.profiles = {"tuned": Profile("as it comes", lambda dt: {"dt_s": dt})}

    def prepare(self, scene, settings):
        return World(scene, self.act)
"""

HOSTILE = (
    STANDING
    + """
class World(Standing):
    def advance(self, steps):
        super().advance(steps)
        print("chatter on standard output")
        print("chatter on standard error", file=sys.stderr)
        match self.act:
            case "aborts":
                print("assertion failed in solver.c:42", file=sys.stderr, flush=True)
                os.abort()
            case "exits":
                os._exit(7)
            case "hangs":
                time.sleep(3600)
            case "raises":
                raise ZeroDivisionError("inertia")
            case "litters":
                open("ENGINE_LOG.TXT", "w").write("noise")

    def observe(self):
        seen = super().observe()
        if self.act == "goes-nan":
            seen = replace(seen, position_m=seen.position_m * np.nan)
        return replace(seen, warning="BADQACC: state reset" if self.act == "warns" and self.steps > 2 else "")

class Missing(Adapter):
    engine = Engine("Missing", module="surely_not_installed", install="pip install surely-not-installed")

class OnlyDiscs(Adapter):
    capabilities = Capabilities(walls=False, max_speed_m_s=10.0, restitution=(0.5, 1.0))

class BadProfile(Adapter):
    def __init__(self, how):
        self.name = how
        self.profiles = {
            "default": Profile("fails", lambda dt: {}["no such"]),
            "tuned": Profile("holds a list", lambda dt: {"dt_s": dt, "list": [1]}),
        }

bad_profile = BadProfile("bad-profile")
aborts, exits, hangs, raises, litters, goes_nan, warns = (
    Adapter(how) for how in ("aborts", "exits", "hangs", "raises", "litters", "goes-nan", "warns")
)
missing, only_discs = Missing("missing"), OnlyDiscs("only-discs")
"""
)

#: Of its entry points; there is no adapter for the last.
NAMES = (
    *("aborts", "exits", "hangs", "raises", "litters", "goes-nan", "warns", "missing", "only-discs", "bad-profile"),
    "broken",
)


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[str, dict[str, str]], None]]:
    """Install adapters, as somebody else's distribution: the source of a module, and its entry points by name."""

    def install(source: str, names: dict[str, str]) -> None:
        module = f"hostile_{tmp_path.name}"
        (tmp_path / f"{module}.py").write_text(source)
        write_distribution(tmp_path, module, {name: f"{module}:{held}" for name, held in names.items()})
        monkeypatch.syspath_prepend(str(tmp_path))
        clear_entry_point_caches()

    yield install
    clear_entry_point_caches()


@pytest.fixture
def hostile(install: Callable[[str, dict[str, str]], None]) -> None:
    """Adapters that abort, exit, hang, raise, litter, go NaN, warn, are missing, or can't be loaded."""
    install(HOSTILE, {name: name.replace("-", "_") for name in NAMES})
