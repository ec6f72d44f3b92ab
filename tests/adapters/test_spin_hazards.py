"""What the engines do with spin and friction by themselves, which is why their adapters set them up as they do.

The law is `tests.validation.exact_impact`. A disc of radius 1/2 that is thrown at a floor as `Thrown` has it by default
slips at 2 m/s and approaches at 3. With friction 0.1 and restitution 1 it slides, and leaves with (1.4, 3) and -2.4.
"""

import importlib
import math
from collections.abc import Callable
from dataclasses import replace
from itertools import product
from typing import Any

import pytest
from tests.adapters import bare_impacts
from tests.adapters.bare_impacts import DT_S, LATE, RADIUS_M, Left, Thrown
from tests.cases import each, release_after
from tests.scene_builders import Named
from tests.validation.exact_impact import Body, Law, resolve_exact_impact

FLOOR = Body((0, 0), 0, math.inf, math.inf, (0, 0))

#: What is wrong by an arm that half the overlap is missing of, and by 32-bit floats at speeds of a few m/s.
CLOSE = 3 * LATE
SINGLE = 2e-6

#: Starts, evenly spread over a step: by how much of it the overlap is seen after the touch.
LATES = tuple(LATE + k / 16 for k in range(16))

#: Where friction acts in the middle of the overlap, an approach at 3 m/s shortens the arm by up to this part.
SHORTER = 3.0 * DT_S / 2 / RADIUS_M

#: Settings of one pass that solves push and friction in turn, and of friction that ends the slip in a step. The
#: regularisation is compensated: 1/m along the normal, 3/m along the slip of a disc of inertia factor 1/2.
IN_TURN = 'cone="elliptic" solver="PGS" iterations="1"'
MADE_UP = (0.9999 + 0.0001 / 3) / DT_S


def law(thrown: Thrown, friction: float, within: float, **more: float) -> Any:
    """Return what velocity and spin after the impact must be to a tolerance."""
    return pytest.approx(compute_law(thrown, friction, **more), abs=within)


def compute_law(thrown: Thrown, friction: float, inertia: float = 0.125, slip_kept: float = 0.0) -> Left:
    """Return velocity and spin after the impact by the law, `slip_kept` being the tangential restitution."""
    disc = Body(thrown.velocity, thrown.spin, 1, inertia, (0, -RADIUS_M))
    after, _, _ = resolve_exact_impact(disc, FLOOR, (0, -1), Law(thrown.restitution, friction, slip_kept))
    x, y = after.velocity
    return (float(x), float(y), float(after.spin))


def format_pair(friction: float) -> str:
    return f'friction="{friction!r} {friction!r} 0 0 0" solreffriction="0 {-MADE_UP!r}"'


def square_roots(friction: float) -> tuple[float, float]:
    return (math.sqrt(friction), math.sqrt(friction))


def test_law_gives_the_quoted_answer() -> None:
    """With friction 0.1 and a push of 6 N s the disc loses 0.6 m/s and gains 0.6 / 2 / (1/8) rad/s of spin."""
    assert compute_law(Thrown(), 0.1) == pytest.approx((1.4, 3.0, -2.4), abs=1e-15)


@each("friction", release_after(1, [0.1, 10.0, 0.01, 0.5]))
@each(
    "spin, restitution",
    [(0.0, 0.5), (-10.0, 0.0), (10.0, 1.0), *release_after(0, product((0.0, -10.0, 10.0), (0.0, 0.5, 1.0)))],
)
def test_engines_follow_the_friction_law_with_the_right_settings(
    named: Named, restitution: float, spin: float, friction: float
) -> None:
    """Sliding or sticking, with spin either way, each bare engine follows the law, except for a shortened arm."""
    thrown, pair = Thrown(spin=spin, restitution=restitution), format_pair(friction)
    product, mean = (replace(thrown, friction=given) for given in (square_roots(friction), (friction, friction)))
    expected = compute_law(thrown, friction)
    found: dict[str, tuple[Callable[[], Left], float]] = {
        "pymunk": (lambda: bare_impacts.pymunk(product), 1e-14),
        "pybullet": (lambda: bare_impacts.pybullet(product), 1e-14),
        "mujoco": (lambda: bare_impacts.mujoco(thrown, IN_TURN, pair), CLOSE),
        "box2d": (lambda: bare_impacts.box2d(mean), SINGLE),
    }
    for name, (throw, tolerance) in found.items():
        named(name)
        assert throw() == pytest.approx(expected, abs=tolerance * 10), name  # surfaces at up to 10 m/s


@each(
    "name, combine",
    [
        ("pymunk", lambda a, b: a * b),
        ("pybullet", lambda a, b: a * b),
        ("box2d", lambda a, b: math.sqrt(a * b)),
        ("mujoco", max),
    ],
)
@each("frictions", [(0.4, 0.1), *(pytest.param(pair, marks=pytest.mark.long) for pair in ((0.1, 0.4), (0.2, 0.3)))])
def test_engines_combine_frictions_as_documented(
    named: Named, name: str, combine: Callable[[float, float], float], frictions: tuple[float, float]
) -> None:
    """Pymunk and PyBullet use the product of two frictions, Box2D the geometric mean, and MuJoCo the maximum."""
    named(name)
    throw: Callable[[Thrown], Left] = {
        "pymunk": bare_impacts.pymunk,
        "pybullet": bare_impacts.pybullet,
        "box2d": bare_impacts.box2d,
        "mujoco": lambda thrown: bare_impacts.mujoco(thrown, IN_TURN),
    }[name]
    for late in LATES:
        # Along the floor at 100 m/s, so that it slides at any of these.
        x, _, _ = throw(Thrown(velocity=(100.0, -3.0), friction=frictions, restitution=0.0, late=late))
        assert (100.0 - x) / 3.0 == pytest.approx(combine(*frictions), rel=1e-5)


def _measure_spin_after_a_second(spin: float, *, maximal: bool, **dynamics: float) -> float:
    pybullet: Any = importlib.import_module("pybullet")
    client = pybullet.connect(pybullet.DIRECT)
    ball = pybullet.createCollisionShape(pybullet.GEOM_SPHERE, radius=RADIUS_M, physicsClientId=client)
    body = pybullet.createMultiBody(1, ball, useMaximalCoordinates=maximal, physicsClientId=client)
    if dynamics:
        pybullet.changeDynamics(body, -1, physicsClientId=client, **dynamics)
    pybullet.setPhysicsEngineParameter(fixedTimeStep=DT_S, physicsClientId=client)
    pybullet.resetBaseVelocity(body, [0, 0, 0], [0, 0, spin], client)
    for _ in range(240):
        pybullet.stepSimulation(client)
    left = float(pybullet.getBaseVelocity(body, client)[1][2])
    pybullet.disconnect(client)
    return left


@each(
    "spin, left, maximal, dynamics",
    [
        (10.0, pytest.approx(6.9, abs=0.01), False, {}),
        (90.0, pytest.approx(19.0, abs=0.01), False, {}),
        (10.0, 10.0, False, {"angularDamping": 0}),
        (10.0, pytest.approx(10.0, rel=240 * 2.0**-53), True, {}),
        (150.0, 100.0, False, {"angularDamping": 0}),
        (150.0, pytest.approx(150.0, rel=240 * 2.0**-53), True, {"angularDamping": 0}),
    ],
)
def test_default_pybullet_damps_and_clamps_spin(
    named: Named, spin: float, left: object, maximal: bool, dynamics: dict[str, float]
) -> None:
    """A free multibody's spin is damped by default, and clamped to 100 rad/s, unless coordinates are maximal."""
    named("pybullet")
    assert _measure_spin_after_a_second(spin, maximal=maximal, **dynamics) == left


@pytest.mark.long
def test_pybullet_multibody_needs_inertia_about_all_axes(named: Named) -> None:
    """With inertia [0, 0, I] friction does not spin a multibody; with [I, I, I] or maximal it follows the law."""
    named("pybullet")
    for late in LATES:
        thrown = Thrown(spin=5.0, friction=square_roots(0.1), late=late)
        assert bare_impacts.pybullet(thrown, maximal=False, planar=True) == pytest.approx((1.4, 3.0, 5.0), abs=1e-14)
        expected = pytest.approx(compute_law(thrown, 0.1), abs=1e-14)
        assert bare_impacts.pybullet(thrown, maximal=False) == expected
        assert bare_impacts.pybullet(thrown, maximal=True, planar=True) == expected


def test_pybullet_ignores_a_changed_inertia_in_the_first_step(named: Named) -> None:
    """With maximal coordinates a disc that touches in its first step has a sphere's inertia, 2/5, not its own."""
    named("pybullet")
    at_once, later = (Thrown(friction=square_roots(10.0), steps_before=steps) for steps in (0.0, 1.0))
    assert bare_impacts.pybullet(at_once) == law(at_once, 10.0, 1e-14, inertia=0.1)
    assert bare_impacts.pybullet(later) == law(later, 10.0, 1e-14)
    assert bare_impacts.pybullet(at_once, maximal=False) == law(at_once, 10.0, 1e-14)


@pytest.mark.long
def test_pybullet_clamps_friction_to_10(named: Named) -> None:
    """A product of frictions above 10 acts like 10, which is the declared maximum."""
    assert named("pybullet").capabilities.friction == (0.0, 10.0)
    for asked, used in ((9.0, 9.0), (10.0, 10.0), (40.0, 10.0)):
        for late in LATES:
            thrown = Thrown(velocity=(200.0, -3.0), friction=(asked, 1.0), late=late)
            assert bare_impacts.pybullet(thrown) == pytest.approx(compute_law(thrown, used), abs=1e-11)


def test_box2d_needs_two_iterations_for_friction(named: Named) -> None:
    """Box2D bounds friction by the push of the previous iteration: one iteration gives none, two are right."""
    named("box2d")
    assert bare_impacts.box2d(Thrown(), iterations=2) == pytest.approx((1.4, 3.0, -2.4), abs=SINGLE)
    for late in LATES:
        assert bare_impacts.box2d(Thrown(late=late), iterations=1) == (2.0, 3.0, 0.0)
        assert bare_impacts.box2d(Thrown(late=late), iterations=2) == pytest.approx((1.4, 3.0, -2.4), rel=SHORTER)


def test_box2d_velocity_is_nan_beyond_the_largest_friction(named: Named) -> None:
    """At the largest declared friction a disc grips the floor; at ten times that its velocity is NaN."""
    greatest = named("box2d").capabilities.friction[1]
    thrown = Thrown(friction=(greatest, greatest))
    assert bare_impacts.box2d(thrown) == pytest.approx(compute_law(thrown, 1e3), abs=SINGLE)
    assert all(map(math.isnan, bare_impacts.box2d(Thrown(friction=(10 * greatest, 10 * greatest)))))


@each("velocity_scale", [1.0, 2.0**20])
def test_box2d_limits_rotation_to_a_quarter_turn_per_step(named: Named, velocity_scale: float) -> None:
    """A body slows down to pi/2 a step, 377 rad/s here, also in scaled time; at the declared limit it does not."""
    declared = named("box2d").capabilities.max_turn_rad
    fast = Thrown(velocity=(0.0, 3.0), spin=500.0)
    below = replace(fast, spin=declared / DT_S)
    found, kept = (bare_impacts.box2d(thrown, velocity_scale=velocity_scale)[2] for thrown in (fast, below))
    assert found == pytest.approx(math.pi / 2 / DT_S, rel=1e-6)
    assert declared == pytest.approx(math.pi / 2, rel=2e-6)
    assert kept == pytest.approx(below.spin, rel=1e-7)


@each("friction, restitution", release_after(1, [(0.2, 0.5), (0.1, 0.0), (0.1, 1.0)]))
@each("solver", ["Newton", "CG", 'PGS" iterations="100'])
def test_mujoco_optimum_lifts_sliding_discs(named: Named, solver: str, friction: float, restitution: float) -> None:
    """MuJoCo's optimum adds friction times the remaining slip to the speed off the floor; one PGS pass does not."""
    named("mujoco")
    pair = format_pair(friction)
    for late in LATES:
        thrown = Thrown(velocity=(4.0, -3.0), restitution=restitution, late=late)
        x, y, spin = bare_impacts.mujoco(thrown, f'cone="elliptic" solver="{solver}"', pair)
        slip = x + RADIUS_M * spin
        assert slip > 0.1
        # The slip is that at the shortened arm.
        assert y == pytest.approx(restitution * 3.0 + friction * slip, rel=1e-4, abs=SHORTER * friction * abs(spin))
    thrown = Thrown(velocity=(4.0, -3.0), restitution=restitution)
    assert bare_impacts.mujoco(thrown, IN_TURN, pair) == pytest.approx(compute_law(thrown, friction), abs=10 * CLOSE)


@each("restitution", [0.5, 1.0])
def test_mujoco_friction_bounces_without_solreffriction(named: Named, restitution: float) -> None:
    """Only without `solreffriction` a gripped slip is reversed by the restitution along the normal."""
    named("mujoco")
    thrown = Thrown(restitution=restitution)
    bare = 'friction="10 10 0 0 0"'
    # Of its regularisation.
    assert bare_impacts.mujoco(thrown, IN_TURN, bare) == law(thrown, 10.0, 1e-3, slip_kept=restitution)
    assert bare_impacts.mujoco(thrown, IN_TURN, format_pair(10.0)) == law(thrown, 10.0, 10 * CLOSE)
    for late in LATES:
        # A shorter arm changes the slip that is given back by up to as large a part.
        near = SHORTER * 2.0 * (1 + restitution)
        found = bare_impacts.mujoco(replace(thrown, late=late), IN_TURN, bare)
        assert found == law(thrown, 10.0, near, slip_kept=restitution)


def test_mujoco_raises_small_frictions_to_1e_5(named: Named) -> None:
    """Frictions between 0 and 1e-5 (mjMINMU) act as 1e-5, which is the declared minimum."""
    declared = named("mujoco").capabilities.friction[0]
    mujoco: Any = importlib.import_module("mujoco")
    assert declared == 1e-5
    text = (
        '<mujoco><worldbody><body><freejoint/><geom size="1" friction="{} 0 0"/></body>'
        '<geom type="plane" size="0 0 1" friction="0 0 0" pos="0 0 -0.9"/></worldbody></mujoco>'
    )
    for asked, used in ((1e-7, 1e-5), (1e-5, 1e-5), (2e-5, 2e-5)):
        model = mujoco.MjModel.from_xml_string(text.format(asked))
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        assert data.contact[0].friction[0] == pytest.approx(used, rel=1e-12)


def test_mujoco_loses_small_frictions_of_heavy_bodies(named: Named) -> None:
    """MuJoCo gives no friction where 3 friction^4 over the squared mass is below 1e-10."""
    named("mujoco")
    for late in LATES:
        assert bare_impacts.mujoco(Thrown(late=late), IN_TURN, format_pair(1e-3)) == (2.0, 3.0, 0.0)
        assert bare_impacts.mujoco(Thrown(late=late), IN_TURN, format_pair(0.1), mass=3e3) == (2.0, 3.0, 0.0)
    assert bare_impacts.mujoco(Thrown(), IN_TURN, format_pair(0.1), mass=1e3) == law(Thrown(), 0.1, CLOSE)
    assert bare_impacts.mujoco(Thrown(), IN_TURN, format_pair(1e-2)) == law(Thrown(), 1e-2, CLOSE)


def test_mujoco_loses_frictions_whose_fourth_power_overflows(named: Named) -> None:
    """At the largest declared friction a disc grips; at 1e80, whose fourth power overflows, there is no friction."""
    greatest = named("mujoco").capabilities.friction[1]
    assert bare_impacts.mujoco(Thrown(), IN_TURN, format_pair(greatest)) == law(Thrown(), 1e3, 10 * CLOSE)
    for late in LATES:
        assert bare_impacts.mujoco(Thrown(late=late), IN_TURN, format_pair(1e80)) == (2.0, 3.0, 0.0)
