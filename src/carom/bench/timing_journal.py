"""The journal of a timing pass: one line a scene, since its rounds belong together and ratios are taken within them."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from carom.bench.noise import Noise, Spread
from carom.bench.timing import CellTiming, Config, SceneTiming
from carom.errors import InputError
from carom.runs.cell_score import scene_hash, versions_of
from carom.runs.environment import environment
from carom.runs.journal import LineFile
from carom.scene import Scene

__all__ = ["TimingJournal"]

_SPREADS = ("advance_s", "prepare_s", "whole_s", "empty_s", "net_s", "ratio", "whole_ratio")


class TimingJournal(LineFile):
    """Timed scenes, open for appending; the same rules as for `carom.runs.journal.Journal`.

    A scene counts as timed if it was timed on this machine, with these versions and configurations and this order.
    """

    def __init__(self, path: Path, *, resume: bool = False) -> None:
        super().__init__(path, resume=resume)
        try:
            self._found: dict[str, Any] = {}
            for number, line in enumerate(self.found.splitlines(), start=1):
                try:
                    content = json.loads(line)
                    self._found[json.dumps(content["key"], sort_keys=True)] = content
                except (ValueError, KeyError, TypeError):
                    raise InputError(f"{path}, line {number} is no timed scene; remove it, or name another") from None
        except BaseException:
            self.close()
            raise

    def find(self, scene: Scene, configs: Sequence[Config], seed: int) -> tuple[SceneTiming, str] | None:
        """Return the timing of a scene and when it was taken, None where it is still to be."""
        content = self._found.get(json.dumps(_key(scene, configs, seed), sort_keys=True))
        return None if content is None else (_decoded(content), content["date"])

    def add(self, scene: Scene, configs: Sequence[Config], timing: SceneTiming, date: str) -> None:
        """Write a timed scene."""
        content = {
            "scene": scene.name,
            "date": date,
            "key": _key(scene, configs, timing.seed),
            "rounds": timing.rounds,
            "seed": timing.seed,
            "noise": dataclasses.asdict(timing.noise),
            "timings": [
                {**dataclasses.asdict(config), **_plain(dataclasses.asdict(found))}
                for config, found in timing.timings.items()
            ],
            "untimed": [{**dataclasses.asdict(config), "reason": reason} for config, reason in timing.untimed.items()],
        }
        self.append([json.dumps(content, ensure_ascii=False, allow_nan=False, separators=(",", ":"))])
        self._found[json.dumps(content["key"], sort_keys=True)] = content


def _key(scene: Scene, configs: Sequence[Config], seed: int) -> dict[str, object]:
    here = environment({})
    return {
        "scene_sha256": scene_hash(scene),
        "configs": [[c.engine, c.profile, c.dt_s] for c in sorted(configs)],
        "versions": {engine: dict(versions_of(engine)) for engine in sorted({c.engine for c in configs})},
        "machine": [here.system, here.processor, here.cores],
        "seed": seed,
    }


def _plain(values: dict[str, object]) -> dict[str, object]:
    return {name: None if isinstance(value, float) and math.isnan(value) else value for name, value in values.items()}


def _decoded(content: dict[str, Any]) -> SceneTiming:
    timings = {}
    for entry in content["timings"]:
        spreads = {name: None if entry[name] is None else Spread(**entry[name]) for name in _SPREADS}
        call_s = math.nan if entry["call_s"] is None else entry["call_s"]
        timing: Any = CellTiming(steps=entry["steps"], rounds=entry["rounds"], call_s=call_s, **spreads)  # type: ignore[arg-type] # only the ratios may be None, and were written so
        timings[Config(entry["engine"], entry["profile"], entry["dt_s"])] = timing
    untimed = {Config(e["engine"], e["profile"], e["dt_s"]): e["reason"] for e in content["untimed"]}
    return SceneTiming(timings, untimed, content["rounds"], content["seed"], Noise(**content["noise"]))
