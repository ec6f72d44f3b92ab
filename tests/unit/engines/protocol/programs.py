"""Programs that speak the protocol, or fail at it, as manifests in a folder."""

import json
import math
import select
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from tests.scene_builders import disc_at, staged, wall_at

from carom import Scene


def build_crowd(fall_m_s2: float, **fields: Any) -> Scene:
    """Return a scene of discs of unequal mass, one of them immovable, above a wall."""
    discs = disc_at(-2, 2, 1.5, 0.25, m=2), disc_at(1, 2.125, -1, r=0.75), disc_at(3.5, 0.5, m=math.inf)
    law = {"restitution": 0.75, "wall_restitution": 1.0, "gravity_m_s2": (0, -fall_m_s2)}
    return staged('a "quoted" crowd', *discs, wall_at(0, -0.5, 0, 1), **law, **{"duration_s": 6.0, **fields})


#: Answers every request rightly for one disc at rest, except for the lines put in front.
HONEST = """
import json, sys
for line in sys.stdin:
    request = json.loads(line)
    do = request["do"]
    answers = {
        "hello": {"protocol": 1, "version": "2.5"},
        "prepare": {"world": 7, "settings": request.get("settings")},
        "step": {"seconds": 0.25},
        "observe": {"position_m": [[0, 0]], "velocity_m_s": [[0, 0]], "unknown": "is ignored"},
        "touching": {"pairs": [[0, -1]]},
        "save": {"state": {"any": [1, None]}},
    }
    answer = answers.get(do, {})
    #HERE
    print(json.dumps(answer), flush=True)
"""


def write_manifest(folder: Path, instead: str = "", **fields: object) -> Path:
    """Write a program of Python, with these lines just before it answers, and its manifest; return the manifest."""
    lines = HONEST.replace("#HERE", instead.replace("\n", "\n    "))
    (folder / "program.py").write_text(lines, encoding="utf-8")
    told = {"name": "toy", "command": [sys.executable, "-SE", "./program.py"]} | fields
    text = "".join(f"{name} = {json.dumps(value)}\n" for name, value in told.items())
    profiles = "".join(f'[profiles.{name}]\ndescription = "A toy."\n' for name in ("default", "tuned"))
    path = folder / "engine.toml"
    path.write_text(text + profiles, encoding="utf-8")
    return path


def build_still_scene() -> Scene:
    """Return a scene of one disc at rest."""
    return staged("still", disc_at(0, 0, r=1), duration_s=1.0)


#: Time that an answer to `Talk.ask` may take, in seconds.
LIMIT_S = 120.0
TEMPLATES = Path(__file__).resolve().parents[4] / "docs" / "templates"
#: Commands that build a template next to its manifest, and the program that each needs; one needs none.
BUILDS = {
    "javascript": ("node", []),
    "cpp": ("g++", ["g++", "-std=c++17", "-O1", "-Wall", "-Wextra", "-Werror", "-o", "engine", "engine.cpp"]),
    "rust": ("rustc", ["rustc", "-D", "warnings", "-o", "engine", "engine.rs"]),
}
#: Templates; those that are compiled first take long.
LANGUAGES = ["javascript", pytest.param("cpp", marks=pytest.mark.long), pytest.param("rust", marks=pytest.mark.long)]


def build_template(language: str, folder: Path) -> Path:
    """Return a copy of a template, built as its manifest describes; without the program for that, skip the test."""
    needed, command = BUILDS[language]
    if shutil.which(needed) is None:
        pytest.skip(f"{needed} is not on the PATH")
    built = folder / language
    shutil.copytree(TEMPLATES / language, built)
    if command:
        subprocess.run(command, cwd=built, check=True)
    return built


class Talk:
    """A program, and its answers line by line."""

    def __init__(self, command: list[str], folder: Path) -> None:
        self._process = subprocess.Popen(command, cwd=folder, bufsize=0, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        self._said = b""

    def ask(self, line: bytes) -> Any:
        """Return the answer to a line."""
        assert self._process.stdin
        assert self._process.stdout
        self._process.stdin.write(line + b"\n")
        while b"\n" not in self._said:
            ready, _, _ = select.select([self._process.stdout], [], [], LIMIT_S)
            assert ready, f"no answer to {line[:200]!r}"
            chunk = self._process.stdout.read(2**16)
            assert chunk, f"it ended over {line[:200]!r}"
            self._said += chunk
        answer, _, self._said = self._said.partition(b"\n")
        assert not self._said, f"more than one answer to {line[:200]!r}"
        return json.loads(answer)

    def close(self) -> None:
        """Let it end by the end of its input, as it must."""
        for pipe in (self._process.stdin, self._process.stdout):
            assert pipe
            pipe.close()
        self._process.wait(LIMIT_S)
