"""What must hold of every adapter, whatever its engine."""

from __future__ import annotations

import gc
import math
import os
import subprocess
import sys
from collections.abc import Callable, Mapping
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from tests.adapters.widths import rounded, width

from carom import Disc, Scene, Wall
from carom.adapter import Adapter, AdapterError, Observation, Setting, wall_body
from carom.registry import load_adapter

Drive = Callable[..., list[Observation]]

#: One impact is a dozen operations on numbers no larger than the speeds here (3 m/s); each may be wrong by half an ulp.
ROUNDING = 12 * float(np.spacing(3.0))

#: A power of two, so that step boundaries are exact and what falls between two of them is beyond doubt.
DT_S = 1 / 64


def _head_on(first_kg: float = 1.0, second_kg: float = 1.0, **scene: float) -> Scene:
    """Two discs on a line, 1 m/s and -2 m/s, that touch 1.01 / 3 s after the start."""
    return Scene(
        name="head-on",
        discs=[
            Disc(position_m=(0, 0), velocity_m_s=(1, 0), radius_m=0.5, mass_kg=first_kg),
            Disc(position_m=(2.01, 0), velocity_m_s=(-2, 0), radius_m=0.5, mass_kg=second_kg),
        ],
        duration_s=1.0,
        **scene,
    )


def _box() -> Scene:
    """Nine discs of different masses among four walls, bouncing off each other and off the walls for a second."""
    rng = np.random.default_rng(2024)
    return Scene(
        name="box",
        discs=[
            Disc(
                position_m=(i % 3 + 0.5, i // 3 + 0.5),
                velocity_m_s=rng.normal(scale=2.0, size=2),
                radius_m=0.3,
                mass_kg=1 + i,
            )
            for i in range(9)
        ],
        walls=[
            Wall(point_m=(0, 0), normal=(1, 0)),
            Wall(point_m=(0, 0), normal=(0, 1)),
            Wall(point_m=(3, 3), normal=(-1, 0)),
            Wall(point_m=(3, 3), normal=(0, -1)),
        ],
        duration_s=1.0,
    )


def _prepared_settings(adapter: Adapter, asked: Mapping[str, Setting]) -> Mapping[str, Setting]:
    world = adapter.prepare(_box(), asked)
    try:
        world.advance(1)
        return dict(world.settings)
    finally:
        world.close()


def test_adapter_declares_all_that_the_harness_asks_for(adapter: Adapter) -> None:
    """An adapter has the protocol's attributes, both obligatory profiles, and a sentence about each."""
    assert isinstance(adapter, Adapter)
    assert load_adapter(adapter.name) is adapter
    assert {"default", "tuned"} <= set(adapter.profiles)
    for profile in adapter.profiles.values():
        assert profile.description.endswith(".")
        settings = profile.settings(DT_S)
        assert settings["dt_s"] == DT_S
        assert all(isinstance(value, float | int | bool | str) for value in settings.values())
    low, high = adapter.capabilities.restitution
    assert 0 <= low <= high <= 1


def test_reading_adapters_imports_no_engine() -> None:
    """Finding, loading and reading every adapter leaves its engine unimported."""
    program = (
        "import sys; from carom.registry import engines; infos = engines(); "
        "assert len(infos) >= 5 and all(info.capabilities for info in infos), infos; "
        "print(sorted({'pymunk', 'pybullet', 'mujoco', 'Box2D'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize("profile", ["default", "tuned"])
def test_settings_read_back_are_those_asked_for(adapter: Adapter, profile: str) -> None:
    """A world reports, from its engine where that can be read, every setting with the value that was asked for."""
    asked = adapter.profiles[profile].settings(DT_S)
    used = _prepared_settings(adapter, asked)
    assert {name: used[name] for name in asked} == dict(asked)


def test_a_scene_starts_as_written(adapter: Adapter) -> None:
    """Before the first step, a world is in the scene's start state, with no contacts."""
    scene = _box()
    world = adapter.prepare(scene, adapter.profiles["tuned"].settings(DT_S))
    start = world.observe()
    world.close()
    assert start.position_m.tolist() == rounded(adapter, [disc.position_m for disc in scene.discs])
    assert start.velocity_m_s.tolist() == rounded(adapter, [disc.velocity_m_s for disc in scene.discs])
    assert not start.contacts
    assert not start.warning


def test_equal_masses_exchange_velocities_head_on(adapter: Adapter, drive: Drive) -> None:
    """Two equal discs that meet head-on leave with each other's velocity, whatever the step."""
    for dt_s in (1 / 60, DT_S, 1 / 240):
        end = drive(adapter, _head_on(), dt_s)[-1]
        np.testing.assert_allclose(end.velocity_m_s, [(-2, 0), (1, 0)], rtol=0, atol=width(adapter, ROUNDING))


@pytest.mark.parametrize("restitution", [0.0, 0.3, 0.5, 1.0])
@pytest.mark.parametrize("wall_restitution", [0.0, 0.5, 0.8, 1.0])
def test_restitution_is_simulated_as_asked(
    adapter: Adapter, drive: Drive, restitution: float, wall_restitution: float
) -> None:
    """Within the declared range, discs and walls each get their own coefficient, in any combination of the two."""
    low, high = adapter.capabilities.restitution
    if not low <= min(restitution, wall_restitution) <= max(restitution, wall_restitution) <= high:
        pytest.skip(f"{adapter.engine.name} declares restitution from {low} to {high}")
    pair = _head_on(1.0, 2.0)
    bouncer = Disc(position_m=(0, 9), velocity_m_s=(0, 3), radius_m=0.5, mass_kg=1.5)
    scene = Scene(
        name="both",
        discs=[*pair.discs, bouncer],
        walls=[Wall(point_m=(0, 10.01), normal=(0, -1))],
        restitution=restitution,
        wall_restitution=wall_restitution,
        duration_s=0.5,
    )
    end = drive(adapter, scene, DT_S)[-1]
    # Momentum 1 * 1 - 2 * 2 = -3 is kept by 3 kg, and the closing speed of 3 m/s becomes `restitution` times itself.
    expected = [(-1 - 2 * restitution, 0), (-1 + restitution, 0), (0, -3 * wall_restitution)]
    np.testing.assert_allclose(end.velocity_m_s, expected, rtol=0, atol=width(adapter, ROUNDING))


def test_an_immovable_disc_stays_and_turns_others_back(adapter: Adapter, drive: Drive) -> None:
    """A disc comes back from an immovable one with its velocity reversed, in whichever order the two are written."""
    moving = Disc(position_m=(0, 0), velocity_m_s=(3, 0), radius_m=0.5, mass_kg=2.0)
    post = Disc(position_m=(2.01, 0), radius_m=0.5, mass_kg=math.inf)
    for discs in ([moving, post], [post, moving]):
        end = drive(adapter, Scene(name="post", discs=discs, duration_s=0.6), DT_S)[-1]
        i, j = discs.index(moving), discs.index(post)
        np.testing.assert_allclose(end.velocity_m_s[i], (-3, 0), rtol=0, atol=width(adapter, ROUNDING))
        assert end.velocity_m_s[j].tolist() == [0, 0]
        assert end.position_m[j].tolist() == rounded(adapter, (2.01, 0))


def test_a_scene_of_nothing_but_posts_stands_still(adapter: Adapter, drive: Drive) -> None:
    """Immovable discs alone, in a wall and in each other, are a scene in which nothing ever happens."""
    posts = [Disc(position_m=(x, 0), radius_m=1, mass_kg=math.inf) for x in (0, 1)]
    scene = Scene(name="posts", discs=posts, walls=[Wall(point_m=(0, 0), normal=(1, 0))], duration_s=0.1)
    end = drive(adapter, scene, DT_S)[-1]
    assert end.position_m.tolist() == [[0, 0], [1, 0]]
    assert not end.velocity_m_s.any()
    assert not end.contacts


@pytest.mark.parametrize("profile", ["default", "tuned"])
def test_two_runs_are_identical_to_the_bit(adapter: Adapter, drive: Drive, profile: str) -> None:
    """Where determinism is declared, a run repeats to the bit, also after a world with other settings."""
    assert adapter.capabilities.deterministic
    first = drive(adapter, _box(), DT_S, profile)
    drive(adapter, _box(), DT_S, "tuned" if profile == "default" else "default")
    second = drive(adapter, _box(), DT_S, profile)
    assert first[-1].velocity_m_s.tobytes() != first[0].velocity_m_s.tobytes()
    for a, b in zip(first, second, strict=True):
        assert a.position_m.tobytes() == b.position_m.tobytes()
        assert a.velocity_m_s.tobytes() == b.velocity_m_s.tobytes()
        assert a.contacts == b.contacts


def test_steps_may_be_taken_singly_or_together(adapter: Adapter, drive: Drive) -> None:
    """Taking all steps in one call, unobserved as when timed, ends in the same bits as stopping after each to look."""
    scene = _box()
    watched = drive(adapter, scene, DT_S)[-1]
    world = adapter.prepare(scene, adapter.profiles["tuned"].settings(DT_S))
    world.advance(scene.step_count(DT_S))
    unwatched = world.observe()
    world.close()
    assert watched.position_m.tobytes() == unwatched.position_m.tobytes()
    assert watched.velocity_m_s.tobytes() == unwatched.velocity_m_s.tobytes()


@pytest.mark.parametrize("profile", ["default", "tuned"])
def test_contacts_account_for_every_change_of_velocity(engine: Adapter, drive: Drive, profile: str) -> None:
    """A step's contacts all have a positive impulse, and together they are that step's change of momentum."""
    scene = Scene(
        name="oblique, then a slanted wall",
        discs=[
            Disc(position_m=(0, 0), velocity_m_s=(3, 0), radius_m=0.5, mass_kg=1),
            Disc(position_m=(1.72, 0.3), velocity_m_s=(-1, 0.1), radius_m=0.5, mass_kg=2),
            Disc(position_m=(0.2, -3.1), radius_m=0.7, mass_kg=math.inf),
        ],
        walls=[Wall(point_m=(-1, 0), normal=(1, 0.2))],
        # Below 1, discs part more slowly than they met, and are still in each other when they do: contacts that push
        # nothing any more.
        restitution=0.4,
        wall_restitution=0.6,
        duration_s=3.0,
    )
    masses = [1.0, 2.0, math.inf]
    seen = drive(engine, scene, 1 / 240, profile)
    met = set()
    for before, after in pairwise(seen):
        change = np.zeros((3, 2))
        for contact in after.contacts:
            assert contact.impulse_n_s is not None
            assert contact.impulse_n_s > 0
            assert contact.second < 0 or contact.first < contact.second
            assert math.hypot(*contact.normal) == pytest.approx(1, abs=4 * sys.float_info.epsilon)
            push = contact.impulse_n_s * np.array(contact.normal)
            change[contact.first] -= push / masses[contact.first]
            if contact.second >= 0:
                change[contact.second] += push / masses[contact.second]
            met.add((contact.first, contact.second))
        # Engines keep a force, so an impulse is one division and one multiplication by the step away from theirs; the
        # largest here (8 kg m/s) is then known to a few ulp. MuJoCo's solver adds its own rounding, 100 times that.
        np.testing.assert_allclose(after.velocity_m_s - before.velocity_m_s, change, rtol=0, atol=width(engine, 1e-12))
    assert {(0, 1), (0, wall_body(0))} <= met


@pytest.mark.parametrize(("name", "reported_after"), [("pymunk", 3), ("pybullet", 4), ("mujoco", 4), ("box2d", 4)])
@pytest.mark.parametrize("swapped", [False, True])
def test_contact_is_stamped_with_the_instant_at_which_the_engine_looked(
    named: Callable[[str], Adapter], drive: Drive, name: str, reported_after: int, swapped: bool
) -> None:
    """A contact carries the time of the state in which its overlap was seen, by engines that look first or last."""
    # Touching at 0.3 s: of the boundaries, multiples of 1/8 s, the third (0.375 s) is the first with an overlap.
    dt_s, seen_at_s = 1 / 8, 0.375
    discs = [
        Disc(position_m=(0, 0), velocity_m_s=(1, 0), radius_m=0.5),
        Disc(position_m=(1.3, 0), radius_m=0.5, mass_kg=math.inf),
    ]
    scene = Scene(name="stamp", discs=discs[::-1] if swapped else discs, duration_s=1.0)
    adapter = named(name)
    seen = drive(adapter, scene, dt_s)
    (step,) = [k for k, observation in enumerate(seen) if observation.contacts]
    (contact,) = seen[step].contacts
    assert step == reported_after
    assert contact.time_s == seen_at_s
    assert (contact.first, contact.second) == (0, 1)
    assert contact.normal == pytest.approx((-1 if swapped else 1, 0), abs=width(adapter, ROUNDING))
    assert contact.impulse_n_s == pytest.approx(2.0, abs=width(adapter, ROUNDING))  # 1 kg turned from 1 m/s to -1 m/s


def test_worlds_let_go_of_what_they_hold(adapter: Adapter) -> None:
    """Two hundred worlds, made, run and closed one after another, leave less behind than one open world would."""
    statm = Path("/proc/self/statm")
    if not statm.exists():
        pytest.skip("the resident memory of a process is read from /proc, which is not here")
    page = os.sysconf("SC_PAGE_SIZE")
    settings = adapter.profiles["tuned"].settings(DT_S)

    def resident_after(worlds: int) -> int:
        for _ in range(worlds):
            world = adapter.prepare(_head_on(), settings)
            world.advance(2)
            world.observe()
            world.close()
        gc.collect()
        return int(statm.read_text().split()[1]) * page

    warm = resident_after(20)  # imports, and pools that an engine fills once
    grown = resident_after(180) - warm
    # An open PyBullet client holds 29 MB, the least that a world of it could leak; 100 kB times 180 is 18 MB.
    assert grown < 18e6


def test_an_unknown_setting_is_refused(engine: Adapter) -> None:
    """A setting that would be without effect is an error that names it and lists those that there are."""
    with pytest.raises(AdapterError, match=r"'itterations'.*dt_s"):
        engine.prepare(_head_on(), {**engine.profiles["tuned"].settings(DT_S), "itterations": 3})
