"""Writes a scene and settings as a program for Node, for engines from npm.

A program contains a scene, settings, the adapter's world class, and a copy of the required functions of `serve.mjs`.
The program imports only its engine.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from pathlib import Path

from carom.engines.api import Scene, Setting
from carom.engines.protocol.adapter import ProgramAdapter
from carom.engines.protocol.manifest import load_manifest
from carom_adapters.shared.settings_code import count_steps, format_comment

_IMPORTED = re.compile(r"^import \{ ([\w, ]+) \} from \"\.\./serve\.mjs\";\n", re.MULTILINE)
_SERVED = re.compile(r"^await serve\((\w+)\);\n", re.MULTILINE)
_EXPORTED = re.compile(r"^export (?:async )?(?:const|function|class) (\w+)", re.MULTILINE)


class NpmAdapter(ProgramAdapter):
    """Adapter of an engine in a folder next to this file. The adapter can also write a scene as a program."""

    def __init__(self, manifest: Path) -> None:
        super().__init__(load_manifest(manifest), manifest.resolve().parent)
        self._source = manifest.resolve().with_name("engine.mjs")

    def code(self, scene: Scene, settings: Mapping[str, Setting], heading: str) -> str:
        """Return a program that builds the same world as the engine's program (`api.CodedAdapter`).

        Raises:
            OSError: The sources of the adapter's program can't be read.
        """
        return write_code(
            self._source.read_text(encoding="utf-8"), _find_exports(self._source), scene, settings, heading
        )


def _find_exports(source: Path) -> Mapping[str, str]:
    """Return the functions that `serve.mjs` exports: for each name, the code and the comment above the function."""
    pieces = (source.parents[1] / "serve.mjs").read_text(encoding="utf-8")
    found = ((_EXPORTED.search(piece), piece) for piece in re.split(r"\n\n(?=//)", pieces.rstrip("\n")))
    return {name[1]: piece.replace("export ", "") for name, piece in found if name}


def write_code(
    source: str, shared: Mapping[str, str], scene: Scene, settings: Mapping[str, Setting], heading: str
) -> str:
    """Return a program that consists of the adapter's source, a scene and all imported code, without the protocol."""
    imported, served = _IMPORTED.search(source), _SERVED.search(source)
    if imported is None or served is None:
        raise ValueError("the program does not import from serve.mjs, or has no world")
    needed = [name for name in imported[1].split(", ") if name != "serve"]
    for name in needed:  # the loop also visits names that it appends to the list: functions that these functions call
        needed += [other for other in shared if re.search(rf"\b{other}\b", shared[name]) and other not in needed]
    helpers = "\n\n".join(piece for name, piece in shared.items() if name in needed)
    body = _SERVED.sub("", _IMPORTED.sub("", source)).rstrip("\n")
    last = [match.end() for match in re.finditer(r"^import .*;\n", body, re.MULTILINE)][-1]
    fields = json.loads(scene.model_dump_json())
    lines = [f"  {json.dumps(name)}: {_format_json_lines(value)}," for name, value in fields.items()]
    scene_fields = "\n".join(lines)
    return f"""{format_comment(heading, "// ")}
// A module of node: save it as .mjs where the engine is installed.
{body[:last]}
const settings = {json.dumps(dict(settings), indent=2)};
const scene = {{
{scene_fields}
}};
const steps = {count_steps(scene, settings)};

{helpers}

{body[last:].strip()}

const world = new {served[1]}(scene, settings);
for (let step = 0; step < steps; step++) world.step();
const {{ position_m, velocity_m_s, spin_rad_s }} = world.observe();
position_m.forEach((place, i) => console.log([...place, ...velocity_m_s[i], spin_rad_s?.[i] ?? 0].join(" ")));
"""


def _format_json_lines(value: object) -> str:
    """Return a value as JSON. Each body in a list of bodies has its own line."""
    if isinstance(value, list) and value and isinstance(value[0], dict):
        return "[\n" + "".join(f"    {json.dumps(item)},\n" for item in value) + "  ]"
    return json.dumps(value)
