"""Translation of the units that a run starts with: ``python -m carom.solvers.translate FOLDER``, for the build."""

from __future__ import annotations

import os
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from carom.physics import translations
from carom.physics.compilation import translation
from carom.physics.time_of_impact import FILL
from carom.solvers.kernel_state import kernel_recipe

__all__ = ["main"]


def main(directory: Path) -> None:
    """Write what numba makes of each unit into a directory, in place of what is there; nothing if it is there already.

    Raises:
        CaromError: numba could not compile one.
    """
    kernel = kernel_recipe()
    recipes = (kernel, *kernel.linked, FILL)
    if all(translations.read(each.name(), directory) for each in recipes):
        return
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        made = {each.name(): codes for each, codes in zip(recipes, pool.map(translation, recipes), strict=True)}
    directory.mkdir(exist_ok=True)
    for former in directory.glob("*.z"):
        former.unlink()
    for name, codes in made.items():
        translations.write(directory, name, codes)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
