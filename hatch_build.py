"""Building the package: numba translates the compiled units, so that a user's first call need not wait for it."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

UNITS = "src/carom/physics/units"


class UnitsHook(BuildHookInterface):  # type: ignore[type-arg] # any builder's configuration will do
    """Puts the translated units beside their source, for wheels and for editable installs."""

    PLUGIN_NAME = "custom"

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:  # noqa: ARG002 - the interface has it
        """Translate, and go on without where that fails: then numba does it at a user's first call."""
        if self.target_name != "wheel":
            return
        paths = os.pathsep.join([str(Path(self.root, "src")), *filter(None, sys.path)])
        done = subprocess.run(  # noqa: S603 - our own module, by the interpreter that builds
            [sys.executable, "-P", "-m", "carom.solvers.translate", str(Path(self.root, UNITS))],
            env=os.environ | {"PYTHONPATH": paths},
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode == 0:
            build_data["artifacts"].append(f"/{UNITS}/*.z")
        else:
            self.app.display_warning(f"{done.stderr}\nThe package is built without translated units, see above.")
