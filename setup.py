"""Builds the compiled rooms: every .pyx below src is an extension module. All else stands in pyproject.toml."""

from __future__ import annotations

import os
import sys
from pathlib import Path

from Cython.Build import cythonize
from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

#: None of these changes a bit: no fused multiply-add; and no code for errno or floating-point traps, which nobody reads
#: and which keep GCC from taking branches out of hot loops (a quarter of the speed).
_GCC = ["-O3", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math", "-g0"]
FLAGS = ["/O2", "/fp:precise"] if sys.platform == "win32" else _GCC

#: Given here and not at the head of a .pyx: from there they do not reach the functions of .pxd files.
DIRECTIVES = {
    "language_level": 3,
    "cdivision": True,
    "boundscheck": False,
    "wraparound": False,
    "infer_types": True,
    "auto_pickle": False,
}

#: For continuous integration: a build without the extension is an error there.
REQUIRED = os.environ.get("CAROM_REQUIRE_EXTENSION") == "1"


class OptionalBuild(build_ext):
    """Goes on without the extension where there is no compiler: plain forms serve then, slower, with the same bits."""

    def build_extension(self, ext: Extension) -> None:
        """Build one module; say so, and go on, where that fails."""
        try:
            super().build_extension(ext)
        except Exception as error:
            if REQUIRED:
                raise
            self.warn(f"{ext.name} was not built, its plain form will serve: {error}")


def _module(path: Path) -> str:
    return ".".join(path.relative_to("src").with_suffix("").parts)


extensions = [
    Extension(
        _module(path),
        [str(path)],
        extra_compile_args=FLAGS,
        define_macros=[("Py_LIMITED_API", "0x030B0000")],
        py_limited_api=True,
    )
    for path in sorted(Path("src").rglob("*.pyx"))
]
setup(
    ext_modules=cythonize(extensions, compiler_directives=DIRECTIVES, include_path=["src"], build_dir="build/cython"),
    cmdclass={"build_ext": OptionalBuild},
    options={"bdist_wheel": {"py_limited_api": "cp311"}},
)
