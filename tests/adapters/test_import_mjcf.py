"""An MJCF model becomes a scene by MuJoCo's own compiler, and what is lost is named."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from tests.adapters.test_code import CORNER
from tests.stage import disc_at, staged, wall_at

from carom import Scene
from carom.errors import AdapterError
from carom.registry import load_adapter
from carom.runs.imported import import_scene


def model_of(scene: Scene, profile: str, folder: Path) -> Path:
    adapter = load_adapter("mujoco")
    path = folder / "model.xml"
    path.write_text(adapter.code(scene, adapter.profiles[profile].settings(0.002), "A model."))  # type: ignore[attr-defined]
    return path


@pytest.mark.long
@pytest.mark.parametrize("profile", ["tuned", "default"])
def test_a_scene_that_becomes_a_model_comes_back(tmp_path: Path, profile: str) -> None:
    """The model that the printed settings are, with its start, is the scene that it was made of, at its mass unit."""
    scene = import_scene(model_of(CORNER, profile, tmp_path), duration_s=1.0).scene
    assert scene.gravity_m_s2 == CORNER.gravity_m_s2
    discs = sorted(scene.discs, key=lambda disc: disc.position_m)  # MuJoCo has what can't move first
    unit = discs[0].mass_kg / CORNER.discs[0].mass_kg
    assert math.frexp(unit)[0] == 0.5  # a power of two, see `mass_unit`
    for disc, meant in zip(discs, CORNER.discs, strict=True):
        assert disc.position_m == pytest.approx(meant.position_m, abs=2**-50)
        assert (disc.velocity_m_s, disc.spin_rad_s) == (meant.velocity_m_s, meant.spin_rad_s)
        assert disc.radius_m == meant.radius_m
        assert disc.mass_kg == meant.mass_kg * unit
        if not meant.immovable:  # times m r^2 and over it again
            assert disc.inertia_factor == pytest.approx(meant.inertia_factor, rel=2**-50)
    for wall, meant_wall in zip(scene.half_planes(), CORNER.half_planes(), strict=True):
        assert wall.point_m == meant_wall.point_m
        assert wall.normal == pytest.approx(meant_wall.normal, abs=2**-50)
    assert (scene.friction, scene.wall_friction) == (CORNER.friction, CORNER.wall_friction)
    # Of 0.9, written as a damping: a sum, a quotient, a product and a difference near 1.
    assert scene.restitution == pytest.approx(CORNER.restitution, rel=2**-49)
    assert scene.wall_restitution == pytest.approx(CORNER.wall_restitution, rel=2**-49)


@pytest.mark.long
def test_a_disc_on_slides_does_not_turn(tmp_path: Path) -> None:
    """Of a body that two slides hold no impact turns anything: its inertia factor is infinite."""
    plain = staged("plain", disc_at(0, 1, 1, r=0.25, m=3), wall_at(5, 0, -1, 0), duration_s=1)
    found = import_scene(model_of(plain, "tuned", tmp_path), duration_s=1.0)
    (disc,) = found.scene.discs
    assert disc == plain.discs[0].model_copy(update={"inertia_factor": math.inf})
    assert found.scene.half_planes() == plain.walls
    assert found.dropped == ()


MODEL = """<mujoco>
  <worldbody>
    <geom type="plane" size="0 0 1"/>
    <geom name="floor" type="plane" size="0 0 1" zaxis="0 1 0"/>
    <geom type="box" size="1 1 1" pos="9 9 0"/>
    <body pos="0 2 0"><freejoint/><geom name="ball" type="sphere" size=".5" mass="2"/></body>
    <body pos="3 2 0"><joint type="hinge" axis="0 0 1"/><geom type="sphere" size=".5" pos="1 0 0"/></body>
    <body pos="6 2 1"><freejoint/><geom type="sphere" size=".5"/></body>
    <body pos="12 2 0"><freejoint/><geom name="can" type="cylinder" size=".5 1" euler="90 0 0"/></body>
  </worldbody>
</mujoco>"""


@pytest.mark.usefixtures("in_process")
def test_all_that_a_scene_has_no_place_for_is_named(tmp_path: Path) -> None:
    """Boxes, planes across z, hinges, what is out of the plane or lies down, MuJoCo's own gravity: each is a line."""
    path = tmp_path / "model.xml"
    path.write_text(MODEL)
    found = import_scene(path)
    (disc,), (wall,) = found.scene.discs, found.scene.half_planes()
    assert (disc.position_m, disc.mass_kg, disc.radius_m) == ((0.0, 2.0), 2.0, 0.5)
    assert disc.inertia_factor == pytest.approx(0.4, rel=2**-50)  # a sphere's
    assert wall.normal == pytest.approx((0.0, 1.0), abs=2**-50)
    assert found.scene.restitution == 0.0  # as shipped a contact is critically damped
    told = "\n".join(found.dropped)
    for what in (
        "geom 0, a plane: its normal is not in the plane",
        "a box: scenes have discs and half-planes",
        "its body is not one geom that is free in the plane",
        "its centre is 1 off the plane z = 0",
        "geom can, a cylinder: its axis is not z",
        "gravity along z, -9.81",
    ):
        assert what in told


@pytest.mark.long
@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("no model", "it is no XML"),
        ("<mujoco><worldbody><geom type='sphere'/></worldbody></mujoco>", "MuJoCo compiles no model of it"),
        ("<mujoco><include file='/etc/hostname'/></mujoco>", "its <include> names another file"),
        ("<mujoco><asset><mesh file='/etc/hostname'/></asset></mujoco>", "its <mesh> names another file"),
        ("<mujoco/>", "must hold at least one disc"),
    ],
)
def test_a_file_of_another_kind_is_refused_in_a_sentence(tmp_path: Path, text: str, words: str) -> None:
    """What is no model, or names other files, which are not read, or has no disc, is told so by the file's name."""
    path = tmp_path / "model.xml"
    path.write_text(text)
    with pytest.raises(AdapterError, match=words):
        import_scene(path)
