"""Map of the errors of PIT for two equal discs, over impact parameter and speed.

Run as a script, this module draws the two figures of `docs/theory/pit.md` in its own folder.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from carom import resolve_impact, time_of_impact
from carom.report.svg import INK, build_figure, render, to_separate_svg, use_drawing_style

#: Range of the distance that a disc moves per step, divided by its radius: at most three diameters per step.
LEAST_ADVANCE, MOST_ADVANCE = 0.02, 6.0
_COLUMNS, _ROWS = 36, 24

#: Number of scenes in the map: about 300 per cell.
MAP_SCENES = 2**18

_WIDTH_IN, _HEIGHT_IN = 5.1, 3.4


@dataclass(frozen=True)
class ErrorMap:
    """Errors of PIT for many impact parameters and advances. The advance is the distance per step, in radii.

    Attributes:
        advance: Edges of the columns: relative speed times step size, divided by the radius, shape
            ``(columns + 1,)``.
        offset: Edges of the rows: impact parameter divided by the sum of the radii, shape ``(rows + 1,)``.
        velocity_error: Mean velocity error of the impacts that PIT finds, divided by the relative speed, shape ``(rows,
            columns)``; NaN where PIT finds no impact.
        missed: Fraction of the impacts that PIT misses, shape ``(rows, columns)``.
        scenes: Number of scenes in the map.
    """

    advance: NDArray[np.float64]
    offset: NDArray[np.float64]
    velocity_error: NDArray[np.float64]
    missed: NDArray[np.float64]
    scenes: int


@cache
def build_error_map(scenes: int = MAP_SCENES) -> ErrorMap:
    """Run many pairs of equal discs with PIC, and for three frames with PIT. The second disc is at rest.

    Impact parameter, advance and phase come from a quasi-random sequence that fills the unit cube evenly: multiples of
    the powers of 1/x, where x^4 = x + 1 (M. Roberts, The unreasonable effectiveness of quasirandom sequences, 2018).
    Lengths are in radii, times in steps, so the speed is the advance.

    Args:
        scenes: Number of scenes.
    """
    root = 1.2207440846057596  # The root of x^4 = x + 1.
    k = np.arange(1, scenes + 1)[:, None]
    offset, along, phase = ((0.5 + k * root ** -np.arange(1.0, 4.0)) % 1.0).T
    advance = LEAST_ADVANCE * (MOST_ADVANCE / LEAST_ADVANCE) ** along
    contact = 2.0
    # The contact is between the first and the second frame, so two more frames decide the result.
    start = -contact * np.sqrt(1.0 - offset**2) - advance * (1.0 - phase)
    nothing = np.zeros(scenes)
    first, second = np.stack([start, nothing], axis=1), np.stack([nothing, contact * offset], axis=1)
    velocity = np.stack([advance, nothing], axis=1)
    rest = np.zeros_like(velocity)
    instant = time_of_impact(first, velocity, 1.0, second, rest, 1.0)
    exact, _ = resolve_impact(velocity, 1.0, rest, 1.0, second - (first + velocity * np.reshape(instant, (-1, 1))))
    found, sampled = np.zeros(scenes, np.bool_), velocity.copy()
    for frame in range(3):
        apart = second - (first + velocity * frame)
        seen = ~found & (np.sum(apart * velocity, axis=1) > 0.0) & (np.hypot(*apart.T) <= contact)
        sampled[seen] = resolve_impact(velocity[seen], 1.0, rest[seen], 1.0, apart[seen])[0]
        found |= seen
    error = np.hypot(*(sampled - exact).T) / advance
    column = np.minimum((along * _COLUMNS).astype(np.intp), _COLUMNS - 1)
    row = np.minimum((offset * _ROWS).astype(np.intp), _ROWS - 1)
    cell, cells = row * _COLUMNS + column, _ROWS * _COLUMNS
    total = np.bincount(cell, minlength=cells)
    hits = np.bincount(cell, weights=found, minlength=cells)
    errors = np.bincount(cell, weights=np.where(found, error, 0.0), minlength=cells)
    with np.errstate(invalid="ignore"):
        mean, missed = errors / hits, 1.0 - hits / total
    return ErrorMap(
        advance=LEAST_ADVANCE * (MOST_ADVANCE / LEAST_ADVANCE) ** (np.arange(_COLUMNS + 1) / _COLUMNS),
        offset=np.arange(_ROWS + 1) / _ROWS,
        velocity_error=mean.reshape(_ROWS, _COLUMNS),
        missed=missed.reshape(_ROWS, _COLUMNS),
        scenes=scenes,
    )


def error_map_figure(found: ErrorMap, label: str, *, missed: bool) -> str:
    """Return one half of the map as SVG: the velocity error of found impacts, or the fraction of missed impacts.

    Args:
        found: The map.
        label: Accessible name of the figure.
        missed: Whether to draw the fraction of missed impacts.
    """
    with use_drawing_style():
        from matplotlib.colors import BoundaryNorm

        figure = build_figure(_WIDTH_IN, _HEIGHT_IN)
        axes = figure.add_axes((0.13, 0.16, 0.70, 0.80))
        values = found.missed if missed else found.velocity_error
        levels = [k / 10 for k in range(11)] if missed else [0.0, 1e-3, 3e-3, 0.01, 0.03, 0.1, 0.3, 1.0]
        across = np.log10(np.sqrt(found.advance[:-1] * found.advance[1:]))
        up = 0.5 * (found.offset[:-1] + found.offset[1:])
        # Filled contours are vector graphics. A raster would put a bitmap into the SVG.
        image = axes.contourf(
            across, up, np.ma.masked_invalid(values), levels, cmap="cividis", norm=BoundaryNorm(levels, 256)
        )
        offset = np.linspace(0.0, 1.0, 200)
        edge = 2.0 * np.sqrt(1.0 - offset**2)
        shown = edge >= LEAST_ADVANCE
        axes.plot(np.log10(edge[shown]), offset[shown], color="#ffffff", linewidth=1.2)
        ticks = [0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0]
        axes.set_xticks(np.log10(ticks), [f"{tick:g}" for tick in ticks])
        axes.set_xlim(across[0], across[-1])
        axes.set_ylim(up[0], up[-1])
        axes.set_xlabel("relative speed × step / radius")  # noqa: RUF001 - the multiplication sign is meant
        axes.set_ylabel("impact parameter / contact distance", labelpad=2)
        bar = figure.colorbar(image, cax=figure.add_axes((0.86, 0.16, 0.025, 0.80)))
        bar.outline.set_edgecolor(INK)
        bar.set_label("share of impacts missed" if missed else "velocity error / relative speed, mean", labelpad=2)
        return render(figure, label)


if __name__ == "__main__":
    for part, what in ((False, "velocity error"), (True, "share of impacts missed")):
        svg = error_map_figure(build_error_map(), f"PIT of two discs: {what}", missed=part)
        path = Path(__file__).with_name(f"error-map-{'missed' if part else 'velocity'}.svg")
        path.write_text(to_separate_svg(svg), encoding="utf-8")
