"""Builds the play page, a single HTML file whose security policy forbids external scripts and all requests."""

from __future__ import annotations

import base64
import hashlib
import html
import json
import re
import zlib
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from carom.catalogue import all_scenes
from carom.errors import InputError
from carom.model.scene import Scene
from carom.web.engine_script import PageEngine

SOURCES = Path(__file__).parent
#: The solvers, compiled from `carom/core` by `tests/packaging/core_wasm.py`.
CORE = SOURCES / "core.wasm"
#: The JavaScript modules of the page. Each module comes after the modules that it imports.
MODULES = (
    *("arithmetic", "rational", "prescribed_motion", "chain_geometry", "features", "obstacles", "quartic", "wasm_core"),
    *("units", "drawing", "impact_positions", "run_methods", "scene", "compare", "start_core"),
    *("engines", "state", "layout", "scene_edits", "solve_runs", "page_texts", "charts", "pictures", "dragging"),
    *("links", "page"),
)
MOST_DISCS = 10
#: The 91 characters in which binary data is encoded. "<" is excluded, so that the data can't end its HTML element.
_LETTERS = np.frombuffer(bytes(range(35, 126)).replace(b"<", b"!"), np.uint8)
#: Parameter lc (number of literal context bits) of LZMA. The parameter must be the same in `unpack_blocks.js`.
_LITERAL_BITS = 3
#: Scenes of the catalogue that the page offers. The page opens with the first scene.
GALLERY = (
    *("paper/missed", "paper/late", "paper/wrong-direction", "paper/multiple", "classics/bullet", "classics/graze"),
    *("classics/cradle-gaps", "tables/seam", "driven/paddle", "spin/throw-stick"),
)
_IMPORT = re.compile(r"^import (?:\{[^}]*\} from )?\"\./\w+\.js\";\n", re.MULTILINE)
_COMMENT = re.compile(r"\s// [^\"'`]*$")
_RE_EXPORT = re.compile(r"^export \{[^}]*\};\n", re.MULTILINE)


def build_page_script() -> str:
    """Return all modules as one script. No two modules may define the same name."""
    joined = "\n".join((SOURCES / f"{name}.js").read_text(encoding="utf-8") for name in MODULES)
    script = re.sub(r"^export ", "", _RE_EXPORT.sub("", _IMPORT.sub("", joined)), flags=re.MULTILINE)
    return strip_comments(script)


def strip_comments(script: str) -> str:
    """Remove indents and comments from a script. Comments that contain a quote are kept. No string may span lines."""
    lines = (_COMMENT.sub("", line).strip() for line in script.splitlines())
    return "\n".join(line for line in lines if line and not line.startswith("//")) + "\n"


def render_page(scenes: Sequence[Scene], engines: Sequence[PageEngine] = ()) -> str:
    """Return the page as HTML with the given scenes and engines. The page opens with the first scene.

    Raises:
        InputError: The page can't show a scene.
    """
    for scene in scenes:
        if beyond := find_page_limit(scene):
            raise InputError(beyond)
    script = build_page_script() + (engines[0].shared if engines else "")
    loader = strip_comments((SOURCES / "unpack_blocks.js").read_text(encoding="utf-8"))
    digests = [hashlib.sha256(text.encode()).digest() for text in (loader, script, *(one.script for one in engines))]
    hashes = [f"'sha256-{base64.b64encode(digest).decode()}'" for digest in digests]
    policy = (
        f"default-src 'none'; script-src {' '.join(hashes)} 'wasm-unsafe-eval'; style-src 'unsafe-inline'; "
        "base-uri 'none'; form-action 'none'"
    )
    about = [{"name": one.name, "label": one.label, "profiles": one.profiles, "lacks": one.lacks} for one in engines]
    parts = {
        "policy": policy,
        "style": pack_block((SOURCES / "page.css").read_bytes()),
        "licences": "\n".join(engine.licence for engine in engines).replace("--", "- -"),
        "first": html.escape(scenes[0].name),
        # The page checks the numbers of the scenes.
        "scenes": _pack_json({scene.name: json.loads(scene.model_dump_json()) for scene in scenes}),
        "engines": _pack_json(about),
        "blocks": "\n".join(
            f'<script type="text/plain" data-engine="{html.escape(one.name)}">'
            f"{pack_block(one.script.encode())}</script>"
            for one in engines
        ),
        "core": pack_block(CORE.read_bytes()),
        "page": pack_block(script.encode()),
        "loader": loader,
    }
    template = (SOURCES / "page.html").read_text(encoding="utf-8")
    return re.sub(r"@(\w+)@", lambda found: parts[found[1]], template)


def add_gallery(*scenes: Scene) -> list[Scene]:
    """Return the given scenes followed by the gallery of the catalogue."""
    names = {scene.name for scene in scenes}
    return [*scenes, *(all_scenes()[name].scene for name in GALLERY if name not in names)]


def find_page_limit(scene: Scene) -> str:
    """Return why the page can't show a scene, or an empty text if it can."""
    if len(scene.discs) > MOST_DISCS:
        return f"the page shows at most {MOST_DISCS} discs, but {scene.name} has {len(scene.discs)}"
    return ""


def _pack_json(value: object) -> str:
    return pack_block(json.dumps(value, allow_nan=False, separators=(",", ":")).encode())


def pack_block(content: bytes) -> str:
    """Return content as text that `unpack_blocks.js` converts back.

    The text contains the content's length, its Adler-32 checksum and its LZMA stream. Two characters encode 13 bits.

    Raises:
        InputError: This Python was built without LZMA.
    """
    try:
        import lzma
    except ImportError as error:
        raise InputError("the page needs Python's module lzma, but this Python was built without it") from error
    # An LZMA dictionary larger than the content would have no effect, but clearing it would take longer than the
    # compression.
    size = max(len(content), 4096)
    filters = [{"id": lzma.FILTER_LZMA1, "preset": 9, "dict_size": size, "lc": _LITERAL_BITS, "lp": 0, "pb": 0}]
    packed = lzma.compress(content, format=lzma.FORMAT_RAW, filters=filters)
    stream = len(content).to_bytes(4, "little") + zlib.adler32(content).to_bytes(4, "little") + packed
    bits = np.unpackbits(np.frombuffer(stream + bytes(2), np.uint8), bitorder="little")
    numbers = bits[: len(bits) // 13 * 13].reshape(-1, 13) @ (1 << np.arange(13))
    letters: bytes = _LETTERS[np.stack(np.divmod(numbers, 91)[::-1], axis=-1)].tobytes()
    return letters.decode()
