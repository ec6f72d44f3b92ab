"""Joins an engine's npm package, the engine's adapter and shared code into one script for the play page.

The adapters contain few and simple ``import`` lines. This module replaces the import lines, so that no bundler is
needed. Any other import is refused.
"""

from __future__ import annotations

import json
import re
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from carom.errors import InputError
from carom.web.packages import PACKAGES, load_package_script

_IMPORT = re.compile(r'^import (?P<names>\{[^}]*\}|\w+) from "(?P<source>[^"]+)";$', re.MULTILINE)
_EXPORTED = re.compile(r"^export (?:async )?(?:function|class|const) (\w+)", re.MULTILINE)
#: Comment lines and indents, which the script does not need.
_UNSEEN = re.compile(r"^[ \t]*//.*\n|^[ \t]+", re.MULTILINE)
_SHARED = "../serve.mjs"


@dataclass(frozen=True)
class PageEngine:
    """An engine that runs in the page.

    Attributes:
        name: Name of the adapter.
        label: The engine's name and version.
        profiles: Settings of each profile except `located`.
        script: Script of the engine, with its adapter.
        licence: Text of the package's licence, which the page must contain.
        lacks: Features that the engine does not support, although the page can show scenes with these features.
        shared: Script with the functions that all adapters use. The page runs the shared script once, before the
            scripts of engines.
    """

    name: str
    label: str
    profiles: dict[str, dict[str, Any]]
    script: str
    licence: str
    lacks: tuple[str, ...] = ()
    shared: str = ""


def build_page_engine(name: str, manifest: Path) -> PageEngine | None:
    """Return the engine that a manifest ``engine.toml`` describes; None if its npm package is not installed.

    Raises:
        InputError: The adapter has an unsupported import, or the package is not the expected version.
        OSError: A file of an installed package can't be read.
    """
    about = tomllib.loads(manifest.read_text(encoding="utf-8"))
    description = manifest.parent / about["package"]
    if not description.is_file():
        return None
    package = json.loads(description.read_text(encoding="utf-8"))
    script = link_script(
        name,
        package=load_package_script(PACKAGES[name], description.parent),
        package_name=package["name"],
        module=(manifest.parent / about["command"][1]).read_text(encoding="utf-8"),
    )
    shared = build_shared_script((manifest.parent / _SHARED).read_text(encoding="utf-8"))
    licences = [path for path in sorted(description.parent.glob("LICENSE*")) if path.is_file()]
    licence = licences[0].read_text(encoding="utf-8") if licences else f"{package['name']}: {package['license']}"
    profiles = {
        name: profile["settings"] for name, profile in about["profiles"].items() if not profile.get("located", False)
    }
    label = f"{about['engine']} {package['version']}"
    return PageEngine(name, label, profiles, script, licence, shared=shared)


def build_shared_script(shared: str) -> str:
    """Return a script with the functions of `serve.mjs` that adapters use, except those for the protocol."""
    text = re.sub(r"^export async function serve\(.*?^}\n", "", shared, flags=re.MULTILINE | re.DOTALL)
    exported = ", ".join(_EXPORTED.findall(text))
    helpers = _UNSEEN.sub("", re.sub(r"^export ", "", _IMPORT.sub("", text), flags=re.MULTILINE))
    return f"globalThis.caromShared = (() => {{\n{helpers}return {{ {exported} }};\n}})();\n"


def link_script(name: str, *, package: str, package_name: str, module: str) -> str:
    """Return a script that runs an engine's adapter module and exports its class, without imports and comments.

    Imports and comments are found by the start of a line. So no string in the module may span several lines.
    """

    def format_binding(match: re.Match[str]) -> str:
        names, source = match["names"], match["source"]
        if source == _SHARED:
            return f"const {names} = caromShared;"
        if source == package_name:
            return f"const {names} = {'caromPackage' if names[0] == '{' else 'caromPackage.default ?? caromPackage'};"
        raise InputError(f"the adapter of {name} imports {source}, which the page does not support")

    script = _UNSEEN.sub("", _IMPORT.sub(format_binding, module))
    if re.search(r"^\s*import\b", script, re.MULTILINE):
        raise InputError(f"the adapter of {name} has an import that the page does not support")
    key = json.dumps(name)
    return f"""(async () => {{
const caromModule = {{ exports: {{}} }};
(function (module, exports) {{
{package}
}}).call(globalThis, caromModule, caromModule.exports);
await (async () => {{
"use strict";
const caromPackage = caromModule.exports;
const caromShared = {{ ...globalThis.caromShared, serve: (World) => caromEngines[{key}].done(World) }};
{script}
}})();
}})().catch((error) => caromEngines[{key}].fail(error));
"""
