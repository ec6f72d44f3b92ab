"""Reliability of the reference: its horizon, and when discs come to rest."""

from dataclasses import replace
from typing import Any

from tests.scene_builders import disc_at, run_cross_check, staged, wall_at

from carom.catalogue import all_scenes
from carom.execution.results import Results
from carom.model.scene import Scene
from carom.report.document import Lines, Media
from carom.report.render.markdown import render_markdown
from carom.studies.cross_check.document import cross_check_document
from carom.studies.cross_check.grid import build_grid
from carom.studies.cross_check.sections.reference import build_reference_section
from carom.studies.cross_check.sections.stepwise import build_steps_section


def list_reference_lines(scene: Scene) -> list[tuple[str, ...]]:
    """Return the lines on the reference in the report of a scene's runs by PIC and PIT."""
    section = build_reference_section(build_grid(run_cross_check([scene], ["pic", "pit"], dts=[1 / 24])))
    return [block.items for block in section.select_for(Media.TERMINAL) if isinstance(block, Lines)]


def test_report_states_horizon_as_an_estimate(results: Results) -> None:
    """If the horizon is before the last impact, the report states the reliable impacts, as an estimate."""
    name = next(iter(results.references))
    short = replace(results, horizons={name: 0.5 * float(results.references[name].impacts["time_s"][0])})
    text = render_markdown(cross_check_document(short))
    assert "0 of 1 impacts" in text
    assert "the horizon is an estimate" in text


def test_report_states_when_a_disc_comes_to_rest() -> None:
    """For a ball that lands and stays, the report states that runs are compared up to 0.5 s."""
    fields: dict[str, Any] = {"gravity_m_s2": (0.0, -9.8), "wall_restitution": 0.0, "duration_s": 2.0}
    ball = staged("mine/ball", disc_at(0.0, 1.325, r=0.1), wall_at(0.0, 0.0, 0.0, 1.0), **fields)
    told = "runs are compared up to 0.5 s of 2 s, when a disc comes to rest"
    assert any(told in line for (line,) in list_reference_lines(ball))
    assert build_steps_section(build_grid(run_cross_check([ball], ["pic", "pit"], dts=[1 / 24]))).blocks


def test_rolling_disc_is_not_reported_as_unreliable() -> None:
    """For discs that roll from the start, the only remark is that runs are compared up to 0 s."""
    told = "contact/struck: runs are compared up to 0 s of 3 s, when a disc rolls along a wall."
    assert list_reference_lines(all_scenes()["contact/struck"].scene) == [(told,)]
