"""What each engine is known to do to its process: refused by name beforehand, or a row that harms no other."""

from __future__ import annotations

import gc
import math
import os
import subprocess
import sys
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest

import carom
from carom import Disc, Scene
from carom.adapter import Adapter, AdapterError, Setting
from carom.runner import Status
from carom.trace import Outcome

Named = Callable[[str], Adapter]

#: Beyond what any engine simulates; each is refused by its adapter, or by the scene itself.
NAN, INF = math.nan, math.inf


def _unchecked(
    mass_kg: float = 1.0,
    radius_m: float = 0.5,
    position_m: tuple[float, float] = (0, 0),
    velocity_m_s: tuple[float, float] = (1, 0),
    restitution: float = 1.0,
) -> Scene:
    """Return a scene of two discs that no validation has seen, as a scene made by other means may be."""
    first = Disc.model_construct(position_m=position_m, velocity_m_s=velocity_m_s, radius_m=radius_m, mass_kg=mass_kg)
    second = Disc(position_m=(3, 0), velocity_m_s=(-1, 0), radius_m=0.5)
    return Scene.model_construct(
        name="unchecked",
        description="",
        discs=(first, second),
        walls=(),
        restitution=restitution,
        wall_restitution=1.0,
        gravity_m_s2=(0.0, 0.0),
        duration_s=1.0,
        frame_rate_hz=60.0,
    )


BAD_SCENES: Mapping[str, list[dict[str, object]]] = {
    "mass_kg": [{"mass_kg": 0.0}, {"mass_kg": -1.0}, {"mass_kg": NAN}],
    "radius_m": [{"radius_m": 0.0}, {"radius_m": -1.0}, {"radius_m": NAN}, {"radius_m": INF}],
    "position_m": [{"position_m": (NAN, 0.0)}, {"position_m": (0.0, INF)}],
    "velocity_m_s": [{"velocity_m_s": (NAN, 0.0)}, {"velocity_m_s": (0.0, INF)}],
    "restitution": [{"restitution": -0.5}, {"restitution": NAN}],
}


@pytest.mark.parametrize(
    ("field", "changes"), [(field, change) for field, all_ in BAD_SCENES.items() for change in all_]
)
def test_numbers_that_no_disc_has_are_refused_before_an_engine_sees_them(
    engine: Adapter, field: str, changes: Mapping[str, object]
) -> None:
    """What aborts, asserts, is made 1 kg of, or silently never collides, is an error that names the field."""
    with pytest.raises(AdapterError, match=field):
        engine.prepare(_unchecked(**changes), engine.profiles["tuned"].settings(1 / 60))  # type: ignore[arg-type] # as it is meant


@pytest.mark.parametrize("dt_s", [0.0, -1.0, NAN, INF])
def test_a_step_that_is_none_is_refused(engine: Adapter, dt_s: float) -> None:
    """A step that is not a positive number is an error that names it."""
    settings = {**engine.profiles["tuned"].settings(1 / 60), "dt_s": dt_s}
    with pytest.raises(AdapterError, match="dt_s"):
        engine.prepare(_unchecked(), settings)


@pytest.mark.parametrize(
    ("name", "setting", "value"),
    [
        ("pymunk", "iterations", 0),
        ("pymunk", "iterations", -1),
        ("pymunk", "collision_bias", -1.0),
        ("pymunk", "damping", NAN),
        ("pybullet", "numSolverIterations", 0),
        ("pybullet", "contactSlop", NAN),
        ("mujoco", "joints", "hinge"),
        ("mujoco", "integrator", "magic"),
        ("box2d", "velocityIterations", -1),
        ("box2d", "velocity_scale", 0.0),
        ("box2d", "sweep", "some"),
    ],
)
def test_a_setting_that_an_engine_can_t_take_is_refused(named: Named, name: str, setting: str, value: Setting) -> None:
    """A setting on which an engine would abort, or which would make no sense, is an error that names it."""
    adapter = named(name)
    with pytest.raises(AdapterError, match=setting):
        adapter.prepare(_unchecked(), {**adapter.profiles["tuned"].settings(1 / 60), setting: value})


def test_a_reset_is_a_row_and_harms_no_other() -> None:
    """A state that MuJoCo puts back to the start is cut short with that reason; the other engines' rows are sound."""
    far = Scene(name="far", discs=[Disc(position_m=(2e10, 0), velocity_m_s=(1, 0), radius_m=1)], duration_s=0.1)
    near = Scene(name="near", discs=[Disc(position_m=(0, 0), velocity_m_s=(1, 0), radius_m=1)], duration_s=0.1)
    rows = carom.cross_check([far, near], ["mujoco", "pymunk"], profiles=["default"], dts=[1 / 60], timing=False).rows
    found = {(row.cell.scene.name, row.cell.engine): row for row in rows}
    assert found["far", "mujoco"].status is Status.UNSUPPORTED
    assert "2e+10 m" in found["far", "mujoco"].reason
    for key in (("far", "pymunk"), ("near", "mujoco"), ("near", "pymunk")):
        trace = found[key].trace
        assert trace is not None
        assert trace.outcome is Outcome.COMPLETED


def test_nothing_is_printed_and_nothing_is_left(
    capfd: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Four engines with all their profiles leave nothing on standard output or error, nor in the working folder."""
    monkeypatch.chdir(tmp_path)
    discs = [Disc(position_m=(0, 0), velocity_m_s=(2, 0), radius_m=0.5), Disc(position_m=(1.2, 0), radius_m=0.5)]
    scene = Scene(name="pair", discs=discs, duration_s=0.5)
    rows = carom.cross_check([scene], profiles=["all"], dts=[1 / 60], timing=False).rows
    assert {row.status for row in rows} <= {Status.RAN, Status.UNAVAILABLE}
    assert capfd.readouterr() == ("", "")
    assert list(tmp_path.iterdir()) == []


LEAK = """
import gc, os, sys, warnings
from pathlib import Path
warnings.simplefilter("ignore")
from carom import Disc, Scene
from carom.registry import load_adapter

adapter = load_adapter(sys.argv[1])
discs = [Disc(position_m=(0, 0), velocity_m_s=(1, 0), radius_m=0.5), Disc(position_m=(1.01, 0), radius_m=0.5)]
# In turn, so that not every world is used again.
scenes = [Scene(name="pair", discs=discs[:n], duration_s=1) for n in (1, 2)]
settings = adapter.profiles["tuned"].settings(1 / 60)

def resident_after(worlds):
    for k in range(worlds):
        world = adapter.prepare(scenes[k // 5 % 2], settings)
        world.observe()
        world.advance(2)
        world.observe()
        world.close()
    gc.collect()
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")

warm = resident_after(50)
print(resident_after(1000) - warm)
"""


def test_a_thousand_worlds_leave_nothing_behind(engine: Adapter) -> None:
    """After a thousand worlds a process is larger by less than one open world of the largest engine."""
    if not Path("/proc/self/statm").exists():
        pytest.skip("the resident memory of a process is read from /proc, which is not here")
    done = subprocess.run(
        [sys.executable, "-c", LEAK, engine.name], capture_output=True, text=True, check=True, env={**os.environ}
    )
    # An open PyBullet client holds 29 MB; 10 kB a world would be 10 MB.
    assert int(done.stdout.split()[-1]) < 10e6
    gc.collect()


def test_pybullet_keeps_nothing_of_one_world_in_the_next(named: Named) -> None:
    """Step length and every setting of a PyBullet world are its own: another one in between changes nothing."""
    pybullet = named("pybullet")
    scene = _unchecked()

    def run() -> bytes:
        world = pybullet.prepare(scene, pybullet.profiles["tuned"].settings(1 / 60))
        world.advance(90)
        end = world.observe()
        world.close()
        return end.position_m.tobytes() + end.velocity_m_s.tobytes()

    first = run()
    other = pybullet.prepare(scene, pybullet.profiles["default"].settings(1 / 7))
    other.advance(3)
    second = run()
    other.close()
    assert first == second


def test_box2d_survives_warnings_that_are_errors() -> None:
    """Where warnings are errors, importing Box2D ends the process; its adapter doesn't let it come to that."""
    program = (
        "from carom import Disc, Scene; from carom.registry import load_adapter; a = load_adapter('box2d');"
        "w = a.prepare(Scene(name='x', discs=[Disc(position_m=(0, 0), radius_m=1)], duration_s=1),"
        " a.profiles['tuned'].settings(1 / 60)); w.advance(1); print(w.observe().position_m.tolist()); w.close()"
    )
    done = subprocess.run([sys.executable, "-W", "error", "-c", program], capture_output=True, text=True, check=False)
    if "No module named 'Box2D'" in done.stderr:
        pytest.skip("Box2D is not installed")
    assert done.stdout == "[[0.0, 0.0]]\n"
