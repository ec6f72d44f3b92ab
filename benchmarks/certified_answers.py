"""Make the certified answers that tests hold PIC against: ``python -m benchmarks.certified_answers [folder]``.

They are committed in ``tests/validation/certified``: a test that reads them needs no python-flint.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

from benchmarks.arguments import parser, run

from carom.catalogue import Tag, catalogue
from carom.solvers.certified.certify import certify
from carom.solvers.certified.serialisation import enclosures
from carom.studies.bench.gas import build_gas_scene

if TYPE_CHECKING:
    from collections.abc import Iterator

    from carom.model.scene import Scene

DEFAULT_FOLDER = Path("tests/validation/certified")
#: Few enough for small files; the gas is chaotic within them.
MOST_IMPACTS = 60


def answer_scenes() -> Iterator[Scene]:
    """Yield the scenes: those of the catalogue with more than one impact, and a denser gas."""
    for entry in catalogue().values():
        if {Tag.CHAIN, Tag.CONVENTION, Tag.UNSTABLE} & entry.tags and Tag.GRAVITY not in entry.tags:
            yield entry.scene
    yield build_gas_scene(16, 0.4, duration_s=100.0).model_copy(update={"name": "bench/gas-16"})


def main(folder: Path) -> None:
    """Write one file a scene."""
    folder.mkdir(parents=True, exist_ok=True)
    for scene in answer_scenes():
        certified = certify(scene, max_impacts=MOST_IMPACTS)
        path = folder / f"{scene.name.replace('/', '-')}.json"
        path.write_text(json.dumps(enclosures(certified)) + "\n", encoding="utf-8")
        print(f"{path}: {len(certified)} impacts, {certified.degeneracy or certified.ending.value}")


if __name__ == "__main__":
    command = parser("benchmarks.certified_answers", __doc__)
    command.add_argument("folder", nargs="?", type=Path, default=DEFAULT_FOLDER, help="where to write one file a scene")
    run(command, main)
