"""Digests of what the extension computes, to be the same on every machine: ``python -m tests.packaging.digests``.

Starts are drawn by Python's own generator and by sums, products and quotients alone: sines and logarithms of NumPy may
differ from one processor to another, and what starts differently ends differently.
"""

import hashlib
import json
import math
import random
import sys

import numpy as np

from carom import Disc, Scene, Wall, certify, solve_pit, time_of_impact
from carom.catalogue import all_scenes
from carom.model.disc_arrays import DiscArrays
from carom.solvers.certified.serialisation import enclosures
from carom.solvers.event_driven.run import EventDrivenRun

_PAIRS = 20_000
#: Of the catalogue; few impacts, since an emulated processor is slow.
_CERTIFIED = ("paper/missed", "classics/box", "classics/cradle-gaps", "classics/galperin-100")


def digests() -> dict[str, str]:
    """Return a digest of each of three gases, of PIT, of certified traces and of times of impact, by name."""
    found = {
        "an elastic gas of 1,000 discs, 20,000 impacts": _gas(1000, 20_000),
        "a gas with friction, spin and immovable discs, 5,000 impacts": _gas(
            200, 5_000, immovable=5, restitution=0.9, friction=0.3, wall_friction=0.5, tangential_restitution=0.5
        ),
        "a gas that loses energy, with the TC model, 5,000 impacts": _gas(200, 5_000, 1e-3, restitution=0.8),
        "PIT of 100 discs": _sampled(100),
        f"{_PAIRS:,} times of impact": _hash(_times()),
    }
    for name, entry in all_scenes().items():
        if name in _CERTIFIED:
            trace = enclosures(certify(entry.scene, max_impacts=20, time_budget_s=1e4))
            found[f"certified: {name}"] = _hash(json.dumps(trace, sort_keys=True).encode())
    return found


def _lattice(discs: int, drawn: random.Random) -> tuple[list[tuple[float, float]], list[tuple[float, float]]]:
    """Return places a metre and a half apart, and velocities."""
    side = math.isqrt(discs - 1) + 1
    places = [(1.5 * (k % side), 1.5 * (k // side)) for k in range(discs)]
    return places, [(drawn.uniform(-1.0, 1.0), drawn.uniform(-1.0, 1.0)) for _ in places]


def _box(discs: int) -> tuple[tuple[float, float, float, float], ...]:
    far = 1.5 * math.isqrt(discs - 1) + 1.0
    return ((-1.0, -1.0, 1.0, 0.0), (-1.0, -1.0, 0.0, 1.0), (far, far, -1.0, 0.0), (far, far, 0.0, -1.0))


def _gas(discs: int, impacts: int, contact_s: float = 0.0, immovable: int = 0, **law: float) -> str:
    """Return a digest of the impacts of a gas of discs of many sizes and masses, and of its last state."""
    drawn = random.Random(discs)
    places, velocities = _lattice(discs, drawn)
    mass = np.array([drawn.uniform(0.5, 2.0) for _ in places])
    mass[:immovable] = math.inf
    velocity = np.where(np.isinf(mass)[:, None], 0.0, np.array(velocities))
    if "friction" in law:
        law["spin_rad_s"] = np.where(np.isinf(mass), 0.0, velocity[:, 0])  # type: ignore[assignment] # an array, unlike the rest
    radius = np.array([drawn.uniform(0.2, 0.5) for _ in places])
    start = DiscArrays(np.array(places), velocity, radius, mass, _box(discs), **law)  # type: ignore[arg-type] # see above
    run = EventDrivenRun(start, contact_duration_s=contact_s)
    run.advance_to(math.inf, impacts)
    spins = run.spins()
    return _hash(run.log.array().tobytes(), run.positions().tobytes(), b"" if spins is None else spins.tobytes())


def _sampled(discs: int) -> str:
    """Return a digest of PIT's impacts of a gas, and of its last state."""
    places, velocities = _lattice(discs, random.Random(discs))
    scene = Scene(
        name="gas",
        discs=[Disc(position_m=p, velocity_m_s=v, radius_m=0.5) for p, v in zip(places, velocities, strict=True)],
        walls=[Wall(point_m=wall[:2], normal=wall[2:]) for wall in _box(discs)],
        duration_s=20.0,
    )
    trace = solve_pit(scene)
    return _hash(trace.impacts.tobytes(), trace.final_position_m.tobytes())


def _times() -> bytes:
    """Return times of impact, many of them of grazes, which only the error-free form can tell."""
    drawn = random.Random(1)
    offset = [1.0 + (k % 3 == 0) * drawn.uniform(-1.0, 1.0) * 2.0**-50 for k in range(_PAIRS)]
    place = np.array([(drawn.uniform(2.0, 9.0), y if k % 3 else 1.0) for k, y in enumerate(offset)])
    velocity = np.array([(drawn.uniform(-2.0, -1.0), drawn.uniform(-0.1, 0.1) * (k % 3 > 0)) for k in range(_PAIRS)])
    radius = np.array([0.5 * y for y in offset])
    return np.asarray(time_of_impact(np.zeros(2), np.zeros(2), radius, place, velocity, 0.5)).tobytes()


def _hash(*data: bytes) -> str:
    return hashlib.sha256(b"|".join(data)).hexdigest()


if __name__ == "__main__":
    sys.stdout.write(json.dumps(digests()))
