"""Builds the compiled modules, one for each .pyx file in src. pyproject.toml contains all other settings.

A build in place also builds modules with which tests call inlined functions.
"""

from __future__ import annotations

import os
import runpy
import sys
from pathlib import Path

from Cython.Build import cythonize
from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

#: These flags change no bit of a result. They exclude fused multiply-add, and code for errno and floating-point traps.
#: Carom does not use errno and traps, and this code costs a quarter of the speed.
_GCC = ["-std=c11", "-O2", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math", "-g0", "-Wno-unused-function"]
FLAGS = ["/std:c11", "/O2", "/fp:precise"] if sys.platform == "win32" else _GCC

#: These directives are not in .pyx files, because they must also apply to the functions of .pxd files.
DIRECTIVES = {
    "language_level": 3,
    "cdivision": True,
    "boundscheck": False,
    "wraparound": False,
    "infer_types": True,
    "auto_pickle": False,
    "autotestdict": False,
}

#: This module contains the digest of all sources; see `carom.core.extension`.
BUILT = "carom.core.built"
DIGEST = runpy.run_path("src/carom/core/extension.py")["compute_sources_digest"]()

#: Loaded by path, because ``python setup.py build_ext --inplace`` runs without the backend.
BACKEND = runpy.run_path("build_backend/carom_build.py")

#: Modules that only tests need. CAROM_WITHOUT_PROBE=1 leaves them out.
PROBES = "tests."
PROBE_SOURCES = [] if os.environ.get("CAROM_WITHOUT_PROBE") == "1" else Path("tests").glob("core_*functions.pyx")

#: For `make coverage-compiled`: the compiler counts executed lines and branches, and does not optimise.
COVERAGE = os.environ.get("CAROM_COVERAGE") == "1"
if COVERAGE:
    FLAGS = [*FLAGS, "-O0", "--coverage"]

#: Code that all modules with arrays need, and which Cython would otherwise add to each of them.
SHARED = "carom.core._cython"
#: Optimisation of modules that differ from -O2. With -O3, PIT's frame loop takes 5 to 13 % less time; PIC and the other
#: modules take the same time, and a third more time to compile. Each call of the core runs the shared code only once.
OPTIMISATION = {} if sys.platform == "win32" or COVERAGE else {"carom.core.pit": ["-O3"], SHARED: ["-O1"]}

#: Folder in which Cython writes C files. Cython translates a module again only if the module has changed.
TRANSLATED = "build/coverage/cython" if COVERAGE else "build/cython"

#: Number of processes that translate; 0 for none. On other systems, a new process would run this file again.
TRANSLATORS = (os.cpu_count() or 0) if sys.platform == "linux" else 0


class BuildExtension(build_ext):
    """Build that excludes the tests' modules from wheels, and uses zig if there is no other compiler."""

    def run(self) -> None:
        """Build all modules."""
        if not self.inplace:
            self.extensions = [module for module in self.extensions if not module.name.startswith(PROBES)]
        super().run()

    def build_extensions(self) -> None:
        """Compile and link all modules."""
        self.compiler.set_executables(**BACKEND["find_fallback_compiler"]())
        super().build_extensions()


def _extension(name: str, source: str, sources: list[str]) -> Extension:
    """Return a module, which is compiled again if one of its sources has changed.

    Cython finds the .pxd files that a .pyx file uses, and the .c files that its first line names. Every module depends
    on all .h and .c files, so no list of included files is needed.
    """
    stands_for_all = name == BUILT
    c_files = [path for path in sources if path.endswith((".h", ".c"))]
    return Extension(
        name,
        [source],
        depends=[*(sources if stands_for_all else c_files), "setup.py"],
        include_dirs=["src"],
        extra_compile_args=[*FLAGS, *OPTIMISATION.get(name, [])],
        extra_link_args=["--coverage"] if COVERAGE else [],
        define_macros=[("Py_LIMITED_API", "0x030B0000"), *([("CAROM_SOURCES", DIGEST)] if stands_for_all else [])],
        py_limited_api=True,
    )


def _directives_may_differ() -> bool:
    """Return whether this file, which contains Cython's directives, is newer than a translated file."""
    return any(made.stat().st_mtime < Path(__file__).stat().st_mtime for made in Path(TRANSLATED).rglob("*.c"))


sources = sorted(
    path.as_posix() for path in [*Path("src").rglob("*.p[yx][xd]"), *Path("src").rglob("*.[hc]"), *PROBE_SOURCES]
)
extensions = [
    _extension(path.removeprefix("src/").removesuffix(".pyx").replace("/", "."), path, sources)
    for path in sources
    if path.endswith(".pyx")
]
setup(
    ext_modules=cythonize(
        [_extension(SHARED, "carom/core/_cython.c", []), *extensions],
        compiler_directives=DIRECTIVES,
        nthreads=TRANSLATORS,
        include_path=["src"],
        build_dir=TRANSLATED,
        force=_directives_may_differ() or None,
        emit_linenums=COVERAGE,
        shared_utility_qualified_name=SHARED,
    ),
    cmdclass={"build_ext": BuildExtension},
    options={"bdist_wheel": {"py_limited_api": "cp311"}, "build_ext": {"parallel": os.cpu_count()}},
)
