"""Unexpected behaviour of DART and Drake, compared with laws of mechanics."""

import math
from typing import Any

import pytest
from tests.cases import each
from tests.engines.impact_scenes import PHASES
from tests.scene_builders import Drive, disc_at, staged, wall_at

from carom import Scene
from carom.engines.api import Adapter

DT_S = 1 / 256

#: DART_CFM: the diagonal of DART's contact problem is made larger by this part.
MIXING = 1e-5


def _build_closing_discs(speed: float, phase: float) -> Scene:
    """Stage two discs of 5 m that close at twice the speed, a tenth of a second and a part of a step apart."""
    gap = (0.2 + 2 * phase * DT_S) * speed
    return staged("hazard", disc_at(-5 - gap / 2, 0, speed, r=5), disc_at(5 + gap / 2, 0, -speed, r=5), duration_s=0.2)


@each("speed", [50.0, 80.0, 100.0])
def test_dart_separates_discs_at_100_m_per_s_at_most(dart: Adapter, drive: Drive, speed: float) -> None:
    """DART limits the separation of elastic discs to 100 m/s from any start, and the adapter warns of it."""
    for phase in PHASES:
        seen = drive(dart, _build_closing_discs(speed, phase), DT_S)
        parting = seen[-1].velocity_m_s[1, 0] - seen[-1].velocity_m_s[0, 0]
        # The impulse is short by the mixing of what it should be: of the closing speed and that of the bounce.
        assert parting == pytest.approx(100 - MIXING * (2 * speed + 100), abs=100 * MIXING**2 * 10)
        assert any("100 m/s at most" in one.warning for one in seen) == (speed > 50)


@pytest.mark.usefixtures("dart")
def test_dart_replaces_a_restitution_above_one_by_zero(capfd: pytest.CaptureFixture[str]) -> None:
    """DART multiplies two restitutions; of 2 and 0.5 it makes 0 instead of 1, with a warning on stderr."""
    import dartpy

    world: Any = dartpy.simulation.World()
    world.setGravity([0, 0, 0])
    discs = []
    for x, speed, restitution in ((-2, 1, 2.0), (0, 0, 0.5)):
        skeleton = dartpy.dynamics.Skeleton(f"disc at {x}")
        _, body = skeleton.createTranslationalJoint2DAndBodyNodePair()
        node = body.createShapeNode(dartpy.dynamics.SphereShape(0.5))
        node.createCollisionAspect()
        node.createDynamicsAspect()
        node.getDynamicsAspect().setRestitutionCoeff(restitution)
        skeleton.setPositions([x, 0])
        skeleton.setVelocities([speed, 0])
        world.addSkeleton(skeleton)
        discs.append(skeleton)
    for _ in range(1200):
        world.step()
    assert discs[1].getVelocities()[0] - discs[0].getVelocities()[0] == pytest.approx(0.0, abs=0.02)
    assert "Invalid restitution" in capfd.readouterr().err


def test_dart_loses_2e_5_of_the_speed_per_bounce(dart: Adapter, drive: Drive) -> None:
    """DART's constraint mixing takes 2e-5 of the speed at each of at least ten elastic bounces."""
    wall = wall_at(-1, 0, 1, 0), wall_at(1, 0, -1, 0)
    for phase in PHASES:
        seen = drive(dart, staged("hazard", disc_at(phase * 4 * DT_S, 0, 4), *wall, duration_s=3.0), DT_S)
        bounces = sum(len(one.contacts) for one in seen)
        assert bounces >= 10
        kept = (2 / (1 + MIXING) - 1) ** bounces
        assert abs(seen[-1].velocity_m_s[0, 0]) / 4 == pytest.approx(kept, abs=1e-12)


def test_drake_reports_contacts_that_end_within_a_step(drake: Adapter, drive: Drive) -> None:
    """In Drake discs never overlap at the end of a step, and yet the impact is reported in one step."""
    scene = staged("head-on", disc_at(-1.5, 0, 2), disc_at(1.5, 0, -2), duration_s=1.0)
    seen = drive(drake, scene, 1 / 60)
    assert min(math.dist(*one.position_m) - 1.0 for one in seen) > 0
    assert [len(one.contacts) for one in seen].count(1) == 1
