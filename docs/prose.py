"""Finds style faults in documents and sources, counts words, and computes the reading ease of hand-written documents.

``python -m docs.prose`` checks limits and style, and exits with 1 if there is a fault. The argument ``words`` prints
the number of words per section, and ``ease`` prints the Flesch reading ease of each page. Generated blocks of pages are
not counted.
"""

from __future__ import annotations

import re
import statistics
import sys
from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path

from docs import prose_sources

ROOT = Path(__file__).resolve().parents[1]
#: Pages that are generated completely.
GENERATED = {"docs/results/hazards.md", "docs/results/history.md", "docs/results/determinism.md"}
#: Largest allowed numbers of words: in all pages together, in each page, and in pages of some kinds.
MOST_WORDS, MOST_WORDS_PER_PAGE = 40_000, 3_000
LIMITS = {
    r"README\.md": 700,
    r"CHANGELOG\.md": 500,
    r"docs/contributing/decisions/0.*": 200,
    r"docs/how-to/.*": 500,
}
MOST_WORDS_IN_SENTENCE = 40
TARGET_EASE = 45

_GENERATED_BLOCK = re.compile(
    r"<!-- made by [^\n]*-->\n.*?<!-- end -->|<!-- (\w+): make contact -->.*?<!-- end of \1 -->"
    r"|<!-- (attacks|mutants): begin -->.*?<!-- \2: end -->|<!-- throw -->\n.*?<!-- thrown -->",
    re.DOTALL,
)
_FENCED = re.compile(r"^ *```.*?^ *```$", re.DOTALL | re.MULTILINE)
#: Words that the style guide excludes (rule 3), and words to write instead.
INSTEAD = {
    r"told": "reported",
    r"held (to|against)": "compared with",
    r"beside": "next to",
    r"besides": "also",
    r"whoever": "anyone who",
    r"but for": "except for",
    r"so many": "a number",
    r"stands?(?! (still|alone|out))": "is",
    r"(comes?|came) to(?! rest\b| a (stop|rest)\b)": "becomes, is",
    r"nothing of": "none of",
    r"lies?(?! (up)?on\b)|laid(?! out\b)": "is",
    r"let pass": "ignored",
    r"anew": "again",
    r"taken forward": "advanced",
    r"(?<!the )(?<!an )(?<!no )answers? for": "is responsible",
    r"gives? way": "fails",
    r"hand(s|ed)? over": "return, pass",
    r"in place of": "instead of",
    r"as its definition does": "like its definition",
    r"(?<!\")parted": "diverged",
    r"errs?|erred": "is off by, has an error of",
    r"(hangs?|hung|hanging) on": "depends on",
    r"impacts (are )?lost": "impacts missed or spurious",
    r"may be believed": "is reliable",
}
_WORDS = re.compile(rf"\b({'|'.join(INSTEAD)})\b", re.IGNORECASE)
#: Word orders in which the subject comes last.
_INVERSIONS = (
    re.compile(r"^Of (?!course\b)[^,.;:]+, [^.]*"),
    re.compile(r"^(Not|Neither|Nor|So|Nowhere|Never|Only then) (is|are|was|were|does|do|did|can|has|have)\b"),
    re.compile(r"^(Said|Left out|Counted|Asked|Measured|Compared|Meant|Kept|Shown) (is|are|was|were)\b"),
    re.compile(r"\bof which (it|they)\b|\bof it (is|are|it|they)\b", re.IGNORECASE),
)


def pages() -> dict[str, str]:
    """Return the documents by their paths from the repository's root."""
    paths = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
    return {path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8") for path in paths}


def hand_written(name: str, text: str) -> str:
    """Return a page without its generated parts."""
    return "" if name in GENERATED else _GENERATED_BLOCK.sub("", text)


def count_words(name: str, text: str) -> int:
    """Return the number of hand-written words, including those in code blocks and tables."""
    return len(hand_written(name, text).split())


def paragraphs(text: str) -> Iterator[str]:
    """Yield paragraphs, list items and table cells as plain text. A piece of code, a formula or a URL is one word."""
    text = re.sub(r"<!--.*?-->", "", _FENCED.sub("\n\n", text), flags=re.DOTALL)
    text = re.sub(r"!?\[((?:[^\[\]]|\[[^\]]*\])*)\](\([^)]*\)|\[[^\]]*\])", r"\1", text)
    text = re.sub(r"`[^`]+`|\$[^$]+\$|https?://\S+", "Code", text)
    text = re.sub(r"</?[A-Za-z][^>]*>|[*_]{1,2}(?=\S)|(?<=\S)[*_]{1,2}", "", text)
    for block in re.split(r"\n\s*\n|\n(?=\s*(?:[-*]|\d+\.) )", text):
        lines = [line.strip() for line in block.splitlines() if line.strip() and not line.startswith("#")]
        if lines and lines[0].startswith("|"):
            yield from (cell.strip() for line in lines for cell in line.split("|") if re.search(r"\w", cell))
        elif lines:
            yield re.sub(r"^([-*]|\d+\.) ", "", " ".join(lines))


def sentences(paragraph: str) -> list[str]:
    """Return the sentences of a paragraph."""
    return [one for one in re.split(r"(?<=[.!?])[\"')]?\s+(?=[\"'(]?[A-Z])", paragraph) if re.search(r"\w", one)]


def faults(name: str, text: str) -> Iterator[str]:
    """Yield each word, length and word order that the style guide excludes."""
    for sentence in (one for paragraph in paragraphs(hand_written(name, text)) for one in sentences(paragraph)):
        start = f"{name}: {sentence[:70]!r}"
        for found in _WORDS.finditer(sentence):
            new = next(new for old, new in INSTEAD.items() if re.match(old, found[0], re.IGNORECASE))
            yield f"{start}: {found[0]!r}, write {new!r}"
        if (length := len(re.findall(r"\w[\w'\u2019.,-]*", sentence))) > MOST_WORDS_IN_SENTENCE:
            yield f"{start}: {length} words"
        if any(pattern.search(sentence) for pattern in _INVERSIONS):
            yield f"{start}: the subject comes first"


def source_faults(paths: Iterable[str]) -> Iterator[str]:
    """Yield the style faults of source files, each with path and line."""
    for path in paths:
        for passage in prose_sources.passages(path, (ROOT / path).read_text(encoding="utf-8")):
            yield from faults(f"{path}:{passage.line}", passage.text)


def over_limit(texts: dict[str, str]) -> Iterator[str]:
    """Yield a message for each page with too many words, and a message if all pages together have too many."""
    counts = {name: count_words(name, text) for name, text in texts.items()}
    for name, count in counts.items():
        limits = [limit for pattern, limit in LIMITS.items() if re.fullmatch(pattern, name)]
        if count > (limit := min([MOST_WORDS_PER_PAGE, *limits])):
            yield f"{name}: {count:,} words, at most {limit:,}"
    total = sum(count for name, count in counts.items() if name != "CHANGELOG.md")
    if total > MOST_WORDS:
        yield f"all pages: {total:,} words, at most {MOST_WORDS:,}"


def count_syllables(word: str) -> int:
    """Estimate the syllables of an English word: groups of vowels, without a silent e at the end."""
    groups = len(re.findall(r"[aeiouy]+", word.lower()))
    silent = re.search(r"[^aeiouyl]e(s|d)?$", word.lower()) and not re.search(
        r"([td]ed|[sxz]es|[cg]es|ches|shes)$", word
    )
    return max(1, groups - bool(silent))


def reading_ease(paragraph: str) -> float:
    """Return the Flesch reading ease of a paragraph."""
    words = re.findall(r"[A-Za-z][A-Za-z'\u2019]*", paragraph)
    per_sentence, per_word = len(words) / len(sentences(paragraph)), sum(map(count_syllables, words)) / len(words)
    return 206.835 - 1.015 * per_sentence - 84.6 * per_word


def page_ease(name: str, text: str) -> float | None:
    """Return the median reading ease of a page's paragraphs of eight words and more."""
    found = [p for p in paragraphs(hand_written(name, text)) if len(re.findall(r"[A-Za-z]+", p)) >= 8]
    return statistics.median(map(reading_ease, found)) if found else None


def main(task: str = "check") -> int:
    """Run a task of the command line, and return the exit code."""
    texts = pages()
    if task == "words":
        sections = Counter[str]()
        for name, text in texts.items():
            sections[name if name.count("/") < 2 else name.rpartition("/")[0]] += count_words(name, text)
        print("\n".join(f"{name:40}{count:8,}" for name, count in sections.items()))
        print(f"{'hand-written words':40}{sections.total():8,}")
        return 0
    if task == "ease":
        eases = {name: ease for name, text in texts.items() if (ease := page_ease(name, text)) is not None}
        print("\n".join(f"{name:64}{ease:4.0f}{' low' if ease < TARGET_EASE else ''}" for name, ease in eases.items()))
        print(f"{'reading ease, median of pages':64}{statistics.median(eases.values()):4.0f}")
        return 0
    texts["CHANGELOG.md"] = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    found = [*over_limit(texts), *(fault for name, text in texts.items() for fault in faults(name, text))]
    found += source_faults(prose_sources.source_paths())
    print("\n".join(found) or "documents and sources: no fault")
    return bool(found)


if __name__ == "__main__":
    raise SystemExit(main(*sys.argv[1:]))
