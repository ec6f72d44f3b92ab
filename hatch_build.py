"""Building the package: numba translates the compiled units, so that a user's first call need not wait for it."""

from __future__ import annotations

import os
import platform
import subprocess
import sys
import sysconfig
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

UNITS = "src/carom/physics/units"

#: Systems and processors that numba has wheels for: it is not to be built from source for this.
_WHEELS = {("linux", "x86_64"), ("linux", "aarch64"), ("darwin", "arm64"), ("win32", "AMD64")}


class UnitsHook(BuildHookInterface):  # type: ignore[type-arg] # any builder's configuration will do
    """Puts the translated units beside their source, for wheels and for editable installs."""

    PLUGIN_NAME = "custom"

    def dependencies(self) -> list[str]:
        """Return what the build needs besides hatchling."""
        cpython = sys.implementation.name == "cpython" and not sysconfig.get_config_var("Py_GIL_DISABLED")
        served = (sys.platform, platform.machine()) in _WHEELS and sys.version_info < (3, 15)
        glibc = sys.platform != "linux" or platform.libc_ver()[0] == "glibc"
        return ["numba>=0.62"] if self.target_name == "wheel" and cpython and served and glibc else []

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
            self.app.display_warning(
                f"{done.stderr}\nThe package is built without translated units: numba failed here, see above."
            )
