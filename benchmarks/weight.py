"""Number of lines of code, without blank lines, comments and docstrings: ``python -m benchmarks.weight [REVISION]``.

The count includes ``src/carom`` without solvers, core and the comparison of single steps. With a revision of git, the
table also shows the numbers at this revision.
"""

from __future__ import annotations

import ast
import io
import subprocess
import sys
import tokenize
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).parents[1]
PACKAGE = "src/carom/"
#: Packages and modules that are not counted.
LEFT_OUT = (
    *("core", "solvers", "model/broad_phase", "model/step_windows.py"),
    *("comparator/stepwise", "comparator/measure/stepwise_score.py", "comparator/measure/reported_impacts.py"),
    *("physics", "broad_phase", "comparator/local_truth", "windows.py"),  # Packages and modules of earlier revisions.
)

#: A line with only these tokens contains no code.
_NO_CODE = {tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER}


def code_lines(text: str) -> int:
    """Return the number of lines with code in a module."""
    lines: set[int] = set()
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type not in _NO_CODE:
            lines.update(range(token.start[0], token.end[0] + 1))
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef) and (
            ast.get_docstring(node, clean=False) is not None
        ):
            lines.difference_update(range(node.body[0].lineno, (node.body[0].end_lineno or 0) + 1))
    return len(lines)


def weight(texts: dict[str, str]) -> Counter[str]:
    """Return the number of lines of each counted package. `texts` maps the paths of modules to their texts."""
    found: Counter[str] = Counter()
    for path, text in texts.items():
        inside = path.removeprefix(PACKAGE)
        if path.startswith(PACKAGE) and path.endswith(".py") and not inside.startswith(LEFT_OUT):
            found[inside.partition("/")[0]] += code_lines(text)
    return found


def now() -> dict[str, str]:
    """Return the modules of the working tree."""
    return {path.relative_to(ROOT).as_posix(): path.read_text("utf-8") for path in (ROOT / PACKAGE).rglob("*.py")}


def then(revision: str) -> dict[str, str]:
    """Return the modules of a revision."""

    def git(*words: str) -> str:
        return subprocess.run(  # noqa: S603 - git, with a revision that the caller names
            ["git", *words],  # noqa: S607
            cwd=ROOT,
            check=True,
            capture_output=True,
            text=True,
        ).stdout

    paths = git("ls-tree", "-r", "--name-only", revision, "--", PACKAGE).splitlines()
    return {path: git("show", f"{revision}:{path}") for path in paths if path.endswith(".py")}


def main() -> None:
    """Print the number of lines of each package and the sum, now and at a revision."""
    here = weight(now())
    there = weight(then(sys.argv[1])) if len(sys.argv) > 1 else None
    for room in sorted(here.keys() | (there or {}).keys()):
        print(f"{room:24}{here[room]:7}" + ("" if there is None else f"{there[room]:7}{here[room] - there[room]:+7}"))
    total = here.total()
    print(f"{'all':24}{total:7}" + ("" if there is None else f"{there.total():7}{total - there.total():+7}"))


if __name__ == "__main__":
    main()
