"""Scenes whose outcome mechanics tells, for any engine: equal discs exchange the normal parts of their velocities."""

from tests.hazards.spread import build_starts

from carom import Disc, Scene

#: Starts of each test, spread evenly over a step.
STARTS = 16
PHASES = tuple(k / STARTS for k in range(STARTS))


def list_starts(scene: Scene) -> list[Scene]:
    """Return a scene begun at `STARTS` parts of a step of its frame rate."""
    return build_starts(scene, STARTS)


def build_oblique_scene(speed_m_s: float = 5.0, radius_m: float = 0.5) -> Scene:
    """A disc meets an equal one at rest on a line of centres 3, 4, 5: 4/5 of its speed goes over, 3/5 it keeps."""
    centres = (2 * radius_m * 4 / 5, 2 * radius_m * 3 / 5)
    back_m = 0.377 * speed_m_s  # the impact comes at no whole number of steps
    runner = Disc(position_m=(-back_m, 0), velocity_m_s=(speed_m_s, 0), radius_m=radius_m)
    return Scene(name="oblique", discs=[runner, Disc(position_m=centres, radius_m=radius_m)], duration_s=0.75)


def velocities_after_oblique(speed_m_s: float = 5.0) -> list[list[float]]:
    """Velocities after `oblique`: 4/5 of the speed along (4, 3) / 5, 3/5 of it along (3, -4) / 5."""
    along, across = 0.8 * speed_m_s, 0.6 * speed_m_s
    return [[0.6 * across, -0.8 * across], [0.8 * along, 0.6 * along]]
