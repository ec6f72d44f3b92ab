"""The play page with hostile names, links and damaged blocks: Carom's script alone, a scene or a sentence.

The page's own modules run in node.
"""

import base64
import hashlib
import itertools
import json
import shutil
from collections.abc import Iterator
from contextlib import closing
from functools import cache
from html.parser import HTMLParser
from pathlib import Path
from random import Random
from typing import Any

from tests.attacks.guard import spoil
from tests.attacks.scenes import mutate
from tests.unit.engines.protocol.programs import Talk

from carom import Scene
from carom.catalogue import all_scenes
from carom.errors import SceneError
from carom.support.folders import write_file
from carom.web.page import CORE, GALLERY, SOURCES, add_gallery, pack_block, render_page

#: Parts of names that would end an element, a comment or an attribute, fill a mark, or be a property of all objects.
NAMES = (
    *("</script><script>alert(1)</script>", "-->", "<!--", "<![CDATA[", "]]>", '"><img src=x onerror=alert(1)>', "'"),
    *("@policy@", "@loader@", "@scenes@", r"\1", r"\g<0>"),
    *("&lt;script&gt;", "&#0;", "${1}", "`", "javascript:alert(1)"),
    *("__proto__", "constructor", "toString", "hasOwnProperty", "5", "-0", "2=", "1=W10", "#", "%", "%zz", "a b"),
    *("\u202eabc", "\u2028", "\ufeff", "\u00e9", "e\u0301", "\U0001f3b1", "\ud800", "a" * 200, "paper/missed"),
)

#: The core, and a part of it: a block of ten thousand bytes is spoilt in its begin more often.
_CONTENTS = (CORE.read_bytes(), CORE.read_bytes()[:5000])


def attack(rng: Random, folder: Path) -> Iterator[str]:
    """Hostile names and links, and damaged blocks, of the play page.

    Only Carom's script runs, and the page shows a scene or a message.
    """
    while shutil.which("node") is None:
        yield "there is no node here, in which the page's modules would run"
    command = ["node", str(Path(__file__).with_name("play.mjs")), str(SOURCES), pack_block(b"")]
    while True:
        with closing(Talk(command, folder)) as page:
            try:
                while True:
                    act = rng.choice((_try_name, _try_link, _try_link, _try_link, _try_block, _try_block))
                    yield act(rng, folder, page)
            except AssertionError as error:
                lost = f"the page's modules: {error}"
        yield lost


def _ask(page: Talk, **request: object) -> dict[str, Any]:
    answer: dict[str, Any] = page.ask(json.dumps(request).encode())
    return answer


class _Scripts(HTMLParser):
    """What of a page a browser would run, and its packed blocks."""

    def __init__(self) -> None:
        super().__init__()
        self.run, self.blocks, self.policy, self.tags = list[str](), dict[str, str](), "", set[str]()
        self._into = ""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        fields = dict(attrs)
        self.tags.add(tag)
        self.policy += fields.get("content") or "" if "http-equiv" in fields else ""
        if any(name.startswith("on") for name in fields):
            self.run.append(f"{tag} {fields}")
        if tag == "script":
            self._into = fields.get("id") or "block" if fields.get("type") == "text/plain" else "run"

    def handle_data(self, data: str) -> None:
        if self._into == "run":
            self.run.append(data)
        elif self._into:
            self.blocks[self._into] = data

    def handle_endtag(self, tag: str) -> None:
        del tag
        self._into = ""


def _try_name(rng: Random, folder: Path, page: Talk) -> str:
    name = "".join(rng.choice(NAMES) for _ in range(rng.choice((1, 1, 2))))[:200]
    try:
        scene = Scene(**{**dict(all_scenes()["paper/late"].scene), "name": name})
    except SceneError:  # a name that no scene has
        return ""
    written = write_file(folder / "page.html", render_page(add_gallery(scene))).read_text(encoding="utf-8")
    found = _Scripts()
    found.feed(written)
    if len(found.run) != 1 or _sha256(found.run[0]) not in found.policy or found.tags & {"img", "iframe", "link"}:
        return f"the name {name!r}: the page runs {[text[:80] for text in found.run]}, tags {found.tags}"
    if _sha256(_ask(page, do="unpack", text=found.blocks["page"])["text"]) not in found.policy:
        return f"the name {name!r}: the policy forbids the page's own script"
    scenes = _ask(page, do="unpack", text=found.blocks["scenes"])["text"]
    want = [scene.name, *(other for other in GALLERY if other != scene.name)]
    return "" if [*json.loads(scenes)] == want else f"the name {name!r}: the page has {[*json.loads(scenes)]}"


def _sha256(script: str) -> str:
    return base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()


_LEGS = [{"from_s": 0, "velocity_m_s": [0.1, 0]}, {"from_s": 1, "velocity_m_s": [0, 0]}]
#: A link of discs and walls, as the page writes it.
_LINK: list[Any] = [
    [[-1, 0.1, 2, 0, 0.5, 1, 0, 0.5], [1, 0, 0, 0, 0.5, "inf", 0, "inf"], [5, 0, -1, 0, 0.5, "inf", 0, 0.5, True]],
    [
        [[0, -3], [0, 1], *[None] * 12],
        [None, None, [[-3, -2], [3, -2], [4, 2]], [0.5, 0], *[None] * 4, 0.1, 0.5, 0.1, [0.1, 0], None, None],
        [*[None] * 6, [0, 5], 1, None, None, None, None, 0.5, _LEGS],
    ],
    [1, 0.9, 0.1, 0.2, 0, 0, 0, 0, 0],
    *([0, -1], 5, 60, 0.25, "pit"),
]


def _try_link(rng: Random, folder: Path, page: Talk) -> str:
    del folder
    values = _LINK
    for _ in range(rng.choice((0, 1, 1, 2))):
        values = spoil(rng, values)
    if rng.random() < 0.3:  # within what the page takes, and far from what a hand draws
        discs = [[*rng.choice(_EXTREMES), 1, 0, 0.5] for _ in range(rng.choice((2, 10)))]
        values = [discs, [], *_LINK[2:4], 60, 10000, 0.5, "pit"]
    text = "2=" + base64.urlsafe_b64encode(json.dumps(values).encode("latin-1")).decode().rstrip("=")
    if rng.random() < 0.3:
        text = mutate(rng, text.encode()).decode("latin-1")
    answer = _ask(page, do="link", text=text)
    return answer.get("lost", "") and f"the link {text[:400]!r}: {answer['lost']}"


#: Positions, velocities and radii of discs.
_EXTREMES = [*itertools.product((-1e4, 0, 1e4), (0, 1e-300), (1e4, -1e4), (0, 1e4), (1e-4, 1))]
_pack = cache(pack_block)


def _try_block(rng: Random, folder: Path, page: Talk) -> str:
    """Spoil a packed block, as of a page that was damaged on its way: it is refused, or its content is as it was."""
    del folder
    content = rng.choice((b"abc" * 1000, *_CONTENTS))
    text = bytearray(_pack(content), "ascii")
    for _ in range(rng.choice((1, 3))):
        text[rng.randrange(len(text))] = rng.choice((33, *range(35, 60), *range(61, 126)))
    if rng.random() < 0.3:
        del text[rng.randrange(len(text)) :]
    answer = _ask(page, do="unpack", text=text.decode())
    held = "said" in answer or answer["text"] == content.decode(errors="replace")
    return "" if held else f"a damaged block is read as {answer['text'][:200]!r}"
