"""Converts npm packages of engines to scripts that the play page can run."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType

from carom.errors import InputError


@dataclass(frozen=True)
class Package:
    """An npm package that can run in a page.

    Attributes:
        script: Script file of the package, relative to its folder.
        exported: Name of the default export, if the script is an ECMAScript module; empty if the script sets
            ``module.exports``.
        binary: WebAssembly file of the package; empty if there is none.
        closed: Pieces of code that need Node or violate the page's security policy, each with its replacement. A piece
            must occur exactly once in the script.
    """

    script: str
    exported: str = ""
    binary: str = ""
    closed: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))


#: Box2D's JavaScript (embind) creates functions from source text, which the page's security policy forbids. The
#: replacements are closures with the same effect.
_BOX2D_CALLERS = {
    "return new Function(args1, invokerFnBody);": """return function (...bound) {
    const [, , invoker, fn, runDestructors, fromRetWire, toClassParamWire, ...rest] = bound;
    const wires = rest.slice(0, argCount), ends = rest.slice(argCount), first = isClassMethodFunc ? 1 : 2;
    return function (...given) {
      const stack = needsDestructorStack ? [] : null;
      const own = isClassMethodFunc ? [toClassParamWire(stack, this)] : [];
      const wired = [...own, ...wires.map((wire, i) => wire(stack, given[i]))];
      const value = invoker(fn, ...wired);
      if (needsDestructorStack) runDestructors(stack);
      else
        for (let i = first, k = 0; i < argTypes.length; i++)
          if (argTypes[i].destructorFunction !== null) ends[k++](wired[i - first]);
      return returns ? fromRetWire(value) : undefined;
    };
  };""",
    "new Function(Object.keys(captures), functionBody)(...Object.values(captures));": """
  (handle, methodName, destructorsRef, args) => {
    const given = argFromPtr.map((read, i) => read(args + i * GenericWireTypeSize));
    const value = {
      0: () => Emval.toValue(handle)(...given),
      1: () => Emval.toValue(handle)[getStringOrSymbol(methodName)](...given),
      2: () => new (Emval.toValue(handle))(...given),
      3: () => given.at(-1),
    }[kind]();
    return retType.isVoid ? undefined : emval_returnValue(toReturnWire, destructorsRef, value);
  };""",
}
#: Replacement for the clock that cannon-es imports from Node.
_CANNON_CLOCK = {
    "const performance = require('perf_hooks') && require('perf_hooks').performance || {};": (
        "const performance = globalThis.performance;"
    )
}
#: Packages by name of the adapter. The page can't run havok and physx, because their adapters read files by functions
#: of Node.
PACKAGES = MappingProxyType(
    {
        "matter": Package("build/matter.min.js"),
        "planck": Package("dist/planck.min.js"),
        "rapier2d": Package("dist/rapier.cjs"),
        "box2d3": Package(
            "build/dist/es/compat/Box2D.compat.mjs",
            exported="Box2D",
            binary="build/dist/es/compat/Box2D.compat.wasm",
            closed=_BOX2D_CALLERS,
        ),
        "jolt": Package("dist/jolt-physics.wasm-compat.js", exported="Jolt"),
        "cannon": Package("dist/cannon-es.cjs.js", closed=_CANNON_CLOCK),
        "p2": Package("dist/p2-es.cjs.js"),
    }
)


def load_package_script(package: Package, folder: Path) -> str:
    """Return the script of an installed package. The returned script sets ``module.exports``.

    Raises:
        InputError: The package has an unexpected version.
        OSError: A file of the package can't be read.
    """
    # The file is read as bytes to keep its line ends, which may be part of WebAssembly in a string.
    text = (folder / package.script).read_bytes().decode("utf-8")
    ended = {f"export default {package.exported};": _build_default_export(package, folder)} if package.exported else {}
    for old, new in (ended | dict(package.closed)).items():
        if text.count(old) != 1:
            raise InputError(f"{package.script} has an unexpected version: it must contain {old!r} exactly once")
        text = text.replace(old, new)
    if not package.exported:
        return text
    return '"use strict";\n' + text.replace("import.meta.url", "document.baseURI")


def _build_default_export(package: Package, folder: Path) -> str:
    """Return the code that exports a module's default export, with the package's WebAssembly file if there is one."""
    if not package.binary:
        return f"module.exports = {{ default: {package.exported} }};"
    data = base64.b64encode((folder / package.binary).read_bytes()).decode()
    return (
        f'const caromBinary = Uint8Array.from(atob("{data}"), (c) => c.charCodeAt(0));\n'
        f"module.exports = {{ default: (asked) => {package.exported}({{ ...asked, wasmBinary: caromBinary }}) }};"
    )
