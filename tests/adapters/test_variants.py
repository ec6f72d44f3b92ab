"""Continuous detection on and off, spheres and cylinders: what each variant of an engine shows."""

import re

import numpy as np
import pytest
from tests.adapters.engine_scenes import build_bullet_scene
from tests.cases import each, release_after
from tests.scene_builders import Named

import carom
from carom import Disc, Scene, compare, solve_pic
from carom.catalogue import catalogue
from carom.engines.api import Adapter
from carom.execution.job import Method
from carom.execution.observation.engine_run import observe_run
from carom.report.outcome_marks import Mark
from carom.report.render.markdown import render_markdown
from carom.studies.cross_check.document import cross_check_document
from carom.studies.cross_check.grid import build_grid
from carom.studies.cross_check.sections.scenes import explain_missing_profile

SWEPT = ["pybullet", "mujoco", "box2d"]
SOLID = ["pybullet", "mujoco"]
BUILT_IN = ["pic", "pit", "pymunk", *SWEPT]


@each("name", SWEPT)
@each("scene_name", ["paper/missed", "classics/bullet"])
def test_continuous_detection_finds_tunnelling_impacts(named: Named, name: str, scene_name: str) -> None:
    """At its own frame rate a tunnelling scene is missed with CCD off, and found with CCD on."""
    scene = catalogue()[scene_name].scene
    reference, dt_s = solve_pic(scene), 1 / scene.frame_rate_hz
    found, missed = (
        compare(reference, observe_run(named(name), scene, profile, dt_s)) for profile in ("tuned", "no-ccd")
    )
    assert (len(found.missed), len(found.spurious)) == (0, 0)
    assert len(missed.missed) == len(reference.impacts)


@each("name", release_after(0, SWEPT))
def test_continuous_detection_does_not_depend_on_the_phase(named: Named, name: str) -> None:
    """With CCD none of 24 phases of an impact at 33 radii a step is missed; without it most are."""
    adapter, dt_s = named(name), 1 / 60
    hits = {"tuned": 0, "no-ccd": 0}
    for phase in np.linspace(0, 1, 24, endpoint=False):
        for profile in hits:
            hits[profile] += len(observe_run(adapter, build_bullet_scene(phase, dt_s), profile, dt_s).impacts)
    assert hits["tuned"] == 24
    assert hits["no-ccd"] < 12


@each("name", SOLID)
def test_free_cylinders_lose_energy_and_upright_ones_do_not(named: Named, name: str) -> None:
    """Cylinders that are free to turn lose 1 % or more of the energy to tumbling; held upright they lose none."""
    scene, dt_s = catalogue()["classics/oblique-3-4-5"].scene, 1 / 240
    reference = solve_pic(scene)
    plain, cured = (
        compare(reference, observe_run(named(name), scene, profile, dt_s)) for profile in ("cylinder-plain", "cylinder")
    )
    assert plain.total.energy < -0.01
    # MuJoCo finds a cylinder's contact to ccd_tolerance, 1e-12 m of a disc of 0.25 m; a dozen of those is generous.
    assert abs(cured.total.energy) < 12 * 1e-12 / 0.25


@each("name", SOLID)
def test_upright_cylinder_equals_a_sphere_to_0_1_percent(named: Named, name: str) -> None:
    """A cylinder held upright leaves an oblique impact like a sphere, to 0.1 % of the speed."""
    scene, dt_s = catalogue()["classics/oblique-3-4-5"].scene, 1 / 240
    sphere, cylinder = (
        observe_run(named(name), scene, profile, dt_s).final_velocity_m_s for profile in ("tuned", "cylinder")
    )
    assert np.abs(sphere - cylinder).max() < 1e-3 * 5  # of 5 m/s


@pytest.mark.long
def test_missing_profiles_have_reasons_in_the_report() -> None:
    """For each engine and profile the report has a result, or the reason why the engine has no such profile."""
    scene = Scene(name="one", discs=[Disc(position_m=(0, 0), velocity_m_s=(1, 0), radius_m=1)], duration_s=0.1)
    results = carom.cross_check([scene], BUILT_IN, profiles=["all"], timing=False, dts=[1 / 60])
    grid = build_grid(results)
    profiles = {method.profile for method in grid.methods}
    own = {"frame-by-frame", "event-driven"}
    assert profiles == own | {"default", "tuned", "located", "no-ccd", "resting", "cylinder", "cylinder-plain"}
    said = render_markdown(cross_check_document(results))
    reasons = dict(re.findall(r"^- (\w+ has no profile [\w-]+): (.+)$", said, re.MULTILINE))
    for info in results.engines:
        for profile in profiles - own - set(info.profiles):
            if Method(info.name, profile).profile != profile:
                continue  # an earlier name of one that it has
            assert Method(info.name, profile) not in grid.methods
            assert f"{info.name} has no profile {profile}" in reasons
    assert "two-dimensional" in reasons["pymunk has no profile cylinder"]
    assert "no continuous detection" in reasons["pymunk has no profile no-ccd"]
    assert "does not shorten" in reasons["pit has no profile located"]
    plain = Method("mujoco", "cylinder-plain")
    assert [cell.mark for cell in grid.list_cells(plain)] == [Mark.UNGRADED]  # it has no impact


@pytest.mark.long
def test_cross_check_runs_three_profiles_by_default() -> None:
    """By default an engine runs `default`, `tuned` and `located`, the last one at the coarsest step only."""
    scene = Scene(name="one", discs=[Disc(position_m=(0, 0), velocity_m_s=(1, 0), radius_m=1)], duration_s=0.1)
    rows = carom.cross_check([scene], ["box2d"], timing=False).rows
    found: dict[int, list[str]] = {}
    for row in rows:
        found.setdefault(row.job.refinement, []).append(row.job.profile)
    assert found == {0: ["default", "tuned", "located"], 1: ["default", "tuned"], 2: ["default", "tuned"]}


def test_missing_profile_is_explained_by_capabilities(engine: Adapter) -> None:
    """The reason for a missing profile follows from the engine's capabilities, so none has the generic reason."""
    for profile in {"no-ccd", "resting", "cylinder", "cylinder-plain"} - set(engine.profiles):
        assert "offers no such profile" not in explain_missing_profile(profile, engine.capabilities)
