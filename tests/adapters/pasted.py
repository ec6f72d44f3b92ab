"""What becomes of a scene by an adapter, and by the program that the adapter prints."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from carom import Scene
from carom.adapter import Adapter

State = NDArray[np.float64]


def adapters_end(adapter: Adapter, scene: Scene, profile: str, dt_s: float) -> State:
    """Return x, y, vx, vy and spin of each disc after the steps that cover the scene."""
    world = adapter.prepare(scene, adapter.profiles[profile].settings(dt_s))
    world.advance(scene.step_count(dt_s))
    seen = world.observe()
    world.close()
    spin = np.zeros(len(scene.discs)) if seen.spin_rad_s is None else seen.spin_rad_s
    return np.column_stack([seen.position_m, seen.velocity_m_s, spin])


def programs_end(text: str, folder: Path, *, node: bool = False) -> State:
    """Run a program as anybody would who has saved it, in Python or in node, and return what it prints."""
    file = folder / ("pasted.mjs" if node else "pasted.py")
    file.write_text(text)
    command = ["node"] if node else [sys.executable, "-W", "ignore"]
    done = subprocess.run([*command, str(file)], capture_output=True, text=True, check=True)
    rows = [line for line in done.stdout.splitlines() if line[:1] in "-.0123456789"]
    return np.array([[float(word) for word in row.split()] for row in rows])
