"""What must hold of any impact with friction, whatever its numbers: conservation, symmetry, limits and continuity."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from carom import DiscArrays
from carom.solvers.plain.bodies import Bodies
from carom.trace import ImpactRecord

#: Roundings of an impact, in units in the last place of what is compared.
CLOSE = 64 * 2.0**-52
sizes = st.floats(0.125, 8.0)
speeds = st.floats(-8.0, 8.0)
angles = st.floats(0.0, 2.0 * math.pi)


class Hit(NamedTuple):
    """Two discs in contact, that approach."""

    place: tuple[tuple[float, float], tuple[float, float]]
    velocity: tuple[tuple[float, float], tuple[float, float]]
    radius: tuple[float, float]
    mass: tuple[float, float]
    spin: tuple[float, float]
    inertia: tuple[float, float]
    restitution: float
    friction: float
    regain: float

    def after(self) -> ImpactRecord:
        start = DiscArrays(
            np.array(self.place),
            np.array(self.velocity),
            np.array(self.radius),
            np.array(self.mass),
            restitution=self.restitution,
            spin_rad_s=np.array(self.spin),
            inertia_factor=np.array(self.inertia),
            friction=self.friction,
            tangential_restitution=self.regain,
        )
        bodies = Bodies(start)
        bodies.turns = True
        return bodies.collide_pair(0, 1)

    @property
    def normal(self) -> np.ndarray:
        return np.array(self.place[1]) / math.hypot(*self.place[1])

    def speed(self) -> float:
        """Return the greatest speed, of a centre or a rim."""
        rims = np.abs(np.multiply(self.radius, self.spin))
        return float(max(np.abs(self.velocity).max(), rims.max(), 1e-3))

    def slip(self, velocity: tuple[tuple[float, float], ...], spin: tuple[float, ...]) -> float:
        (x, y), u = self.normal, np.subtract(velocity[0], velocity[1])
        return float(-u[0] * y + u[1] * x + np.dot(self.radius, spin))


@st.composite
def hits(draw: st.DrawFn) -> Hit:
    """Draw two discs in contact; the velocities are turned so that they approach."""
    angle, radius = draw(angles), (draw(sizes), draw(sizes))
    reach = sum(radius)
    n = (math.cos(angle), math.sin(angle))
    along, across = abs(draw(speeds)) + 0.125, draw(speeds)
    other = (draw(speeds), draw(speeds))
    one = (other[0] + along * n[0] - across * n[1], other[1] + along * n[1] + across * n[0])
    return Hit(
        ((0.0, 0.0), (reach * n[0], reach * n[1])),
        (one, other),
        radius,
        (draw(sizes), draw(sizes)),
        (draw(speeds), draw(speeds)),
        (draw(st.sampled_from([0.1, 0.4, 0.5, 1.0])), draw(st.sampled_from([0.1, 0.4, 0.5, 1.0]))),
        draw(st.floats(0.0, 1.0)),
        draw(st.sampled_from([0.0, 0.01, 0.1, 0.5, 1.0, 1e3])),
        draw(st.floats(-1.0, 1.0)),
    )


def energy(hit: Hit, velocity: np.ndarray, spin: np.ndarray) -> float:
    mass, inertia = np.array(hit.mass), np.array(hit.mass) * hit.inertia * np.square(hit.radius)
    return float((mass * np.square(velocity).sum(axis=1)).sum() + (inertia * np.square(spin)).sum()) / 2


def states(hit: Hit) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return velocities and spins before and after."""
    record = hit.after()
    assert record.spins is not None
    after = np.array([record.velocity_first_after, record.velocity_second_after])
    return np.array(hit.velocity), np.array(hit.spin), after, np.array(record.spins[2:])


@given(hits())
def test_energy_never_grows_and_is_lost_as_derived(hit: Hit) -> None:
    """Energy falls by (1 - e^2) M w_n^2/2 + T (s - T/(2 M_t)), each part of which is 0 or more."""
    v, w, v2, w2 = states(hit)
    im = 1.0 / np.array(hit.mass)
    mass, loose = 1.0 / im.sum(), (im * (1.0 + 1.0 / np.array(hit.inertia))).sum()
    approach, slip = float((v[0] - v[1]) @ hit.normal), hit.slip(hit.velocity, hit.spin)
    push = (1.0 + hit.restitution) * approach * mass
    t = float(np.clip((1.0 + hit.regain) * slip / loose, -hit.friction * push, hit.friction * push))
    lost = (1.0 - hit.restitution**2) * mass * approach**2 / 2 + t * (slip - t * loose / 2)
    before = energy(hit, v, w)
    assert abs(before - energy(hit, v2, w2) - lost) <= CLOSE * before
    assert lost >= -CLOSE * before


@given(hits())
def test_momentum_and_angular_momentum_about_the_contact_are_kept(hit: Hit) -> None:
    """No impulse at the point of contact has a moment about it; impulses on both bodies are opposite."""
    v, w, v2, w2 = states(hit)
    mass, radius = np.array(hit.mass), np.array(hit.radius)
    inertia = mass * hit.inertia * radius**2
    np.testing.assert_allclose(mass @ v2, mass @ v, rtol=0, atol=CLOSE * mass.sum() * hit.speed() * 4)
    x, y = hit.normal
    arm = np.array([-radius[0], radius[1]])  # from the contact to each centre, along the normal

    def about_contact(velocity: np.ndarray, spin: np.ndarray) -> float:
        return float((mass * arm * (x * velocity[:, 1] - y * velocity[:, 0])).sum() + (inertia * spin).sum())

    scale = float((mass * radius).sum() * (hit.speed() + np.abs(w2 * radius).max()))
    assert abs(about_contact(v2, w2) - about_contact(v, w)) <= CLOSE * scale * 4


@given(hits())
def test_slip_and_approach_end_as_the_coefficients_say(hit: Hit) -> None:
    """The normal velocity is turned round by e; the slip, where the discs stick, by b: ended, kept or turned round."""
    for regain in (-1.0, 0.0, 1.0, hit.regain):
        held = hit._replace(friction=1e9, regain=regain)
        v, _, v2, w2 = states(held)
        scale = CLOSE * 8 * (held.speed() + float(np.abs(w2 * held.radius).max()))
        assert abs(float((v2[0] - v2[1]) @ hit.normal) + hit.restitution * float((v[0] - v[1]) @ hit.normal)) <= scale
        slip = held.slip(held.velocity, held.spin)
        assert abs(held.slip(tuple(map(tuple, v2)), tuple(w2)) + regain * slip) <= scale


@given(hits())
def test_a_mirror_turns_spins_round_and_a_boost_changes_nothing(hit: Hit) -> None:
    """Seen in a mirror spins have the other sign; seen from a moving frame, of whole speeds, nothing else changes."""
    _, _, v2, w2 = states(hit)
    mirrored = hit._replace(
        place=(hit.place[0], (-hit.place[1][0], hit.place[1][1])),
        velocity=((-hit.velocity[0][0], hit.velocity[0][1]), (-hit.velocity[1][0], hit.velocity[1][1])),
        spin=(-hit.spin[0], -hit.spin[1]),
    )
    _, _, mirror_v, mirror_w = states(mirrored)
    assert mirror_v.tolist() == (v2 * [-1.0, 1.0]).tolist()
    assert mirror_w.tolist() == (-w2).tolist()
    boosted = hit._replace(
        velocity=((hit.velocity[0][0] + 3, hit.velocity[0][1] - 2), (hit.velocity[1][0] + 3, hit.velocity[1][1] - 2))
    )
    _, _, boost_v, boost_w = states(boosted)
    scale = 16 * CLOSE * (hit.speed() + 3.0) * (1.0 + hit.friction) * max(hit.mass) / min(hit.mass)
    np.testing.assert_allclose(boost_v - [3.0, -2.0], v2, rtol=0, atol=scale)
    np.testing.assert_allclose(boost_w * hit.radius, w2 * hit.radius, rtol=0, atol=scale * 20)


@settings(max_examples=50)
@given(hits())
def test_little_friction_is_nearly_none_and_much_is_stick(hit: Hit) -> None:
    """As friction goes to 0 the impact becomes the smooth one, linearly; beyond what sticks, more changes no bit."""
    _, _, smooth_v, smooth_w = states(hit._replace(friction=0.0))
    assert smooth_w.tolist() == list(hit.spin)
    for friction in (1e-6, 1e-9, 1e-12):
        _, _, v, w = states(hit._replace(friction=friction))
        # T is f J at most; a disc turns by T / (k m R), k being 1/10 or more.
        push = 2.0 * 64.0 * friction
        assert np.abs(v - smooth_v).max() <= push + CLOSE * hit.speed()
        assert np.abs(w - smooth_w).max() <= push / min(hit.inertia) / min(hit.radius) + CLOSE * np.abs(smooth_w).max()
    _, _, stick_v, stick_w = states(hit._replace(friction=1e9))
    _, _, more_v, more_w = states(hit._replace(friction=1e150))
    assert more_v.tolist() == stick_v.tolist()
    assert more_w.tolist() == stick_w.tolist()
