"""Writing a bench: the page, the diagrams as SVG and PNG, and every number as JSON."""

from __future__ import annotations

import dataclasses
import json
import re
from collections.abc import Mapping, Sequence
from enum import Enum
from pathlib import Path
from typing import NamedTuple

from carom.bench.results import Bench, SceneBench
from carom.report.bench import bench_document, diagrams_of
from carom.report.bench_figure import Diagram, diagram_png, diagram_svg
from carom.report.extra import require_report_extra
from carom.report.made import stamp_lines
from carom.report.records import strict
from carom.report.render import html
from carom.report.svg import alone
from carom.report.write import replace_all

__all__ = ["BenchPaths", "bench_json", "value_of", "write_bench"]

#: Raised when a field changes its meaning or goes; a new field does not raise it.
FORMAT = 1


class BenchPaths(NamedTuple):
    """The files of a bench; `diagrams` are those in the order of scenes and axes, SVG and PNG."""

    html: Path
    json: Path
    diagrams: tuple[Path, ...]


def write_bench(bench: Bench, folder: Path, axes: Sequence[Diagram] = tuple(Diagram)) -> BenchPaths:
    """Write `index.html`, `bench.json` and a diagram a scene and pair of axes, in place of older ones.

    Raises:
        MissingExtraError: jinja2 or matplotlib, the extra `report`, is not installed.
        OSError: The folder can't be written to.
    """
    require_report_extra()
    files: dict[Path, str | bytes] = {}
    label, foot = bench.plan.error.label, stamp_lines(bench.environment, bench.command)
    for scene in bench.scenes:
        for kind in diagrams_of(scene, axes):
            base = folder / f"{_file_name(scene)}-{kind.value}"
            files[base.with_name(f"{base.name}.svg")] = alone(diagram_svg(scene, kind, label))
            files[base.with_name(f"{base.name}.png")] = diagram_png(scene, kind, label, foot)
    diagrams = tuple(files)
    paths = BenchPaths(folder / "index.html", folder / "bench.json", diagrams)
    files[paths.html] = html(bench_document(bench, axes))
    files[paths.json] = bench_json(bench)
    folder.mkdir(parents=True, exist_ok=True)
    replace_all(files)
    return paths


def bench_json(bench: Bench) -> str:
    """Return every number of a bench as one JSON object."""
    scenes = [
        {
            **{f.name: value_of(getattr(s, f.name)) for f in dataclasses.fields(s) if f.name != "scene"},
            "scene": s.scene.name,
        }
        for s in bench.scenes
    ]
    content = {
        "format": FORMAT,
        "command": bench.command,
        "environment": value_of(bench.environment),
        "plan": value_of(bench.plan),
        "elapsed_s": bench.elapsed_s,
        "scenes": scenes,
    }
    return json.dumps(strict(content), ensure_ascii=False, allow_nan=False, indent=1) + "\n"


def value_of(value: object) -> object:
    """Return a result as plain lists and mappings."""
    if isinstance(value, Enum):
        return value.name.lower()
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {field.name: value_of(getattr(value, field.name)) for field in dataclasses.fields(value)}
    if isinstance(value, (list, tuple)):
        return [value_of(item) for item in value]
    return dict(value) if isinstance(value, Mapping) else value


def _file_name(scene: SceneBench) -> str:
    return re.sub(r"[^A-Za-z0-9._-]+", "-", scene.scene.name).strip("-.") or "scene"
