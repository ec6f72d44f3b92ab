"""Hook of MkDocs for `make docs`, which adds pages and contents to the documents of the repository.

- The README is the first page, and CONTRIBUTING.md is a page.
- If a page links to a file outside docs/, this file is a page of the site. The sample report is copied unchanged.
- The play page is a file of the site, and is embedded in each page that contains the mark `<!-- throw -->`.
- The tutorial, a notebook, becomes a page with the outputs of its cells. Replays are added to the gallery.
- The reference pages of commands and of the scene file are generated from declarations.
- Formulas become MathML, so that browsers need no script to show them.
- If the navigation of mkdocs.yml lacks a page of docs/, the page is added at the end.
"""

from __future__ import annotations

import html
import importlib.util
import json
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

from latex2mathml.converter import convert
from mkdocs.exceptions import PluginError
from mkdocs.plugins import get_plugin_logger
from mkdocs.structure.files import File

import carom
from carom.catalogue import find_scenes
from carom.web.page import GALLERY, render_page

if TYPE_CHECKING:
    from mkdocs.config.defaults import MkDocsConfig
    from mkdocs.structure.files import Files

ROOT = Path(__file__).resolve().parents[1]
#: Documents in the repository's root, and their pages on the site.
PAGES = {"README.md": "index.md", "CONTRIBUTING.md": "contributing.md"}
#: Files to which documents link, and their pages on the site. The report has an HTML page already, and the notebook
#: becomes a page.
SAMPLE = "reports/sample/index.html"
SHOWN_AS = {"docs/tutorial.ipynb": "tutorial.md", "reports/sample/report.md": SAMPLE, SAMPLE: SAMPLE}

_LINK = re.compile(r"(\]\(|\b(?:src|srcset)=\")([^)#\":\s]+)(?=[)#\"])")
_FORMULA = re.compile(r'<(span|div) class="arithmatex">\\[(\[](.*?)\\[)\]]</\1>', re.DOTALL)
#: Mark of a replay of PIC and PIT: the name of a scene, and PIT's frames per second (default: the frame rate of the
#: scene).
_REPLAY = re.compile(r"<!-- replay: (\S+)(?: (\d+))? -->")
#: File name of the play page on the site, and the mark of its place in a page.
THROWN = "throw.html"
_THROW = "<!-- throw -->"
#: Mark of the play page, and the pictures of scenes that follow. Documents show these pictures where they can't embed
#: the play page.
_PICTURES = re.compile(rf"{_THROW}\n.*?<!-- thrown -->", re.DOTALL)
_LANGUAGES = {".c": "c", ".h": "c", ".md": "markdown", ".py": "python", ".pyx": "cython", ".toml": "toml"}

#: Control sequences of a terminal for bold and plain text.
_BOLD = re.compile(r"\x1b\[[\d;]*m")

log = get_plugin_logger("site")


def on_config(config: MkDocsConfig) -> None:
    """Add pages of docs/ that are missing in the navigation to the end of the navigation."""
    listed = {*_pages_in(config.nav), *PAGES.values()}
    found = {path.relative_to(ROOT / "docs").as_posix() for path in (ROOT / "docs").rglob("*.md")}
    found = {page for page in found if "decisions/0" not in page}
    if more := sorted(found - listed):
        config.nav.append({"More": more})


def on_files(files: Files, config: MkDocsConfig) -> None:
    """Add pages for files outside of docs/."""
    texts = {page.src_uri: page.content_string for page in files.documentation_pages()}
    for source, page in PAGES.items():
        texts[page] = (ROOT / source).read_text(encoding="utf-8")
        with_page = _PICTURES.sub(throw(), texts[page])
        files.append(File.generated(config, page, content=_from_root(with_page)))
    files.append(File.generated(config, "tutorial.md", content=_tutorial()))
    reference = _reference()
    files.append(File.generated(config, "reference/commands.md", content=reference.commands_page()))
    files.append(File.generated(config, "reference/scene-file.md", content=reference.scene_page()))
    files.append(File.generated(config, SAMPLE, abs_src_path=str(ROOT / SAMPLE)))
    scenes = [one.scene for name in GALLERY for one in find_scenes([name])]
    files.append(File.generated(config, THROWN, content=render_page(scenes)))
    for page, text in texts.items():
        folder = ROOT if page in PAGES.values() else (ROOT / "docs" / page).parent
        for _, target in _LINK.findall(text):
            name = _name(folder, target)
            if name is None or name in SHOWN_AS or files.get_file_from_path(f"sources/{name}.md"):
                continue
            if not (ROOT / name).is_file():
                log.warning("%s links to %s, which is not a file", page, name)
                continue
            body = (ROOT / name).read_text(encoding="utf-8")
            fenced = f"````{_LANGUAGES.get(Path(name).suffix, 'text')}\n{body}\n````\n"
            head = f"---\nsearch:\n  exclude: true\n---\n# {name}\n\n"
            files.append(File.generated(config, f"sources/{name}.md", content=head + fenced))


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Replace links to files outside docs/ by links to the site's pages, and insert the replays."""
    if page.file.generated_by:
        return markdown
    markdown = _REPLAY.sub(lambda found: replay(found[1], found[2]), markdown)
    markdown = markdown.replace(_THROW, throw())
    folder = (ROOT / "docs" / page.file.src_uri).parent
    up = "../" * page.file.src_uri.count("/")

    def led(found: re.Match[str]) -> str:
        name = _name(folder, found[2])
        return found[0] if name is None else f"{found[1]}{up}{SHOWN_AS.get(name, f'sources/{name}.md')}"

    return _LINK.sub(led, markdown)


def on_page_content(html_text: str, **_: Any) -> str:
    """Turn formulas into MathML."""

    def shown(found: re.Match[str]) -> str:
        return convert(html.unescape(found[2]).strip(), display="block" if found[1] == "div" else "inline")

    return _FORMULA.sub(shown, html_text)


def replay(scene: str, rate: str | None) -> str:
    """Return a frame (an embedded page) with a replay of PIT next to PIC."""
    frames = float(rate) if rate else None
    frame = carom.replay(carom.solve_pic(scene), carom.solve_pit(scene, frame_rate_hz=frames))._repr_html_()
    if frame is None:
        raise PluginError("replays of the gallery need the extra report: pip install 'carom[report]'")
    drag = f'<p><a href="{THROWN}#{scene}">Open this scene on the play page, where you can drag its discs</a></p>'
    return f"{frame}\n\n{drag}" if scene in GALLERY else frame


def throw() -> str:
    """Return a frame (an embedded page) with the play page, and pictures of scenes with links to the play page."""
    links = " ".join(
        f'<a href="{THROWN}#{name}" target="throw" title="{name}"><img alt="{name}" width="150" '
        f'src="figures/throw/{name.replace("/", "-")}.webp"></a>'
        for name in GALLERY
    )
    style = "width:100%;height:60rem;border:0"
    frame = f'<iframe name="throw" src="{THROWN}" title="Throw the discs" style="{style}"></iframe>'
    return f"<p>{links}</p>\n\n{frame}"


def _tutorial() -> str:
    """Return the notebook as Markdown: its cells in order, each with the best form of its output."""
    parts = []
    for cell in json.loads((ROOT / "docs" / "tutorial.ipynb").read_text(encoding="utf-8"))["cells"]:
        source = "".join(cell["source"])
        parts.append(f"```python\n{source}\n```" if cell["cell_type"] == "code" else source)
        for output in cell.get("outputs", ()):
            data = {kind: "".join(text) for kind, text in output.get("data", {}).items()}
            if "text/html" in data:
                parts.append(f'<div class="shown">{data["text/html"]}</div>')
            elif "image/png" in data:
                parts.append(f'<img alt="" src="data:image/png;base64,{data["image/png"].strip()}">')
            else:
                text = "".join(output.get("text", ())) or data["text/plain"]
                parts.append(f"```text\n{_BOLD.sub('', text)}\n```")
    return "\n\n".join(parts)


def _reference() -> Any:
    """Load `docs/figures/reference.py`, which is not in a package that a MkDocs hook can import."""
    spec = importlib.util.spec_from_file_location("reference", ROOT / "docs" / "figures" / "reference.py")
    if spec is None or spec.loader is None:
        raise PluginError("docs/figures/reference.py is missing")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def _pages_in(nav: Any) -> list[str]:
    if isinstance(nav, str):
        return [nav]
    return [page for item in (nav.values() if isinstance(nav, dict) else nav) for page in _pages_in(item)]


def _name(folder: Path, target: str) -> str | None:
    """Return the target of a link to a file outside docs/, as a path in the repository; None for other links."""
    name = (folder / target).resolve().relative_to(ROOT).as_posix()
    is_page = name in PAGES or (name.startswith("docs/") and not name.endswith((".ipynb", ".py")))
    return None if is_page else name


def _from_root(text: str) -> str:
    """Return a document of the repository's root with links relative to docs/."""

    def led(found: re.Match[str]) -> str:
        return found[1] + (PAGES | SHOWN_AS).get(found[2], found[2]).removeprefix("docs/")

    return _LINK.sub(led, text)
