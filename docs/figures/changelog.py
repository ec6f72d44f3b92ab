"""Move the entries of `changelog.d` into the changelog's newest section: ``python docs/figures/changelog.py``."""

from __future__ import annotations

from pathlib import Path

ROOT = Path(__file__).parents[2]
SECTION = "\n## "


def assemble(changelog: Path, fragments: Path) -> None:
    """Put the entries of all files at the top of the newest section, and remove the files.

    Raises:
        ValueError: The changelog has no section, or a file is not a list.
    """
    found = sorted(path for path in fragments.glob("*.md") if path.name != "README.md")
    texts = [path.read_text("utf-8").strip("\n") for path in found]
    for path, text in zip(found, texts, strict=True):
        if not text.startswith("- "):
            raise ValueError(f"{path}: the text must be a list, and must begin with '- '")
    before, section, rest = changelog.read_text("utf-8").partition(SECTION)
    title, blank, entries = rest.partition("\n\n")
    if not (section and blank):
        raise ValueError(f"{changelog}: there is no section with entries")
    changelog.write_text("".join([before, section, title, blank, *(f"{text}\n" for text in texts), entries]), "utf-8")
    for path in found:
        path.unlink()


if __name__ == "__main__":
    assemble(ROOT / "CHANGELOG.md", ROOT / "changelog.d")
