"""Local errors on finite walls: from PIT's own states its error is what sampling costs, and PIC has none."""

from __future__ import annotations

import pytest
from tests.lengths import each, long_after

import carom
from carom.comparator.local import local_errors
from carom.comparator.scales import scales_of
from carom.physics.features import Arc, Face, Feature, Mover
from carom.runs.pool import InProcess
from carom.solvers.plain.finite_walls import gap_of, overlap_since


@each(
    ("feature", "place", "velocity"),
    [
        (Face.between((0.0, 0.0), (2.0, 0.0), 0.1), (1.0, 0.3), (0.5, -1.0)),
        (Arc.vertex((0.0, 0.0), 0.1), (-0.2, 0.05), (1.0, 0.3)),
        (Arc.of_circle((0.0, 0.0), 2.0, 0.1, inside=False), (2.3, 0.1), (-1.0, 0.2)),
        (Arc.of_circle((0.0, 0.0), 2.0, 0.1, inside=True), (1.75, 0.1), (1.0, 0.2)),
    ],
)
def test_where_an_overlap_began_the_rim_touched(
    feature: Feature, place: tuple[float, float], velocity: tuple[float, float]
) -> None:
    """Brought back by that time along its path, a disc that overlaps a feature touches it."""
    disc = Mover.at(place, velocity, 0.25)
    assert gap_of(disc, feature) < -0.01
    ago = overlap_since(disc, feature)
    assert ago < 0.0
    back = Mover.at((place[0] + velocity[0] * ago, place[1] + velocity[1] * ago), velocity, 0.25)
    assert abs(gap_of(back, feature)) < 1e-15


def test_inside_an_arc_without_room_for_the_disc_its_rim_is_beyond_by_all_that_is_missing() -> None:
    """A disc of radius 1, 0.2 from the centre of an arc whose inner side has radius 0.4: its rim is 0.8 beyond that."""
    feature = Arc.of_circle((0.0, 0.0), 0.5, 0.1, inside=True)
    assert gap_of(Mover.at((0.2, 0.0), (0.0, 0.0), 1.0), feature) == pytest.approx(-0.8, rel=1e-15)


@pytest.mark.parametrize("name", long_after(1, ["end-of-wall", "box-of-edges", "star", "stadium-rhombus"]))
def test_what_pit_is_off_by_on_a_table_is_sampling(name: str) -> None:
    """The closed form from its own state before each impact leaves nothing to the method but checking once per step."""
    scene = carom.scene(f"tables/{name}")
    reference = carom.solve_pic(scene)
    scales = scales_of(scene, reference)
    assert local_errors(reference, scales).worst("velocity") < 1e-14
    row = carom.cross_check([scene], ["pit"], dts=[1 / 60], profiles=["tuned"], timing=False, pool=InProcess()).rows[0]
    assert row.trace is not None
    found = local_errors(row.trace, scales)
    assert found.spurious == ()
    assert found.worst("solver_velocity") < 1e-14
    assert (found.worst("sampling_velocity") > 1e-3) is (name != "box-of-edges")  # faces have one normal everywhere
