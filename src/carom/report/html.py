"""The report as one HTML file: no script, nothing fetched, every name escaped."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from carom.report import phrases, wording
from carom.report.certified_reach import CERTIFIED_NOTE
from carom.report.chart import velocity_chart, wrong_chart
from carom.report.divergences import Divergence
from carom.report.error_map import MAP_SCENES, build_error_map, error_map_figure
from carom.report.extra import rendered
from carom.report.picture import Pair, draw_pair
from carom.report.price import price_lines
from carom.report.view import View

__all__ = ["html"]


@dataclass(frozen=True)
class _Shown:
    """A divergence with its pictures and caption."""

    entry: Divergence
    pair: Pair
    caption: str


def html(view: View) -> str:
    """Return the report.

    Raises:
        MissingExtraError: jinja2 or matplotlib is not installed.
    """
    trend = view.trend
    return rendered(
        "report.html.j2",
        view=view,
        phrases=phrases,
        wording=wording,
        certified_note=CERTIFIED_NOTE,
        velocity_chart=velocity_chart(trend, "Median velocity error against the step") if trend.drawable else "",
        wrong_chart=wrong_chart(trend, "Scenes with a missed or invented impact, against the step")
        if trend.drawable
        else "",
        price_lines=list(price_lines(view.prices)),
        map_velocity=_map("Velocity error of PIT, two equal discs", missed=False) if trend.drawable else "",
        map_missed=_map("Share of impacts that PIT misses, two equal discs", missed=True) if trend.drawable else "",
        map_scenes=MAP_SCENES,
        paper=_shown(view.paper),
        worst=_shown(view.worst),
        slowest=max((entry.median for entry in view.run_times), default=1.0),
    )


def _map(label: str, *, missed: bool) -> str:
    return error_map_figure(build_error_map(MAP_SCENES), label, missed=missed)


def _shown(entries: Sequence[Divergence]) -> list[_Shown]:
    shown = []
    for entry in entries:
        caption = phrases.caption(entry)
        labels = (f"What must happen in {entry.scene_name}, by PIC", f"{entry.scene_name}: {caption}")
        shown.append(_Shown(entry, draw_pair(entry, labels), caption))
    return shown
