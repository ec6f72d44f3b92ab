"""What Planck's Serializer made of a world becomes a scene; `data/planck-1.5.0.json` is its output as it came."""

import json
import math
from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.cases import each
from tests.scene_builders import disc_at, wall_at

from carom.errors import CaromError
from carom.execution.scene_import import import_scene

DUMP = Path(__file__).parent / "data" / "planck-1.5.0.json"


def test_planck_dump_becomes_a_scene() -> None:
    """A ball, a fixed disc, an edge and a box are imported, and everything else is named as dropped."""
    found = import_scene(DUMP, duration_s=3.0)
    scene = found.scene
    # The density over its area; an even disc's moment of inertia is half of m r^2.
    ball = disc_at(1, 2, 3, r=0.25, m=2 * math.pi * 0.25**2, spin_rad_s=0.5)
    assert set(scene.discs) == {ball, disc_at(4, 2, m=math.inf)}
    assert set(scene.walls) == {wall_at(10, 0, 0, 1), wall_at(8, 4, -1, 0)}
    assert (scene.gravity_m_s2, scene.duration_s, scene.name) == ((0.0, -10.0), 3.0, "planck-1.5.0")
    assert (scene.restitution, scene.wall_restitution) == (0.5, 0.75)  # the larger of two
    assert (scene.friction, scene.wall_friction) == (0.25, 0.25)  # the root of the product
    told = "\n".join(found.dropped)
    assert "a polygon: it moves, and only discs can move in scenes" in told
    assert "a revolute-joint" in told
    assert told.count("without its ends and its skin") == 2
    assert len(found.dropped) == 4


def test_dump_in_pixels_is_converted_to_metres() -> None:
    """Positions and radii are divided by the pixels per metre; masses and spins are unchanged."""
    scene, small = import_scene(DUMP).scene, import_scene(DUMP, pixels_per_metre=4.0).scene
    for disc, less in zip(scene.discs, small.discs, strict=True):
        assert less.position_m == (disc.position_m[0] / 4, disc.position_m[1] / 4)
        assert (less.radius_m, less.mass_kg, less.spin_rad_s) == (disc.radius_m / 4, disc.mass_kg, disc.spin_rad_s)


SOUND = DUMP.read_text(encoding="utf-8")
EMPTY = '[{"gravity": {"x": 0, "y": 0}, "bodies": [%s], "joints": []}]'


def list_altered_dumps() -> Iterator[str]:
    """Yield dumps of which one entry after the first is a number instead of an object."""
    entries = json.loads(SOUND)
    for part in range(1, len(entries)):
        yield json.dumps([*entries[:part], 7, *entries[part + 1 :]])


@each(
    "content, words",
    [
        ("{", "it is not a dump of Planck's Serializer.toJson"),
        ("[]", "it is not a dump of Planck's Serializer.toJson"),
        (EMPTY % '{"refIndex": 7}', "a reference to 7"),
        (EMPTY % "", "must hold at least one disc"),
        ("[" * 100000, "no dump|nested too deeply"),
        (SOUND.replace('"friction":0.25', '"friction":"rough"'), "it is not a dump .* 'rough'"),
        *((altered, "it is not a dump") for altered in list_altered_dumps()),
    ],
)
def test_invalid_dump_is_refused_with_its_file_name(tmp_path: Path, content: str, words: str) -> None:
    """A file that is not a dump, has a dangling reference, a wrong entry or no disc, or nests too deeply is refused."""
    path = tmp_path / "world.json"
    path.write_text(content)
    with pytest.raises(CaromError, match=words) as refused:
        import_scene(path)
    assert "world.json" in str(refused.value)
