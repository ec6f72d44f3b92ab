"""Rotation and reordering of scenes, and the inverse for records of their runs."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from tests.campaign.comparison import Record
from tests.transformed_scenes import Map

from carom import Chain, Disc, Scene, Wall
from carom.model.walls import AnyWall, Leg

Point = tuple[float, float]
Rows = NDArray[np.void]


def turn_quarter_back(v: Point) -> Point:
    """Return a vector rotated by -90 degrees, exactly."""
    return (v[1], -v[0])


def rotate_scene(scene: Scene, turn: Map, *, is_reversed: bool = False) -> Scene:
    """Return a scene rotated about the origin, optionally with its discs in reverse order, without validation."""

    def turned_legs(legs: tuple[Leg, ...]) -> tuple[Leg, ...]:
        return tuple(leg.model_copy(update={"velocity_m_s": turn(leg.velocity_m_s)}) for leg in legs)

    def turned_disc(disc: Disc) -> Disc:
        moves = {"position_m": turn(disc.position_m), "velocity_m_s": turn(disc.velocity_m_s)}
        return disc.model_copy(update={**moves, "legs": turned_legs(disc.legs)})

    def turned_wall(wall: AnyWall) -> AnyWall:
        update: dict[str, object] = {"velocity_m_s": turn(wall.velocity_m_s), "legs": turned_legs(wall.legs)}
        if isinstance(wall, Wall):
            update |= {"point_m": turn(wall.point_m), "normal": turn(wall.normal)}
        elif isinstance(wall, Chain):
            update["points_m"] = tuple(map(turn, wall.points_m))
        else:
            update["centre_m"] = turn(wall.centre_m)
        return wall.model_copy(update=update)

    discs = tuple(map(turned_disc, scene.discs))
    update = {
        "discs": discs[::-1] if is_reversed else discs,
        "walls": tuple(map(turned_wall, scene.walls)),
        "gravity_m_s2": turn(scene.gravity_m_s2),
    }
    return scene.model_copy(update=update)


def restore_record(record: Record, turn_back: Map, *, is_reversed: bool = False) -> Record:
    """Return the record of a rotated scene with the vectors and body numbers of the original scene."""
    matrix = np.array([turn_back((1.0, 0.0)), turn_back((0.0, 1.0))])
    discs = len(record.final_position_m)

    def turned(rows: Rows | None) -> Rows | None:
        if rows is None:
            return None
        found = rows.copy()
        for name in rows.dtype.names or ():
            if rows[name].ndim == 2:
                found[name] = rows[name] @ matrix + 0.0  # no -0
        return found

    impacts, modes = turned(record.impacts), turned(record.modes)
    assert impacts is not None
    spins, order = record.spins, slice(None, None, -1) if is_reversed else slice(None)
    if is_reversed:
        impacts, spins = _renumber(impacts, spins, discs)
        if modes is not None:
            modes["disc"] = discs - 1 - modes["disc"]
    return replace(
        record,
        impacts=impacts,
        spins=spins,
        modes=modes,
        final_position_m=(record.final_position_m @ matrix)[order],
        final_velocity_m_s=(record.final_velocity_m_s @ matrix)[order],
        final_spin_rad_s=None if record.final_spin_rad_s is None else record.final_spin_rad_s[order],
    )


def _renumber(impacts: Rows, spins: Rows | None, discs: int) -> tuple[Rows, Rows | None]:
    """Return impacts and spins with reversed numbers of discs, and the lower number first."""
    pair = impacts["second"] >= 0
    for name in ("first", "second"):
        of_disc = impacts[name] >= 0
        impacts[name][of_disc] = discs - 1 - impacts[name][of_disc]
    swapped = impacts.copy()
    swapped["normal"][pair] = -impacts["normal"][pair]
    for one, other in (("first", "second"), ("second", "first")):
        swapped[one][pair] = impacts[other][pair]
        for when in ("before", "after"):
            swapped[f"velocity_{one}_{when}"][pair] = impacts[f"velocity_{other}_{when}"][pair]
    if spins is None:
        return swapped, None
    turned = spins.copy()
    for one, other in (("first", "second"), ("second", "first")):
        for when in ("before", "after"):
            turned[f"{one}_{when}"][pair] = spins[f"{other}_{when}"][pair]
    return swapped, turned
