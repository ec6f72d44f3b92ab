"""Write the certified answers with which tests compare PIC: ``python -m benchmarks.certified_answers [folder]``.

The files are committed in ``tests/validation/certified``, so tests that read them do not need python-flint.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

from benchmarks.arguments import parser, run

from carom.catalogue import catalogue
from carom.model.scene import Need
from carom.solvers.certified.certify import certify
from carom.solvers.certified.serialisation import enclosures
from carom.studies.bench.gas import build_gas_scene

if TYPE_CHECKING:
    from collections.abc import Iterator

    from carom.model.scene import Scene

DEFAULT_FOLDER = Path("tests/validation/certified")
#: Largest number of impacts per file. Files stay small, and rounding errors grow much within 60 impacts.
MOST_IMPACTS = 60


def answer_scenes() -> Iterator[Scene]:
    """Yield the scenes: scenes of the catalogue with more than one impact, and a box with many discs."""
    for entry in catalogue().values():
        known, needs = entry.known, entry.scene.needs
        if (known.count is None or known.count > 1 or known.convention) and Need.GRAVITY not in needs:
            yield entry.scene
    yield build_gas_scene(16, 0.4, duration_s=100.0).model_copy(update={"name": "bench/gas-16"})


def main(folder: Path) -> None:
    """Write one file per scene."""
    folder.mkdir(parents=True, exist_ok=True)
    for scene in answer_scenes():
        certified = certify(scene, max_impacts=MOST_IMPACTS)
        path = folder / f"{scene.name.replace('/', '-')}.json"
        path.write_text(json.dumps(enclosures(certified)) + "\n", encoding="utf-8")
        print(f"{path}: {len(certified)} impacts, {certified.degeneracy or certified.ending.value}")


if __name__ == "__main__":
    command = parser("benchmarks.certified_answers", __doc__)
    command.add_argument(
        "folder", nargs="?", type=Path, default=DEFAULT_FOLDER, help="folder for the files, one per scene"
    )
    run(command, main)
