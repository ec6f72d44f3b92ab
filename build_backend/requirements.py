"""Print the packages that Carom with an extra requires: ``python build_backend/requirements.py EXTRA``.

With this list, pip can install these packages while another process compiles Carom.
"""

from __future__ import annotations

import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path


def find_requirements(needed: list[str], extras: dict[str, list[str]]) -> Iterator[str]:
    """Yield the requirements. The requirements of Carom's extras replace ``carom[EXTRA, ...]``."""
    for one in needed:
        if one.startswith("carom["):
            for name in one.removeprefix("carom[").removesuffix("]").split(","):
                yield from find_requirements(extras[name], extras)
        else:
            yield one


if __name__ == "__main__":
    project = tomllib.loads(Path("pyproject.toml").read_text(encoding="utf-8"))["project"]
    needed = [*project["dependencies"], *(f"carom[{name}]" for name in sys.argv[1:])]
    sys.stdout.writelines(f"{one}\n" for one in find_requirements(needed, project["optional-dependencies"]))
