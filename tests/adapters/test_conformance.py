"""Carom's own adapters in the conformance suite, by the command for third-party adapters."""

import importlib
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from tests.adapters.conftest import NAMES
from tests.adapters.engine_scenes import build_break_scene, build_oblique_scene
from tests.cases import each
from tests.hazards.measures import ENGINES
from tests.scene_builders import Named

from carom import Scene
from carom.engines.api import Adapter
from carom.execution.methods import DEFAULT_PROFILES

KNOWN_FAILURES = Path(__file__).parent / "carom-known-failures.toml"
OF_ENGINES = Path(__file__).parents[1] / "engines"

#: Profiles other than the usual ones. The list has none of those in which one setting is put back (`no-ccd`), and no
#: cylinders that are free to turn, whose purpose is to tip over.
PROFILES = {
    "pic": ["tuned"],  # there is nothing to tune: its profiles are the same settings
    "pit": ["tuned"],
    "pymunk": ["tuned", "located"],  # none of its cases fails as shipped either (run by hand)
    "pybullet": [*DEFAULT_PROFILES, "cylinder"],
    "mujoco": [*DEFAULT_PROFILES, "cylinder"],
}


@each(
    "name",
    [
        *(pytest.param(name, marks=pytest.mark.long) for name in NAMES),
        *(pytest.param(name, marks=pytest.mark.engines) for name in ENGINES if name not in NAMES),
    ],
)
def test_adapter_passes_the_suite_except_for_known_failures(name: str, named: Named, tmp_path: Path) -> None:
    """`pytest --carom-engine` passes in an empty folder, with the known failures of the engine listed."""
    named(name)
    known = KNOWN_FAILURES if name in NAMES else OF_ENGINES / f"{name}-known-failures.toml"
    command = [sys.executable, "-m", "pytest", "--carom-engine", name]
    command += [f"--carom-known-failures={known}"] if known.exists() else []
    profiles = PROFILES.get(name, []) if name in NAMES else ["all"]
    command += [f"--carom-profile={profile}" for profile in profiles]
    done = subprocess.run([*command, "-W", "error", "-q"], capture_output=True, text=True, cwd=tmp_path, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert f"{name}: " in done.stdout
    assert " 0 failed" in done.stdout


#: Each scene with each profile, once, in a process that has run nothing before: no two have a structure in common, so
#: that nothing can have been used again.
FRESH = """
import sys, warnings
warnings.simplefilter("ignore")
from tests.adapters.test_conformance import REUSED, SCENES, run
from carom.engines.registry import load_adapter
for profile in REUSED:
    for name, scene in SCENES.items():
        print("bits", profile, name, run(load_adapter(sys.argv[1]), scene(), profile).hex())
"""

REUSED = ("default", "tuned", "cylinder-plain")


def _build_pair() -> Scene:
    return build_oblique_scene().model_copy(update={"walls": ()})


SCENES: dict[str, Callable[[], Scene]] = {
    "pair": _build_pair,
    "oblique": build_oblique_scene,
    "break": build_break_scene,
}


def run(adapter: Adapter, scene: Scene, profile: str) -> bytes:
    """Return every bit of what is seen at the start, half-way and at the end."""
    dt_s = 1 / 60
    world = adapter.prepare(scene, adapter.profiles[profile].settings(dt_s))
    seen = [world.observe()]
    for _ in range(2):
        world.advance(scene.step_count(dt_s) // 2)
        seen.append(world.observe())
    world.close()
    return b"".join(o.position_m.tobytes() + o.velocity_m_s.tobytes() + repr(o.contacts).encode() for o in seen)


def _move_first_disc(scene: Scene, by_m: float) -> Scene:
    """The same discs, started elsewhere: the next scene of a sweep."""
    first = scene.discs[0]
    moved = first.model_copy(update={"position_m": (first.position_m[0] - by_m, first.position_m[1] + by_m / 3)})
    return scene.model_copy(update={"discs": (moved, *scene.discs[1:])})


@pytest.mark.long
@each("name", ["mujoco", "pybullet"])
def test_reused_world_is_bit_identical_to_a_fresh_process(named: Named, name: str) -> None:
    """A scene that runs in a reused world has the bits of the same scene in a process of its own."""
    adapter = named(name)
    done = subprocess.run([sys.executable, "-c", FRESH, name], capture_output=True, text=True, check=True)
    fresh = [line.split()[1:] for line in done.stdout.splitlines() if line.startswith("bits")]
    assert len(fresh) == len(REUSED) * len(SCENES)
    for profile, scene_name, bits in fresh:
        scene = SCENES[scene_name]()
        for k in range(3):
            run(adapter, _move_first_disc(scene, 0.01 * (k + 1)), profile)
        assert run(adapter, scene, profile) == bytes.fromhex(bits), (profile, scene_name)


def test_pybullet_empties_only_clients_of_closed_worlds(pybullet: Adapter) -> None:
    """Emptying a client for reuse leaves open worlds and foreign clients alone, and gives the first run's bits."""
    import carom_adapters.pybullet.world as module

    bullet: Any = importlib.import_module("pybullet")  # untyped: PyBullet ships no stubs
    for client, *_ in module._KEPT.values():  # noqa: SLF001 - the first number, a default everywhere, is to be another's
        bullet.disconnect(client)
    module._KEPT.clear()  # noqa: SLF001 - as above
    own = bullet.connect(bullet.DIRECT)
    ball = bullet.createCollisionShape(bullet.GEOM_SPHERE, 1.0, physicsClientId=own)
    bullet.createMultiBody(1.0, ball, physicsClientId=own)
    try:
        scene, settings = build_oblique_scene(), pybullet.profiles["tuned"].settings(1 / 240)
        alone = run(pybullet, scene, "tuned")
        beside = pybullet.prepare(scene, settings)
        run(pybullet, _build_pair(), "tuned")
        assert run(pybullet, scene, "tuned") == alone
        assert bullet.getNumBodies(own) == 1
        assert beside.observe().position_m.tolist() == scene.arrays.position_m.tolist()
        beside.close()
    finally:
        bullet.disconnect(own)
