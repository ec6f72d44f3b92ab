"""Build of the compiled extension: each .pyx below src is a module of it. pyproject.toml contains everything else.

A build in place also builds the module by which the tests call inlined functions.
"""

from __future__ import annotations

import os
import runpy
import sys
from pathlib import Path

from Cython.Build import cythonize
from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

#: None of these changes a bit: no fused multiply-add; and no code for errno or floating-point traps, which nobody reads
#: and which keep GCC from taking branches out of hot loops (a quarter of the speed).
_GCC = ["-std=c11", "-O3", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math", "-g0", "-Wno-unused-function"]
FLAGS = ["/std:c11", "/O2", "/fp:precise"] if sys.platform == "win32" else _GCC

#: Set here instead of in a .pyx, from which they would not reach the functions of .pxd files.
DIRECTIVES = {
    "language_level": 3,
    "cdivision": True,
    "boundscheck": False,
    "wraparound": False,
    "infer_types": True,
    "auto_pickle": False,
    "autotestdict": False,
}

#: Compiled into the module that stands for all: see `carom.core.extension`.
BUILT = "carom.core.built"
DIGEST = runpy.run_path("src/carom/core/extension.py")["compute_sources_digest"]()

#: Also without the backend, as ``python setup.py build_ext --inplace``.
BACKEND = runpy.run_path("build_backend/carom_build.py")

#: What tests alone need; what installs for a report says that it does without.
PROBES = "tests."
PROBE_SOURCES = [] if os.environ.get("CAROM_WITHOUT_PROBE") == "1" else Path("tests").glob("core_*functions.pyx")

#: For `make coverage-compiled`: lines and branches of the sources are counted, and nothing is optimised away.
COVERAGE = os.environ.get("CAROM_COVERAGE") == "1"
if COVERAGE:
    FLAGS = [*FLAGS, "-O0", "--coverage"]

#: What Cython would add to each module that takes arrays, once for all of them. It is called once per call of the core,
#: so optimising it would only double the time that it takes to compile.
SHARED = "carom.core._cython"
SHARED_FLAGS = [] if sys.platform == "win32" or COVERAGE else ["-O1"]

#: Where Cython writes C: a module that has not changed is not translated again.
TRANSLATED = "build/coverage/cython" if COVERAGE else "build/cython"

#: Processes that translate; elsewhere a new one would run this file again.
TRANSLATORS = (os.cpu_count() or 0) if sys.platform == "linux" else 0


class BuildExtension(build_ext):
    """Build that excludes the tests' modules from wheels, and uses zig where there is no other compiler."""

    def run(self) -> None:
        """Build all modules."""
        if not self.inplace:
            self.extensions = [module for module in self.extensions if not module.name.startswith(PROBES)]
        super().run()

    def build_extensions(self) -> None:
        """Compile and link all modules."""
        self.compiler.set_executables(**BACKEND["find_fallback_compiler"]())
        super().build_extensions()


def _extension(name: str, source: str, sources: list[str], flags: list[str] = FLAGS) -> Extension:
    """Return a module, which is compiled again when one of its sources has changed.

    Cython finds the .pxd files that a .pyx uses, and the .c files that its first line names. Every module depends on
    all .h and .c files, so that no list of includes is needed.
    """
    stands_for_all = name == BUILT
    c_files = [path for path in sources if path.endswith((".h", ".c"))]
    return Extension(
        name,
        [source],
        depends=[*(sources if stands_for_all else c_files), "setup.py"],
        include_dirs=["src"],
        extra_compile_args=flags,
        extra_link_args=["--coverage"] if COVERAGE else [],
        define_macros=[("Py_LIMITED_API", "0x030B0000"), *([("CAROM_SOURCES", DIGEST)] if stands_for_all else [])],
        py_limited_api=True,
    )


def _directives_may_differ() -> bool:
    """Return whether this file is newer than what was translated by its directives, which Cython does not look at."""
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
        [_extension(SHARED, "carom/core/_cython.c", [], [*FLAGS, *SHARED_FLAGS]), *extensions],
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
