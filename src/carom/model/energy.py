"""Kinetic energy of discs, and the work that driven bodies do on them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from carom.model.scene import Scene
from carom.model.trace import Trace, rim_speeds


def kinetic_energy(
    scene: Scene, velocity_m_s: NDArray[np.float64], spin_rad_s: NDArray[np.float64] | None = None
) -> float:
    """Return the kinetic energy of the movable discs, in joules. If spins are given, rotation is included.

    `velocity_m_s` has shape ``(n, 2)``, and `spin_rad_s` has shape ``(n,)``. A disc that can't turn has no rotational
    energy.
    """
    return float(compute_kinetic_energies(scene, velocity_m_s, spin_rad_s))


def compute_kinetic_energies(
    scene: Scene, velocity_m_s: NDArray[np.float64], spin_rad_s: NDArray[np.float64] | None = None
) -> NDArray[np.float64]:
    """Return kinetic energies for several velocities and spins, with the shapes ``(k, n, 2)`` and ``(k, n)``."""
    arrays = scene.arrays
    mass = np.where(arrays.movable, arrays.mass_kg, 0.0)
    energy: NDArray[np.float64] = 0.5 * (mass * (velocity_m_s**2).sum(axis=-1)).sum(axis=-1)
    if spin_rad_s is not None:
        inertia = np.where(np.isinf(arrays.inertia), 0.0, arrays.inertia)
        energy = energy + 0.5 * (mass * inertia * (arrays.radius_m * spin_rad_s) ** 2).sum(axis=-1)
    return energy


def work_of_driven(trace: Trace) -> NDArray[np.float64]:
    """Return the work that a driven body does on the disc in each impact, in joules, shape ``(m,)``.

    The work is the scalar product of the impulse on the disc and the velocity of the driven surface. The velocity of
    the surface includes the speed of a conveyor or the spin of a driven disc. An impact changes the kinetic energy by
    this work minus the energy lost in the impact. Without a driven body, the work is 0.
    """
    start, impacts = trace.scene.arrays, trace.impacts
    work = np.zeros(len(impacts))
    if not start.driven:
        return work
    for side, (disc, other) in enumerate((("first", "second"), ("second", "first"))):
        bodies, normal = impacts[disc], impacts["normal"] * (-1.0, 1.0)[side]
        is_fixed = (impacts[other] < 0) | ~start.movable[np.maximum(impacts[other], 0)]
        is_counted = (bodies >= 0) & start.movable[np.maximum(bodies, 0)] & is_fixed
        mass = np.where(is_counted, start.mass_kg[np.maximum(bodies, 0)], 0.0)
        runs = np.where(impacts[other] < 0, start.belt_speeds_of(impacts[other]), rim_speeds(trace, "before")[1 - side])
        # The surface moves to the left of the normal, which points from the driven body to the disc.
        surface = impacts[f"velocity_{other}_before"] + runs[:, None] * np.stack([-normal[:, 1], normal[:, 0]], axis=1)
        change = impacts[f"velocity_{disc}_after"] - impacts[f"velocity_{disc}_before"]
        work += mass * np.sum(np.where(is_counted[:, None], change * surface, 0.0), axis=1)
    return work
