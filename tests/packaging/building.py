"""Functions that build and install Carom offline, with the tools of the test environment."""

import json
import os
import shutil
import subprocess
import sys
import sysconfig
from collections.abc import Mapping
from pathlib import Path
from typing import Any

Done = subprocess.CompletedProcess[str]

ROOT = Path(__file__).resolve().parents[2]


def run(*command: str | Path, cwd: Path = ROOT, check: bool = True, env: Mapping[str, str] | None = None) -> Done:
    """Run a command in a folder; an unexpected failure shows its output."""
    words, variables = [str(part) for part in command], {**os.environ, **(env or {})}
    done = subprocess.run(words, check=False, capture_output=True, text=True, cwd=cwd, env=variables)
    assert not check or done.returncode == 0, done.stdout + done.stderr
    return done


def copy_tree(target: Path) -> Path:
    """Copy all files that git tracks or does not ignore, and return the copy; it contains no builds."""
    listed = run("git", "ls-files", "--cached", "--others", "--exclude-standard", "-z").stdout
    for name in listed.rstrip("\0").split("\0"):
        if (ROOT / name).exists():  # a deleted file is listed until that is committed
            (target / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, target / name)
    return target


def make_wheel(tree: Path, out: Path, env: Mapping[str, str]) -> Done:
    """Build the wheel of a tree like `pip install`; environment variables choose the compiler."""
    pip = (sys.executable, "-m", "pip", "--disable-pip-version-check")
    offline = ("--no-build-isolation", "--no-deps", "--no-index")
    return run(*pip, "wheel", "-v", *offline, "--wheel-dir", out, tree, check=False, env=env)


def install(wheel: Path, target: Path) -> Path:
    """Install a wheel, without what it depends on, into a folder of its own."""
    pip = (sys.executable, "-m", "pip", "--disable-pip-version-check")
    run(*pip, "install", "--quiet", "--no-deps", "--no-index", "--target", target, wheel)
    return target


def run_bits(site: Path | None, away: Path) -> dict[str, Any]:
    """Return what ``bits.py`` prints of the Carom of a folder, started somewhere else; None for this environment's."""
    # Without `site`, an editable install of this environment can't fill in what the folder lacks.
    options: list[str] = []
    env: dict[str, str] = {}
    if site is not None:
        options.append("-S")
        env["PYTHONPATH"] = os.pathsep.join([str(site), sysconfig.get_path("purelib")])
    done = run(sys.executable, *options, Path(__file__).with_name("bits.py"), cwd=away, env=env)
    return dict(json.loads(done.stdout))
