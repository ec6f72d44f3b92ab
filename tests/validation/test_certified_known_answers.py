"""Certified runs against closed forms: each answer must be within the proven radii."""

import math

import numpy as np
import pytest
from mpmath import mp, mpf
from tests.cases import by_group, each
from tests.scene_builders import disc_at, staged, wall_at
from tests.validation.mpmath_runs import find_outside_radii

import carom
from carom import Ring
from carom.catalogue import CatalogueScene, deviation
from carom.comparator.horizon import compute_horizon
from carom.solvers.certified.result import Degenerate, Ending

#: What rounding leaves of closed forms that are evaluated in float64, over a scene's sizes, and of radii.
BOUNDS = {"contact": 1e-14, "tables": 1e-12, "issues": 1e-12, "spin": 1e-12, "driven": 1e-12}
#: Scenes that have no certain answer, or end before it, and what is said of them.
ENDS = {
    "classics/cradle-touching": Degenerate.RESTING_CONTACT,
    "classics/one-into-two": Degenerate.SHARED_INSTANT,
    "issues/newton-3233": Degenerate.RESTING_CONTACT,
    "issues/visualchemeng-10": Degenerate.OVERLAPPING_START,
    "issues/dynamo-57": Degenerate.SHARED_INSTANT,
    "issues/pooltool-217-touching": Degenerate.TOUCHING_START,
    "issues/brax-58": Degenerate.RESTING_CONTACT,
    "spin/corner": Degenerate.SHARED_INSTANT,
    "driven/crush": Degenerate.CRUSH,
    "contact/pressed": Degenerate.RESTING_CONTACT,
    "contact/corner": Degenerate.RESTING_CONTACT,
}
#: Of a disc that lies on a wall the bodies that hold it.
HELD_BY = {"contact/pressed": (-1, 0, 1), "contact/corner": (-2, -1, 0)}
#: Where float64 has impacts of one instant in another order, or of a gas not all digits to the end.
NOT_TO_THE_END = {"issues/pooltool-217", "issues/rapier-114", "tables/corner-at-once", "tables/corner-with-losses"}
NOT_TO_THE_END |= {"engines/gas-of-25"}


@each("entries", by_group("issues", "tables", "driven", "classics"))
def test_catalogue_scenes_are_certified_with_their_known_answers(entries: list[CatalogueScene]) -> None:
    """Certified runs of catalogue scenes complete, and agree with the known answers to rounding."""
    for entry in entries:
        scene, known, certified = entry.scene, entry.known, carom.certify(entry.scene)
        bound, ended = BOUNDS.get(entry.group, 1e-13), certified.degeneracy
        if entry.name in ENDS:
            assert ended is not None, entry.name
            assert ended.kind is ENDS[entry.name], entry.name
            assert ended.bodies == HELD_BY.get(entry.name, ended.bodies), entry.name
            assert ended.proven or not known.convention, entry.name
        else:
            assert certified.ending is Ending.COMPLETED, entry.name
            radii = (
                certified.final_position_radius_m,
                certified.final_velocity_radius_m_s,
                certified.final_spin_radius_rad_s,
            )
            assert max(radius.max() for radius in radii if radius is not None) < bound, entry.name
            agrees = compute_horizon(certified, trace := carom.solve_pic(scene)).covers_the_scene
            assert agrees is (entry.name not in NOT_TO_THE_END), entry.name
            if trace.modes is not None and certified.trace.modes is not None:
                for field in {*(trace.modes.dtype.names or ())} - {"impacts"}:
                    assert trace.modes[field] == pytest.approx(certified.trace.modes[field], abs=1e-12), entry.name
                assert trace.final_position_m == pytest.approx(certified.trace.final_position_m, abs=1e-12), entry.name
                assert trace.final_velocity_m_s == pytest.approx(certified.trace.final_velocity_m_s, abs=1e-12)
            assert (trace.modes is None) == (certified.trace.modes is None), entry.name
            for k, impact in enumerate(known.impacts if entry.group == "spin" else ()):
                off = abs(certified.trace.impacts["time_s"][k] - impact.time_s)
                assert off <= certified.radii["time_s"][k] + 1e-15 * impact.time_s * (k + 1), entry.name
        # Impacts are compared up to a crush; either of two walls at a right angle may be reported first.
        if entry.name == "driven/crush" or entry.name not in {*ENDS, "issues/pooltool-217"}:
            assert deviation(certified.trace, known, scene) <= bound, entry.name


@each("ratio", [1.0, 2.0, 100.0, 12345.0, pytest.param(1e8, marks=pytest.mark.long)])
def test_galperin_impact_times_are_within_their_radii(ratio: float) -> None:
    """Masses 1 and M at a wall collide at (X - x cot(n theta) / sqrt(M)) / V, theta = atan(1 / sqrt(M))."""
    # Unfolding: a straight line crosses the rays n theta (G. Galperin, Regular and Chaotic Dynamics 8(4), 2003). For M
    # = 100^4 there are 31415 impacts, and the distance to the wall at the nearest is 1e-4 of that at the first. PIC's
    # times agree to its rounding.
    discs = disc_at(0.625, 0.0, r=0.125), disc_at(1.375, 0.0, -1.0, r=0.125, m=ratio)  # the gaps x = 1/2 and X = 1
    certified = carom.certify(staged("line", *discs, wall_at(0.0, 0.0, 1.0, 0.0), duration_s=100.0))
    assert certified.ending is Ending.COMPLETED
    with mp.workdps(60):
        theta = mp.atan(1 / mp.sqrt(mpf(ratio)))
        count = int(mp.ceil(mp.pi / theta)) - 1
        times = [1 - mp.cot(n * theta) / (2 * mp.sqrt(mpf(ratio))) for n in range(1, count + 1)]
        assert find_outside_radii(certified.trace.impacts["time_s"], certified.radii["time_s"], times) == []
    # Each impact of PIC turns the path by some tens of roundings, and near the last ray it runs almost along it.
    rounding = 64 * count * 2.0**-53 * float(max(times))
    found = carom.solve_pic(certified.trace.scene).impacts["time_s"]
    assert found == pytest.approx([float(time) for time in times], rel=rounding, abs=rounding)


@each("offset", [0.0, 0.3, -0.9, 0.999999])
def test_fixed_disc_deflects_by_pi_minus_twice_the_arcsine(offset: float) -> None:
    """The angle of deflection is pi - 2 asin(b / R), to 38 digits (Landau and Lifshitz, Mechanics, section 18)."""
    discs = [disc_at(-2.0, offset, 3.0, r=0.25), disc_at(0.0, 0.0, r=0.75, m=math.inf)]
    scene = staged("deflection", *discs, duration_s=1.0)
    certified = carom.certify(scene, digits=40)
    with mp.workdps(60):
        turned = mp.pi - 2 * mp.asin(abs(mpf(offset)))
        _, vx, vy, _, _ = (mpf(text) for text in certified.decimals[0])
        assert abs(vx - 3 * mp.cos(turned)) <= mpf(10) ** -38
        assert abs(abs(vy) - 3 * abs(mp.sin(turned))) <= mpf(10) ** -38
        found = carom.solve_pic(scene).final_velocity_m_s[0]
        # Near a graze the angle is the square root of the distance from it: its rounding grows as 1 / cos.
        known = [float(3 * mp.cos(turned)), float(mp.sign(offset) * 3 * abs(mp.sin(turned)))]
        assert found == pytest.approx(known, abs=3e-14 / math.sqrt(1 - offset**2))


@each("free_path, rings", [(0.5, False), (2.0, False), (2.0, True)])
def test_orbit_between_two_fixed_discs_diverges_at_the_known_rate(free_path: float, rings: bool) -> None:
    """An offset from the axis grows by (1 + L/R) + sqrt((1 + L/R)^2 - 1) with each bounce, on discs and on rings."""
    # It is the larger eigenvalue of a flight and an impact on a circle (Sinai 1970).
    half = free_path / 2 + 1.0
    ends = (-half, 0.0), (half, 0.0)
    posts = [Ring(centre_m=end, radius_m=0.75) if rings else disc_at(*end, r=0.75, m=math.inf) for end in ends]
    scene = staged("orbit", *posts, disc_at(0.0, 2.0**-120, 1.0, r=0.25), duration_s=40 * free_path)
    rate = 1 + free_path + math.sqrt((1 + free_path) ** 2 - 1)
    for trace, rounding in ((carom.certify(scene).trace, 1e-14), (carom.solve_pic(scene), 1e-13)):
        offsets = np.abs(trace.impacts["normal"][:, 1])
        assert len(offsets) == 40
        # The part of the offset that shrinks is left to rate^-58 of the other; the rest is float64's own rounding.
        assert offsets[30:] / offsets[29:-1] == pytest.approx(rate, rel=rounding)
