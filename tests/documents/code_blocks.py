"""Code blocks of the documents, and checks of commands without running them.

A block is fenced and names its language; one that is not run has the reason above it, ``<!-- not run: REASON -->``, and
a command that is not run begins its comment with the reason, ``# (REASON)``.

- ``toml``, ``json``, ``yaml``: read by the loader that they are for. One whose first line is ``# NAME`` is that file.
- ``python``: the blocks of a page are one script.
- ``sh``: a command a line. ``console``: commands after ``$``, each with what it prints; ``...`` is what is left out.
- ``math`` and ``text``: nothing is run.
"""

import importlib.util
import re
import shlex
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import typer

from carom.cli import app

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
LANGUAGES = {"console", "json", "math", "python", "sh", "text", "toml", "yaml"}

_FENCED = re.compile(
    r"(?:^ *<!-- not run: (?P<reason>[^\n]+) -->\n+)?^(?P<indent> *)```(?P<language>.*)\n(?P<text>(?s:.*?))^ *```$",
    re.M,
)


#: Whatever is wrong with how a command is used; typer itself has no name for it.
_USAGE_ERROR: type[Exception] = typer.BadParameter.__mro__[1]


@dataclass(frozen=True)
class Block:
    """A fenced block."""

    page: str
    line: int
    language: str
    text: str
    reason: str

    def __str__(self) -> str:
        return f"{self.page}:{self.line}"

    @property
    def file(self) -> str | None:
        """Name of the file in a first line such as ``# scene.toml``; None without such a line."""
        found = re.match(r"# ([\w.-]+)\n", self.text)
        return found[1] if found and self.language in {"toml", "json", "yaml"} else None

    def commands(self) -> Iterator[tuple[str, str | None]]:
        """Return each command, run or not, with what it prints where that is shown."""
        if self.language == "sh":
            yield from ((line, None) for line in self.text.splitlines())
        elif self.language == "console":
            for part in re.split(r"^\$ ", self.text, flags=re.MULTILINE)[1:]:
                command, _, output = part.partition("\n")
                yield command, output


def list_blocks(page: Path) -> list[Block]:
    """Return the fenced blocks of a document."""
    text, name = page.read_text(encoding="utf-8"), page.relative_to(ROOT).as_posix()
    return [
        Block(
            name,
            text.count("\n", 0, found.start("language")) + 1,
            found["language"],
            re.sub(f"^{found['indent']}", "", found["text"], flags=re.MULTILINE),
            found["reason"] or "",
        )
        for found in _FENCED.finditer(text)
    ]


def find_unfenced(page: Path) -> list[str]:
    """Return indented lines, which Markdown shows as code."""
    return re.findall(r"(?<=\n\n) {4}(?![-*\d]).+", _FENCED.sub("", page.read_text(encoding="utf-8")))


def find_command_fault(command: str) -> str | None:
    """Return the fault of a command: a missing program, option, target or module; None if it has none."""
    words = shlex.split(command, comments=True)
    if ">" in words:  # where its output goes is no argument
        words = words[: words.index(">")]
    match words:
        case ["carom", *arguments]:
            return _find_carom_fault(arguments)
        case ["make", target, *_]:
            makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
            return None if re.search(rf"^{target}:", makefile, re.MULTILINE) else f"the Makefile has no {target}"
        case ["pytest", *options]:
            plugin = (ROOT / "src" / "carom" / "conformance" / "plugin.py").read_text(encoding="utf-8")
            ours = [option.partition("=")[0] for option in options if option.startswith("--carom")]
            missing = [option for option in ours if f'"{option}"' not in plugin]
            return f"the plug-in has no {missing}" if missing else None
        case ["pip" | ".venv/bin/pip", "install", *what]:
            extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
            asked = {extra for one in what for found in re.findall(r"\[(.+)\]", one) for extra in found.split(",")}
            return f"there is no extra {sorted(asked - extras.keys())}" if asked - extras.keys() else None
        case ["python", "-m", module, *_]:
            return None if importlib.util.find_spec(module) else f"there is no module {module}"
        case ["python", script, *_]:
            return None if (ROOT / script).is_file() else f"there is no script {script}"
        case ["cibuildwheel", *_]:
            return None
    return "the program is none that the documents may use"


def _find_carom_fault(arguments: list[str]) -> str | None:
    commands: dict[str, Any] = vars(typer.main.get_command(app))["commands"]
    name, *rest = arguments
    if name not in commands:
        return f"carom has no command {name}"
    try:
        commands[name].make_context(name, rest[: rest.index(">>")] if ">>" in rest else rest)
    except _USAGE_ERROR as error:
        return str(error)
    return None
