"""Continuous detection on and off, spheres and cylinders: what each variant of an engine shows."""

import re

import pytest
from tests.cases import each
from tests.scene_builders import Named

import carom
from carom import Disc, Scene, compare, solve_pic
from carom.catalogue import catalogue
from carom.engines.api import Adapter
from carom.execution.observation.engine_run import observe_run
from carom.report.render.markdown import render_markdown
from carom.studies.cross_check.document import cross_check_document
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


@pytest.mark.long
def test_missing_profiles_have_reasons_in_the_report() -> None:
    """For each engine and profile the report has a result, or the reason why the engine has no such profile."""
    scene = Scene(name="one", discs=[Disc(position_m=(0, 0), velocity_m_s=(1, 0), radius_m=1)], duration_s=0.1)
    results = carom.cross_check([scene], BUILT_IN, profiles=["all"], timing=False, dts=[1 / 60])
    profiles = {name for info in results.engines for name in info.profiles}
    assert profiles >= {"default", "tuned", "located", "no-ccd", "resting", "cylinder", "cylinder-plain"}
    said = render_markdown(cross_check_document(results))
    reasons = dict(re.findall(r"^- (\w+ has no profile [\w-]+): (.+)$", said, re.MULTILINE))
    assert "two-dimensional" in reasons["pymunk has no profile cylinder"]
    assert "no continuous detection" in reasons["pymunk has no profile no-ccd"]
    assert "does not shorten" in reasons["pit has no profile located"]


def test_missing_profile_is_explained_by_capabilities(engine: Adapter) -> None:
    """The reason for a missing profile follows from the engine's capabilities, so none has the generic reason."""
    for profile in {"no-ccd", "resting", "cylinder", "cylinder-plain"} - set(engine.profiles):
        assert "offers no such profile" not in explain_missing_profile(profile, engine.capabilities)
