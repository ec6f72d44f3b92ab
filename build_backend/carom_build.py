"""Build backend: setuptools, and the C compiler of the package ziglang on machines without a C compiler.

pyproject.toml names this module, and fixes the version of ziglang, which also compiles core.wasm. setup.py uses the
compiler that `find_fallback_compiler` returns.
"""

from __future__ import annotations

import importlib.util
import os
import shlex
import shutil
import sys
import sysconfig
import tomllib
from pathlib import Path
from typing import Any

from setuptools.build_meta import (
    build_editable,
    build_sdist,
    build_wheel,
    get_requires_for_build_sdist,
    prepare_metadata_for_build_editable,
    prepare_metadata_for_build_wheel,
)

__all__ = [
    "build_editable",
    "build_sdist",
    "build_wheel",
    "find_fallback_compiler",
    "get_requires_for_build_editable",
    "get_requires_for_build_sdist",
    "get_requires_for_build_wheel",
    "has_c_compiler",
    "prepare_metadata_for_build_editable",
    "prepare_metadata_for_build_wheel",
]

#: Without -mcpu, zig compiles only for the processor of this machine. CPython is built with the other options.
_ZIG = ("-mcpu=baseline", "-fPIC", "-fwrapv", "-DNDEBUG")


def get_requires_for_build_wheel(config_settings: Any = None) -> list[str]:  # noqa: ARG001 - the name is that of the interface
    """Return ziglang if there is no C compiler. Setuptools would run setup.py first, only to find no requirement."""
    return _compiler_requirements()


def get_requires_for_build_editable(config_settings: Any = None) -> list[str]:  # noqa: ARG001 - the name is that of the interface
    """Return ziglang where there is no C compiler."""
    return _compiler_requirements()


def has_c_compiler() -> bool:
    """Return whether the compiler that setuptools calls exists.

    The answer is True if the environment variable CC names a compiler. If this compiler is missing, the build fails.
    The answer is also True on Windows, where setuptools searches for Microsoft's compiler.
    """
    if sys.platform == "win32" or os.environ.get("CC"):
        return True
    command = shlex.split(sysconfig.get_config_var("CC") or "cc")
    return shutil.which(command[0]) is not None


def find_fallback_compiler() -> dict[str, list[str]]:
    """Return zig's commands for `distutils.ccompiler.CCompiler.set_executables`; empty if there is a C compiler.

    Raises:
        SystemExit: There is no C compiler, and ziglang is not installed.
    """
    if has_c_compiler():
        return {}
    if importlib.util.find_spec("ziglang") is None:
        raise SystemExit(f"no C compiler: install gcc or clang, or {_pinned_ziglang()} by pip")
    # Without this variable, zig leaves its cache in the home directory.
    os.environ.setdefault("ZIG_GLOBAL_CACHE_DIR", str(Path("build/zig").resolve()))
    compiler = [sys.executable, "-m", "ziglang", "cc"]
    compile_command = [*compiler, *_ZIG]
    return {"compiler": compile_command, "compiler_so": compile_command, "linker_so": [*compiler, "-shared"]}


def _compiler_requirements() -> list[str]:
    return [] if has_c_compiler() else [_pinned_ziglang()]


def _pinned_ziglang() -> str:
    project = tomllib.loads(Path("pyproject.toml").read_text(encoding="utf-8"))["project"]
    (pinned,) = project["optional-dependencies"]["wasm"]
    return str(pinned)
