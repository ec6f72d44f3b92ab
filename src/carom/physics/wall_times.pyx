"""The time of impact of a disc on a half-plane, compiled, for who solves for one at a time."""

from carom.physics.wall_time cimport wall_time


def half_plane_time(
    double x, double y, double vx, double vy, double radius, double qx, double qy, double nx, double ny
):
    """Return `carom.physics.wall_time.wall_time`, to the bit."""
    return wall_time(x, y, vx, vy, radius, qx, qy, nx, ny)
