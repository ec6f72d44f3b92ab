"""The checker's own books: the straight flights of every disc between its impacts, and their rounding errors.

With u = 2^-53, a flight of velocity v for a time d adds one product and one sum to a coordinate. This is at most S
before and after, which gives an error below u S + 2 u |v| d, so below 5 u S, since |v| d <= 2 S. The books do this once
a flight; a solver may do it twice (once more where it takes all discs to a new epoch). So 16 u S along both coordinates
together bound them: sqrt(2) (5 + 6) < 16, where the two halves of its flight share |v| d. A recorded time is off by 2 u
T (the sum of an epoch, its rest, and a time since; never less than the one before), at both ends of the flight: 4 u |v|
T. Errors of a disc's flights add up, from one look at the run's state to the next.

Under gravity g a flight is a parabola, ``x + d (v + g d / 2)``. Let D be the time from the disc's last impact to the
flight's end, V = |v| + |g| D, which bounds its speed all that time, and S the coordinates at the flight's beginning
and V D. Then one evaluation adds 4 u S to a coordinate. The rounding of d counts twice: 2 u S in the books, and 4 u S
in a solver, which does it twice (once to the look). The velocity at a look is off by 5 u V, and so the place later by 5
u S: sqrt(2) (6 + 16 + 5) < 39. A solver may set the disc on a wall or on a rim at an impact, which moves it by the
rounding of the gap. That is 8 u S of the place, 4 u S of the root, 6 u S of the speed at which it left: less than 20 u
S. What it predicts with is off by as much again, along both coordinates: less than 37 u S. 96 u S hold all of this. A
look is recorded to u T, too: 5 u V T. The velocity at the end of a flight is off by 4 u V in the solver, 3 u V in the
books and 5 u V from the look. With both coordinates, and 4 u |g| T, that is 20 u V + 4 u |g| T.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from tests.checker.watch import Stretch

from carom import DiscArrays

Floats = NDArray[np.float64]
Ranks = NDArray[np.intp]

#: Unit roundoff.
UNIT = 2.0**-53


@dataclass(frozen=True)
class Flights:
    """Flights, all of a disc from one look to the next in their order, then those of the next disc, then the next look.

    Attributes:
        begin_s: Time at which each begins, shape ``(m,)``, as all up to `row`.
        end_s: Time at which it ends.
        x: Centre at the beginning, in metres.
        y: See `x`.
        vx: Velocity there, in metres per second.
        vy: See `vx`.
        speed_m_s: Bound on its size anywhere on it: the size itself, where nothing falls.
        error_m: Bound on the distance between this place and the solver's, anywhere on the flight.
        size_m: Bound on the coordinates anywhere on it.
        path_m: Length of the way that the disc has come by its beginning, any constant added.
        disc: Whose it is.
        row: Number in the stretch of the impact at which it begins; -1 for the look.
        look: Number in the stretch of the look that came last.
        first: The first flight of each disc after each look, shape ``(p, n)``.
        after: The flight that begins at each impact, for either body, shape ``(k, 2)``; -1 for a wall. The flight
            before it is the one that ends there.
        gravity_m_s2: Acceleration of every movable disc.
        falls: 1.0 for a flight that feels it, else 0.0.
    """

    begin_s: Floats
    end_s: Floats
    x: Floats
    y: Floats
    vx: Floats
    vy: Floats
    speed_m_s: Floats
    error_m: Floats
    size_m: Floats
    path_m: Floats
    disc: Ranks
    row: Ranks
    look: Ranks
    first: Ranks
    after: Ranks
    gravity_m_s2: tuple[float, float]
    falls: Floats

    @property
    def fall(self) -> bool:
        """Whether there is gravity."""
        return self.gravity_m_s2 != (0.0, 0.0)

    def place(self, k: Ranks, wait_s: Floats) -> tuple[Floats, Floats]:
        """Return x and y on flights, some time after each began."""
        vx, vy = self.vx[k], self.vy[k]
        if self.fall:
            half = 0.5 * self.falls[k] * wait_s
            vx, vy = vx + self.gravity_m_s2[0] * half, vy + self.gravity_m_s2[1] * half
        return self.x[k] + vx * wait_s, self.y[k] + vy * wait_s

    def velocity(self, k: Ranks, wait_s: Floats) -> tuple[Floats, Floats]:
        """Return the velocity on flights, some time after each began."""
        vx, vy = self.vx[k], self.vy[k]
        if self.fall:
            long = self.falls[k] * wait_s
            vx, vy = vx + self.gravity_m_s2[0] * long, vy + self.gravity_m_s2[1] * long
        return vx, vy

    def velocity_error(self, k: Ranks) -> Floats:
        """Return how far the velocity at the end of flights is from the solver's at most: 0 where nothing falls."""
        by_time = 4 * math.hypot(*self.gravity_m_s2) * self.end_s[k]
        return UNIT * self.falls[k] * (20 * self.speed_m_s[k] + by_time)

    @property
    def last(self) -> Ranks:
        """The last flight of each disc before each look, shape ``(p, n)``."""
        return np.append(self.first.ravel()[1:], len(self.x)).reshape(self.first.shape) - 1


def spans(begin: Ranks, count: Ranks) -> tuple[Ranks, Ranks]:
    """Return the members of many ranges of integers, one range after another, and the number of each one's range."""
    owner = np.repeat(np.arange(len(count)), count)
    member = np.arange(len(owner)) + np.repeat(begin - (np.cumsum(count) - count), count)
    return owner, member


def build_flights(start: DiscArrays, stretch: Stretch, gravity_m_s2: tuple[float, float] = (0.0, 0.0)) -> Flights:
    """Follow every disc from its impacts; their bodies must be valid."""
    impacts = stretch.impacts
    looks, discs = len(stretch.looks) - 1, stretch.position_m.shape[1]
    bodies = np.stack([impacts["first"], impacts["second"]], axis=1)
    row, side = np.nonzero(bodies >= 0)
    look = np.repeat(np.arange(looks), np.diff(stretch.looks))
    chain = look[row] * discs + bodies[row, side]  # the flights of one disc after one look
    # Sorted by digits where the numbers are short, which takes a tenth of the time.
    order = np.argsort(chain.astype(np.uint16) if looks * discs <= 2**16 else chain, kind="stable")
    row, side, chain = row[order], side[order], chain[order]

    # Each chain begins with the flight after the look; each impact begins one more.
    impacts_of = np.bincount(chain, minlength=looks * discs)
    first = np.cumsum(impacts_of) - impacts_of + np.arange(looks * discs)
    begun = np.arange(len(chain)) + chain + 1
    after = np.full((len(impacts), 2), -1)
    after[row, side] = begun
    chain = np.repeat(np.arange(looks * discs), impacts_of + 1)
    begun_at = np.full(len(chain), -1)
    begun_at[begun] = row

    begin_s = np.repeat(np.repeat(stretch.time_s[:-1], discs), impacts_of + 1)
    begin_s[begun] = impacts["time_s"][row]
    end_s = np.append(begin_s[1:], 0.0)
    end_s[first + impacts_of] = np.repeat(stretch.time_s[1:], discs)
    duration = end_s - begin_s
    x, y = _columns(stretch.position_m[:-1], chain)
    vx, vy = _columns(stretch.velocity_m_s[:-1], chain)
    for column, k in ((vx, 0), (vy, 1)):
        given = (impacts["velocity_first_after"][:, k], impacts["velocity_second_after"][:, k])
        column[begun] = np.where(side == 0, given[0][row], given[1][row])
    falls = np.tile(start.movable.astype(np.float64), looks).repeat(impacts_of + 1) * (gravity_m_s2 != (0.0, 0.0))
    half = 0.5 * falls * duration
    way_x, way_y = (vx + gravity_m_s2[0] * half) * duration, (vy + gravity_m_s2[1] * half) * duration
    # One flight of every chain at a time, as far as chains have them.
    longest_first = first[np.argsort(-impacts_of, kind="stable")]
    chains_with = len(first) - np.cumsum(np.bincount(impacts_of))
    for step, chains in enumerate(chains_with[:-1], start=1):
        here = longest_first[:chains] + step
        x[here] = x[here - 1] + way_x[here - 1]
        y[here] = y[here - 1] + way_y[here - 1]

    speed = np.sqrt(vx * vx + vy * vy)
    if gravity_m_s2 == (0.0, 0.0):
        length = speed * duration
        size = np.maximum(np.abs(x), np.abs(y)) + length
        rounding = UNIT * (16 * size + 4 * speed * end_s)
    else:
        struck_s = np.where(impacts_of > 0, begin_s[first + impacts_of], -np.inf).reshape(looks, discs)
        struck_s = np.maximum.accumulate(np.vstack([stretch.last_impact_s, struck_s[:-1]]))
        since_s = begin_s.copy()
        since_s[first] = np.maximum(struck_s, 0.0).ravel()  # a run begins at 0
        free_s = end_s - since_s
        speed += falls * math.hypot(*gravity_m_s2) * free_s
        length = speed * duration
        size = np.maximum(np.abs(x), np.abs(y)) + speed * free_s
        rounding = UNIT * (96 * size + 5 * speed * end_s)
    # Summed along each chain. The state at the look is one flight's rounding off already.
    error = np.cumsum(rounding)
    error -= (error[first] - 2 * rounding[first])[chain]
    return Flights(
        begin_s,
        end_s,
        x,
        y,
        vx,
        vy,
        speed,
        error,
        size,
        np.cumsum(length) - length,
        chain % discs,
        begun_at,
        chain // discs,
        first.reshape(looks, discs),
        after,
        gravity_m_s2,
        falls,
    )


def _columns(state: Floats, chain: Ranks) -> tuple[Floats, Floats]:
    """Return x and y of the disc of each flight, from a state of shape ``(looks, discs, 2)``."""
    return state[..., 0].ravel()[chain], state[..., 1].ravel()[chain]
