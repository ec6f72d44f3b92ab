"""Scenes with the most points, legs, discs and walls of a file: each command ends in bounded time and memory."""

import json
import math
import os
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from random import Random
from typing import Any

from tests.processes import PATIENT_S

#: Most seconds of processor time, and bytes, of one command; its engines have limits of their own.
MOST_S, MOST_BYTES = 120.0, 2e9
COMMANDS = (
    "run FILE -e pit -e pymunk --no-timing --fail-on never --time-limit 5 --memory-limit 800",
    "certify FILE --time-budget 5 --max-impacts 10",
    "scenes FILE",
    "play FILE -e none --no-open --out PAGE",
    "advise FILE -e pit --budget 2000 --time-limit 5",
)


def attack(rng: Random, folder: Path) -> Iterator[str]:
    """Scenes with 1e5 points, legs, discs or walls.

    The command exits with a code from 0 to 4, within 2 minutes of processor time and 2 GB.
    """
    while True:
        kind = rng.choice([*SCENES])
        scene, path = SCENES[kind](rng), folder / "scene.json"
        path.write_text(json.dumps({"name": kind, "duration_s": 1.0, **scene}))
        names = {"FILE": str(path), "PAGE": str(folder / "page.html")}
        command = [names.get(word, word) for word in rng.choice(COMMANDS).split()]
        yield _lost(command, f"{kind}, {path.stat().st_size >> 10} KB: {command[0]}", folder)


def _lost(command: list[str], what: str, folder: Path) -> str:
    with (folder / "said").open("wb") as said:
        process = subprocess.Popen([sys.executable, "-m", "carom", *command], stdout=said, stderr=said)
        killer = threading.Timer(10 * PATIENT_S, process.kill)
        killer.start()
        _, status, used = os.wait4(process.pid, 0)
        killer.cancel()
    process.returncode = code = os.waitstatus_to_exitcode(status)
    text = (folder / "said").read_bytes()
    if code not in range(5) or b"Traceback" in text:
        return f"{what}: exit code {code}: {text[-500:]!r}"
    if used.ru_utime + used.ru_stime > MOST_S or used.ru_maxrss * 1024 > MOST_BYTES:
        return f"{what}: {used.ru_utime + used.ru_stime:.0f} s of processor time, {used.ru_maxrss >> 10} MB"
    return ""


def _disc(x: float, y: float, radius: float = 0.25, **fields: Any) -> dict[str, Any]:
    return {"position_m": [x, y], "radius_m": radius, **fields}


MOVING = [_disc(0.0, 0.0, velocity_m_s=[3.0, 2.0]), _disc(2.0, 0.5, velocity_m_s=[-3.0, 1.0])]


def _polygon(rng: Random, *, points: int = 100_000) -> dict[str, Any]:
    """Return discs in a polygon, round or ragged, with the given number of corners."""
    depth = rng.choice((0.0, 1e-4, 0.5))
    far = [9 + depth * (k % 2) for k in range(points)]
    angles = [math.tau * k / points for k in range(points)]
    corners = [[r * math.cos(angle), r * math.sin(angle)] for r, angle in zip(far, angles, strict=True)]
    return {"discs": MOVING, "walls": [{"points_m": corners, "closed": True, "half_width_m": rng.choice((0.0, 0.1))}]}


def _stairs(rng: Random) -> dict[str, Any]:
    """Return discs above chains of 1e5 points in all, with arcs."""
    chains = rng.choice((1, 10, 1000))
    points = 100_000 // chains
    steps = [[[0.01 * i, -5.0 - 3.0 * k + 0.5 * (i % 2)] for i in range(points)] for k in range(chains)]
    walls = [{"points_m": corners, "bulges": [0.2] * (points - 1)} for corners in steps]
    return {"discs": MOVING, "walls": walls, "gravity_m_s2": [0.0, -9.8]}


def _legs(rng: Random) -> dict[str, Any]:
    """Return a disc between driven discs, and above a driven wall, of 1e4 legs each."""
    count = rng.choice((1000, 10_000, 10_001, 100_000))
    legs = [{"from_s": k / count, "velocity_m_s": [0.1 * (-1) ** k, 0.0]} for k in range(count)]
    driven = [_disc(3.0 * k, 5.0, mass_kg="inf", driven=True, legs=legs) for k in range(10)]
    return {"discs": [*MOVING, *driven], "walls": [{"point_m": [0.0, -3.0], "normal": [0.0, 1.0], "legs": legs}]}


def _discs(rng: Random) -> dict[str, Any]:
    count = rng.choice((10_000, 100_000, 100_001))
    side = math.isqrt(count) + 1
    return {"discs": [_disc(k % side, k // side, velocity_m_s=[rng.uniform(-1, 1), 0.5]) for k in range(count)]}


def _walls(rng: Random) -> dict[str, Any]:
    """Return a disc in a polygon of half-planes, or among circles."""
    count = rng.choice((1000, 1001, 20_000))
    angles = [math.tau * k / count for k in range(count)]
    if rng.random() < 0.5:
        inwards = [(-math.cos(angle), -math.sin(angle)) for angle in angles]
        walls: list[dict[str, Any]] = [{"point_m": [-9 * nx, -9 * ny], "normal": [nx, ny]} for nx, ny in inwards]
    else:
        walls = [{"centre_m": [5.0 + 0.01 * k, 3.0], "radius_m": 0.001} for k in range(count)]
    return {"discs": MOVING, "walls": walls}


SCENES = {"polygon": _polygon, "stairs": _stairs, "legs": _legs, "discs": _discs, "walls": _walls}
