"""`make determinism`: tests whether engines repeat runs bit for bit, and writes the page `docs/results/determinism.md`.

The scene is a gas of 16 discs in a box, with the profiles `default` and `tuned`. Each run has a SHA-256 digest of the bits
of all final positions and velocities and of all impacts, and the digests are compared.
"""

from __future__ import annotations

import hashlib
import json
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from carom.catalogue import all_scenes
from carom.engines.registry import explain_unavailable_adapter, list_adapter_points, load_adapter
from carom.errors import CaromError
from carom.execution.job import Method
from carom.execution.observation.engine_run import observe_run
from carom.model.scene import Scene
from carom.model.trace import Trace

PAGE = Path(__file__).resolve().parents[1] / "results" / "determinism.md"
COUNTED = ("again", "after another", "another process", "two threads")
SCENE, PROFILES = "classics/gas", ("default", "tuned")

# ruff: noqa: E501 - lines of the page are as long as they are
HEAD = f"""# Determinism: are repeated runs bit-identical?

`make determinism` runs `{SCENE}` at its own frame rate on one machine. The command repeats the run in the following ways, and compares all bits of each position and velocity at the end, and of each impact.

- **again**: a second run in the same process.
- **after another**: a second run in the same process, after a run of another scene.
- **another process**: a run in its own process.
- **two threads**: two runs at once, in two threads of one process (engines from npm: in two processes). *Ended* means that the engine ended the process. *Same* means only that the runs were identical in this test.
- **order**: the discs are listed in the opposite order. A difference is not a fault, because the order of additions changes rounding.

The score counts all tests except *order*. The page [Engines over their releases](history.md) compares releases of engines.
"""


def digest(trace: Trace, *, impacts: bool = True) -> str:
    """Return a digest of a run's results."""
    found = hashlib.sha256(np.ascontiguousarray(trace.final_position_m).tobytes())
    found.update(np.ascontiguousarray(trace.final_velocity_m_s).tobytes())
    if impacts:
        found.update(trace.impacts.tobytes())
    return found.hexdigest()


def ran(engine: str, profile: str, scene: Scene) -> Trace:
    """Run a scene in this process."""
    return observe_run(load_adapter(engine), scene, profile, 1.0 / scene.frame_rate_hz)


def measured(engine: str, profile: str) -> None:
    """Print as JSON which runs of this process are bit-identical to the first run, and the digest of the first run."""
    scene, other = all_scenes()[SCENE].scene, all_scenes()["paper/late"].scene
    turned = scene.model_copy(update={"discs": scene.discs[::-1]})
    first = ran(engine, profile, scene)
    again = ran(engine, profile, scene)
    ran(engine, profile, other)
    after, back = ran(engine, profile, scene), ran(engine, profile, turned)
    back = replace(back, final_position_m=back.final_position_m[::-1], final_velocity_m_s=back.final_velocity_m_s[::-1])
    same = {
        "again": digest(again) == digest(first),
        "after another": digest(after) == digest(first),
        "order": digest(back, impacts=False) == digest(first, impacts=False),
    }
    sys.stdout.write(json.dumps({"same": same, "digest": digest(first)}) + "\n")


def threaded(engine: str, profile: str) -> None:
    """Print as JSON the digests of two simultaneous runs in two threads."""
    scene = all_scenes()[SCENE].scene
    with ThreadPoolExecutor(2) as pool:
        runs = [pool.submit(ran, engine, profile, scene) for _ in range(2)]
    sys.stdout.write(json.dumps({"digests": [digest(run.result()) for run in runs]}) + "\n")


def asked(engine: str, profile: str, how: str = "alone") -> dict[str, Any]:
    """Return what a separate process prints: a comparison of runs (`alone`), or two runs' digests (`threads`).

    Raises:
        CaromError: The process failed; the message is its last line.
    """
    command = [sys.executable, __file__, engine, profile, how]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=600)  # noqa: S603 - this script
    if done.returncode:
        raise CaromError((done.stderr.strip().splitlines() or ["the process ended without a message"])[-1])
    found: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return found


def in_threads(engine: str, profile: str, expected: str) -> str:
    """Return a word for the table, which states whether two simultaneous runs have the expected digest."""
    try:
        found = asked(engine, profile, "threads")
    except CaromError:
        return "ended"
    return "same" if found["digests"] == [expected] * 2 else "other"


def words_of(engine: str, profile: str) -> dict[str, str]:
    """Return a word for each column of the table: same, other or ended."""
    one, two = asked(engine, profile), asked(engine, profile)
    same = dict(one["same"]) | {"another process": one["digest"] == two["digest"]}
    words = {name: "same" if value else "other" for name, value in same.items()}
    return words | {"two threads": in_threads(engine, profile, one["digest"])}


def rows(lacking: list[str]) -> Iterator[list[str]]:
    """Return a row per engine and profile. Add engines that are not installed to `lacking`."""
    for engine in sorted(list_adapter_points()):
        adapter = load_adapter(engine)
        if explain_unavailable_adapter(adapter):
            lacking.append(adapter.engine.name)
            continue
        for method in dict.fromkeys(Method(engine, profile) for profile in PROFILES):
            profile = method.profile
            words = words_of(engine, profile)
            counted = [words[name] for name in COUNTED]
            yield [engine, method.profile_shown, f"{counted.count('same')} of {len(counted)}", *counted, words["order"]]


def main() -> None:
    """Run the installed engines, print the table and write the page."""
    lacking: list[str] = []
    heads = ["engine", "profile", "score", *COUNTED, "order"]
    lines = [heads, ["---"] * len(heads), *rows(lacking)]
    table = "\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n"
    missing = f"\nNot installed where this was run, and so not measured: {', '.join(lacking)}.\n" if lacking else ""
    sys.stdout.write(table + missing)
    PAGE.write_text(f"{HEAD}\n{table}{missing}", encoding="utf-8")


if __name__ == "__main__":
    if sys.argv[1:]:
        engine, profile, how = sys.argv[1:]
        (threaded if how == "threads" else measured)(engine, profile)
    else:
        main()
