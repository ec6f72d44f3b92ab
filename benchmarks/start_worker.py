"""Timed part of `benchmarks.start`, which passes this module as text to a Python interpreter.

The interpreter can have another version of Carom, so the module uses only functions whose interface does not change.
The arguments are the task, the arrangement of the discs, and the number of discs. The task "scene" makes a scene, and
"load" loads a scene from a JSON file. The task "check" only searches a scene for overlaps, and "arrays" does the same
with `DiscArrays`. The output is the processor time in seconds, the growth of the process's peak memory in MiB, and the
outcome.
"""

from __future__ import annotations

import json
import math
import resource
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from carom import Disc, Scene, load_scene
from carom.errors import CaromError


def arranged(arrangement: str, n: int) -> dict[str, Any]:
    """Return positions, radii and masses of discs in random order."""
    rng = np.random.default_rng(1)
    rank = rng.permutation(n)
    lattice = 2.0 * np.stack(np.divmod(rank, math.isqrt(n - 1) + 1), axis=1)
    position, radius, mass = lattice, np.full(n, 0.9), np.ones(n)
    match arrangement:
        case "column":
            position = np.stack([np.zeros(n), 2.0 * rank], axis=1)
        case "random":
            position, radius = lattice + rng.uniform(-0.4, 0.4, (n, 2)), np.full(n, 0.5)
        case "ratio 1:1e6":
            radius = 10.0 ** rng.uniform(-6, 0, n)
            radius[:2] = 0.999e-6, 0.999
        case "outlier":
            position = lattice.copy()
            position[0] = 1e12, 1e12
        case "one place":
            position = np.zeros((n, 2))
        case "one place, immovable":
            position, mass = np.zeros((n, 2)), np.full(n, math.inf)
    return {"position_m": position, "radius_m": radius, "mass_kg": mass}


def _discs(columns: dict[str, Any]) -> list[dict[str, Any]]:
    names = list(columns)
    rows = zip(*(column.tolist() for column in columns.values()), strict=True)
    return [dict(zip(names, row, strict=True)) for row in rows]


def _prepared(what: str, columns: dict[str, Any]) -> Callable[[], object]:
    """Return the measured function."""
    if what == "arrays":
        from carom import DiscArrays

        try:
            from carom.model.overlap import require_apart
        except ImportError:  # In earlier versions it is a method.
            require_apart = DiscArrays.require_apart  # type: ignore[attr-defined]
        velocity = np.zeros_like(columns["position_m"])
        return lambda: require_apart(
            DiscArrays(columns["position_m"], velocity, columns["radius_m"], columns["mass_kg"])
        )
    discs = _discs(columns)
    if what == "check":
        made = tuple(Disc.model_construct(**disc) for disc in discs)
        # With discs that are already validated, a scene only searches for overlaps.
        return lambda: Scene.model_construct(name="start", duration_s=1.0, discs=made)
    if what == "load":
        path = Path(tempfile.mkdtemp()) / "scene.json"
        text = json.dumps({"name": "start", "discs": discs, "duration_s": 1.0})
        path.write_text(text.replace("Infinity", '"inf"'), encoding="utf-8")
        return lambda: load_scene(path)
    return lambda: Scene(name="start", discs=discs, duration_s=1.0)


def _main(what: str, arrangement: str, count: str) -> None:
    measured = _prepared(what, arranged(arrangement, int(count)))
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    begin = time.process_time()
    try:
        measured()
        ended = "accepted"
    except CaromError as error:
        ended = f"refused in {len(str(error).splitlines())} lines"
    seconds = time.process_time() - begin
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - memory
    print(seconds, grown / 1024, ended, sep="\t")


if __name__ == "__main__":
    _main(*sys.argv[1:])
