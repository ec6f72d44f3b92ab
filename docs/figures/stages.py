"""Diagram of a comparison's stages in `docs/contributing/architecture.md`: `python docs/figures/stages.py` writes it.

The diagram is derived from the calls in `carom.comparator.compare`, and from the imports of the called modules.
"""

from __future__ import annotations

import ast
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "contributing" / "architecture.md"
_BLOCK = re.compile(r"(<!-- made by docs/figures/stages\.py -->\n)(?s:.*?)(<!-- end -->)")
_PACKAGE = "carom.comparator."


def _tree(module: str) -> ast.Module:
    path = ROOT / "src" / Path(*module.split("."))
    return ast.parse((path / "__init__.py" if path.is_dir() else path.with_suffix(".py")).read_text(encoding="utf-8"))


def imported_names(module: str) -> dict[str, str]:
    """Return the names that a module imports from the comparator, each with the module that defines it."""
    found = [node for node in ast.walk(_tree(module)) if isinstance(node, ast.ImportFrom)]
    return {
        alias.name: node.module
        for node in found
        if node.module is not None and node.module.startswith(_PACKAGE)
        for alias in node.names
    }


def stages() -> list[tuple[str, str, str]]:
    """Return the function, the module and the type of the result of each stage, in the order of the calls."""
    module, found = "carom.comparator.compare", []
    imported = imported_names(module)
    (run,) = (node for node in _tree(module).body if getattr(node, "name", "") == "_run_stages")
    for node in ast.walk(run):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and (name := node.func.id) in imported:
            (entry,) = (n for n in _tree(imported[name]).body if isinstance(n, ast.FunctionDef) and n.name == name)
            found.append((node.lineno, name, imported[name], ast.unparse(entry.returns) if entry.returns else ""))
    return [stage for _, *stage in sorted(found)]  # type: ignore[misc] # three strings


def package_of(module: str) -> str:
    """Return the subpackage of the comparator that contains a module."""
    return module.removeprefix(_PACKAGE).partition(".")[0]


def diagram() -> str:
    """Return the diagram: each stage, its result, and which other parts of the comparator it imports."""
    found, lines = stages(), ["traces: reference, observed, PIT"]
    parts = {package_of(module) for _, module, _ in found}
    for name, module, result in found:
        part = package_of(module)
        path = ROOT / "src" / "carom" / "comparator" / part
        modules = [f"{_PACKAGE}{part}.{file.stem}" for file in sorted(path.glob("[!_]*.py"))] or [module]
        used = {package_of(source) for one in modules for source in imported_names(one).values()} - parts
        where = f"{part}/" if path.is_dir() else f"{part}.py"
        lines += [f"  | {name:16} {where:20} with {', '.join(sorted(used))}", f"{result}"]
    return "".join(f"{line}\n" for line in ["```text", *lines, "```"])


def filled(page: str) -> str:
    """Return the page with the diagram."""
    return _BLOCK.sub(lambda found: found[1] + diagram() + found[2], page)


if __name__ == "__main__":
    PAGE.write_text(filled(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
