"""A pickled space and an MJCF model become scenes by their engines' own loaders, and what is lost is named."""

import math
import os
import pickle
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pymunk
import pytest
from tests.adapters.test_code import CORNER
from tests.cases import each
from tests.scene_builders import disc_at, staged, wall_at
from typer.testing import CliRunner

import carom
from carom import Scene
from carom.cli import app
from carom.engines.registry import load_adapter
from carom.errors import AdapterError, InputError
from carom.execution.scene_import import import_scene


def save_space(space: pymunk.Space, folder: Path, protocol: int = pickle.DEFAULT_PROTOCOL) -> Path:
    path = folder / "space.pkl"
    path.write_bytes(pickle.dumps(space, protocol))
    return path


def add_ball(space: pymunk.Space, x: float, y: float, radius: float = 0.5, *, elasticity: float = 1.0) -> pymunk.Body:
    body = pymunk.Body(2.0, pymunk.moment_for_circle(2.0, 0.0, radius))
    body.position = (x, y)
    circle = pymunk.Circle(body, radius)
    circle.elasticity = elasticity
    space.add(body, circle)
    return body


@pytest.mark.long
@each("protocol", range(pickle.HIGHEST_PROTOCOL, -1, -1))
def test_pickled_space_of_a_scene_is_imported_as_that_scene(tmp_path: Path, protocol: int) -> None:
    """The pymunk space built by the printed code and pickled is imported as the original scene."""
    adapter = load_adapter("pymunk")
    text = adapter.code(CORNER, adapter.profiles["tuned"].settings(1 / 60), "")  # type: ignore[attr-defined]
    build = text.partition("for _ in range(steps)")[0]
    path = tmp_path / "space.pkl"
    end = f"import pickle\npickle.dump(space, open({str(path)!r}, 'wb'), {protocol})\n"
    subprocess.run([sys.executable, "-c", build + end], check=True)
    found = import_scene(path, duration_s=CORNER.duration_s)
    scene = found.scene
    assert scene.gravity_m_s2 == CORNER.gravity_m_s2
    for disc, meant in zip(scene.discs, CORNER.discs, strict=True):
        assert (disc.position_m, disc.velocity_m_s) == (meant.position_m, meant.velocity_m_s)
        assert (disc.radius_m, disc.mass_kg, disc.spin_rad_s) == (meant.radius_m, meant.mass_kg, meant.spin_rad_s)
        if not meant.immovable:  # over m r^2 and times it again: two roundings
            assert disc.inertia_factor == pytest.approx(meant.inertia_factor, rel=2**-51)
    for wall, meant_wall in zip(scene.half_planes(), CORNER.half_planes(), strict=True):
        # A polygon's corners are some metres out, each rounded by a unit of 2**-50 of that.
        np.testing.assert_allclose(wall.normal, meant_wall.normal, rtol=0, atol=2**-48)
        off = np.subtract(wall.point_m, meant_wall.point_m) @ np.array(meant_wall.normal)
        assert abs(off) <= 2**-48 * (1 + math.hypot(*wall.point_m))
    coefficients = ("restitution", "wall_restitution", "friction", "wall_friction")
    for name in coefficients:  # a root, squared
        assert getattr(scene, name) == pytest.approx(getattr(CORNER, name), rel=2**-50)
    dropped = (f"shape {k}, a Poly: only its face towards the discs is kept, without its ends" for k in (3, 4))
    assert found.dropped == tuple(dropped)


@pytest.mark.usefixtures("in_process")
def test_unsupported_parts_of_a_space_are_listed(tmp_path: Path) -> None:
    """Joints, damping, sensors, compounds, filters and moving bodies of a space are listed as dropped."""
    space = pymunk.Space()
    space.damping = 0.9
    first, second = add_ball(space, 0, 0, elasticity=0.5), add_ball(space, 3, 0)
    for circle in first.shapes:
        circle.filter = pymunk.ShapeFilter(group=7)
    space.add(pymunk.PinJoint(first, second))
    box = pymunk.Body(1, 1)
    space.add(box, pymunk.Poly.create_box(box))
    pair = pymunk.Body(1, 1)
    pair.position = (9, 9)
    space.add(pair, pymunk.Circle(pair, 1), pymunk.Circle(pair, 1, (2, 0)))
    for circle in add_ball(space, 20, 0).shapes:
        circle.sensor = True
    lift = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
    lift.velocity = (0, 1)
    space.add(lift, pymunk.Segment(lift, (0, -5), (1, -5), 0.1))
    space.add(pymunk.Segment(space.static_body, (1.5, -1), (1.5, 1), 0.1))
    found = import_scene(save_space(space, tmp_path))
    assert [disc.position_m for disc in found.scene.discs] == [(0.0, 0.0), (3.0, 0.0)]
    assert found.scene.half_planes() == ()
    assert found.scene.restitution == 0.5
    told = "\n".join(found.dropped)
    for what in (
        "a PinJoint",
        "the damping of the space, 0.9",
        "a Poly: it moves",
        "its body has 2 shapes",
        "a sensor",
        "its kinematic body moves by itself",
        "no face has all discs in front of it",
        "disc 0: its filter",
    ):
        assert what in told


@pytest.mark.usefixtures("in_process")
def test_pixels_are_converted_to_metres(tmp_path: Path) -> None:
    """A space in pixels is imported in metres; masses and coefficients stay the same."""
    space = pymunk.Space()
    space.gravity = (0.0, 900.0)
    add_ball(space, 128.0, 64.0, 32.0).velocity = (640.0, 0.0)
    floor = pymunk.Segment(space.static_body, (0, 512), (800, 512), 0.0)
    floor.elasticity = 0.5
    space.add(floor)
    scene = import_scene(save_space(space, tmp_path), pixels_per_metre=64.0).scene
    (disc,), (wall,) = scene.discs, scene.half_planes()
    assert (disc.position_m, disc.velocity_m_s, disc.radius_m, disc.mass_kg) == ((2.0, 1.0), (10.0, 0.0), 0.5, 2.0)
    assert (wall.point_m[1], wall.normal) == (8.0, (0.0, -1.0))
    assert scene.gravity_m_s2 == (0.0, 900.0 / 64.0)
    assert (disc.inertia_factor, scene.wall_restitution) == (0.5, 0.5)


class Bomb:
    """A pickle that would run a command when it is read."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __reduce__(self) -> tuple[Any, ...]:
        return (os.system, (f"touch {self.path}",))


def build_dotted_pickle() -> bytes:
    """Return a pickle that asks for a part of an admitted type by a dotted name."""
    return pickle.PROTO + b"\x04" + b"\x8c\x0cpymunk.space" + b"\x8c\x1aSpace.__init__.__globals__" + b"\x93."


@pytest.mark.usefixtures("in_process")
@each("kind", ["bomb", "dotted", "callback"])
def test_foreign_objects_in_a_pickle_are_refused_and_not_run(tmp_path: Path, kind: str) -> None:
    """A pickle that refers to other types than pymunk's and plain ones is refused with that name, and not run."""
    mark, path = tmp_path / "ran", tmp_path / "space.pkl"
    space = pymunk.Space()
    add_ball(space, 0, 0).velocity_func = carom_function
    content, name = {
        "bomb": (pickle.dumps(Bomb(mark)), "posix.system"),
        "dotted": (build_dotted_pickle(), "pymunk.space.Space.__init__.__globals__"),
        "callback": (pickle.dumps(space), f"{__name__}.carom_function"),
    }[kind]
    path.write_bytes(content)
    result = CliRunner().invoke(app, ["import", str(path)])
    assert result.exit_code == 2
    assert f"the file contains {name}, which is neither a type of pymunk nor a plain type" in result.output
    assert not mark.exists()


def carom_function(body: pymunk.Body, gravity: tuple[float, float], damping: float, dt: float) -> None:
    """A callback of somebody's own, which a pickle names."""
    pymunk.Body.update_velocity(body, gravity, damping, dt)


@pytest.mark.usefixtures("in_process")
@each(
    "content, words",
    [
        (pickle.dumps([1, 2]), "the file contains a list instead of a pymunk.Space"),
        (b"no pickle", "the file is not a pickle of a pymunk.Space"),
        (pickle.dumps(pymunk.Space()), "must hold at least one disc"),
    ],
)
def test_file_that_is_no_space_is_refused(tmp_path: Path, content: bytes, words: str) -> None:
    """A pickle without a space, a file that is no pickle, and a space without discs are refused with the reason."""
    path = tmp_path / "space.pkl"
    path.write_bytes(content)
    with pytest.raises(AdapterError, match=words):
        import_scene(path)


@pytest.mark.usefixtures("in_process")
def test_invalid_import_arguments_are_refused(tmp_path: Path) -> None:
    """An unknown extension, a missing file and a zero `pixels_per_metre` are refused by name."""
    with pytest.raises(InputError, match=r"has an unknown extension; known: \.pkl"):
        import_scene(tmp_path / "space.txt")
    with pytest.raises(InputError, match="can't be read"):
        import_scene(tmp_path / "space.pkl")
    with pytest.raises(InputError, match="pixels_per_metre"):
        import_scene(tmp_path / "space.pkl", pixels_per_metre=0.0)


@pytest.mark.usefixtures("in_process")
def test_import_command_writes_a_loadable_scene(tmp_path: Path) -> None:
    """`carom import FILE TO` writes the scene, lists what was dropped, and never overwrites a file."""
    space = pymunk.Space()
    space.damping = 0.5
    add_ball(space, 0, 0)
    path, to = save_space(space, tmp_path), tmp_path / "mine.toml"
    result = CliRunner().invoke(app, ["import", str(path), str(to), "--duration", "2"])
    assert result.exit_code == 0, result.output
    assert "dropped: the damping of the space, 0.5" in result.output
    scene = carom.load_scene(to)
    assert (scene.name, scene.duration_s, len(scene.discs)) == ("space", 2.0, 1)
    assert CliRunner().invoke(app, ["import", str(path), str(to)]).exit_code == 2
    assert CliRunner().invoke(app, ["import", str(path)]).output.count("[[discs]]") == 1


def save_model(scene: Scene, profile: str, folder: Path) -> Path:
    adapter = load_adapter("mujoco")
    path = folder / "model.xml"
    path.write_text(adapter.code(scene, adapter.profiles[profile].settings(0.002), "A model."))  # type: ignore[attr-defined]
    return path


@pytest.mark.usefixtures("in_process")
@each("profile", ["tuned", "default"])
def test_model_of_a_scene_is_imported_as_that_scene(tmp_path: Path, profile: str) -> None:
    """The MuJoCo model of the printed code is imported as the original scene, with masses in its mass unit."""
    scene = import_scene(save_model(CORNER, profile, tmp_path), duration_s=1.0).scene
    assert scene.gravity_m_s2 == CORNER.gravity_m_s2
    discs = sorted(scene.discs, key=lambda disc: disc.position_m)  # MuJoCo has what can't move first
    unit = discs[0].mass_kg / CORNER.discs[0].mass_kg
    assert math.frexp(unit)[0] == 0.5  # a power of two, see `choose_mass_unit`
    for disc, meant in zip(discs, CORNER.discs, strict=True):
        assert disc.position_m == pytest.approx(meant.position_m, abs=2**-50)
        assert (disc.velocity_m_s, disc.spin_rad_s) == (meant.velocity_m_s, meant.spin_rad_s)
        assert (disc.radius_m, disc.mass_kg) == (meant.radius_m, meant.mass_kg * unit)
        if not meant.immovable:  # times m r^2 and over it again
            assert disc.inertia_factor == pytest.approx(meant.inertia_factor, rel=2**-50)
    for wall, meant_wall in zip(scene.half_planes(), CORNER.half_planes(), strict=True):
        assert wall.point_m == meant_wall.point_m
        assert wall.normal == pytest.approx(meant_wall.normal, abs=2**-50)
    assert (scene.friction, scene.wall_friction) == (CORNER.friction, CORNER.wall_friction)
    # Of 0.9, written as a damping: a sum, a quotient, a product and a difference near 1.
    assert scene.restitution == pytest.approx(CORNER.restitution, rel=2**-49)
    assert scene.wall_restitution == pytest.approx(CORNER.wall_restitution, rel=2**-49)


@pytest.mark.usefixtures("in_process")
def test_disc_on_slide_joints_has_infinite_inertia_factor(tmp_path: Path) -> None:
    """No impact can turn a body on two slide joints, so its imported inertia factor is infinite."""
    plain = staged("plain", disc_at(0, 1, 1, r=0.25, m=3), wall_at(5, 0, -1, 0), duration_s=1)
    found = import_scene(save_model(plain, "tuned", tmp_path), duration_s=1.0)
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
def test_unsupported_parts_of_a_model_are_listed(tmp_path: Path) -> None:
    """Boxes, hinges, bodies off the plane, lying cylinders and gravity along z are listed as dropped."""
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
        "a box: scenes have only discs and half-planes",
        "its body has several parts, or can't move freely in the plane",
        "its centre is 1 off the plane z = 0",
        "geom can, a cylinder: its axis is not z",
        "gravity along z, -9.81",
    ):
        assert what in told


@pytest.mark.usefixtures("in_process")
@each(
    "text, words",
    [
        ("no model", "the model is not XML"),
        ("<mujoco><worldbody><geom type='sphere'/></worldbody></mujoco>", "MuJoCo can.t compile the model"),
        ("<mujoco><include file='/etc/hostname'/></mujoco>", "the element <include> refers to another file"),
        ("<mujoco><asset><mesh file='/etc/hostname'/></asset></mujoco>", "the element <mesh> refers to another file"),
        ("<mujoco/>", "must hold at least one disc"),
    ],
)
def test_invalid_model_is_refused(tmp_path: Path, text: str, words: str) -> None:
    """A file that is no model, refers to other files, or has no disc is refused with the reason."""
    path = tmp_path / "model.xml"
    path.write_text(text)
    with pytest.raises(AdapterError, match=words):
        import_scene(path)
