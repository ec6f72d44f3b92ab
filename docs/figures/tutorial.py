"""Runs the tutorial: `python docs/figures/tutorial.py` runs docs/tutorial.ipynb and stores the outputs of its cells.

The stored outputs are the same on every machine, except for run times.
"""

from __future__ import annotations

import os
import re
import sys
import tempfile
from pathlib import Path
from typing import Any

import nbformat
from nbclient import NotebookClient

NOTEBOOK = Path(__file__).resolve().parents[1] / "tutorial.ipynb"
#: Time limit of a cell, in seconds. A cell that takes longer fails.
_LIMIT_S = 600
#: A number with four or more digits. Numbers with fewer digits can be counts, widths or colours instead of results.
_NUMBER = re.compile(r"\d(?:\.?\d){3,}")
_TOOK = re.compile(r"\bin [\d.]+ s\b")


def read(path: Path = NOTEBOOK) -> Any:
    """Return the stored notebook."""
    return nbformat.read(path, as_version=4)  # type: ignore[no-untyped-call] # it publishes no types


def executed(path: Path = NOTEBOOK) -> Any:
    """Return the notebook with the outputs of its cells, which run in order in an empty folder.

    Raises:
        CellExecutionError: A cell fails.
    """
    notebook = read(path)
    # Cells run the `carom` command of the interpreter that runs the notebook.
    programs = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    with tempfile.TemporaryDirectory() as folder:
        client = NotebookClient(
            notebook, timeout=_LIMIT_S, kernel_name="python3", resources={"metadata": {"path": folder}}
        )
        client.execute(env={**os.environ, "PATH": programs})
    for cell in notebook.cells:
        cell.metadata.pop("execution", None)  # The metadata "execution" contains times, which differ in each run.
        if cell.cell_type == "code":
            cell.outputs = _joined(cell.outputs)
    return notebook


def texts(cell: Any) -> list[str]:
    """Return the texts that a cell shows, without run times. For commands (tag `terminal`), return only the numbers."""
    shown = []
    for output in cell.get("outputs", []):
        text = output.get("text") or output.get("data", {}).get("text/plain", "")
        numbers = sorted(set(_NUMBER.findall(text)))
        shown.append(
            " ".join(numbers) if "terminal" in cell.metadata.get("tags", ()) else _TOOK.sub("in some time", text)
        )
    return shown


def _joined(outputs: list[Any]) -> list[Any]:
    """Return the outputs of a cell, with consecutive pieces of printed text joined."""
    joined: list[Any] = []
    for output in outputs:
        if joined and output.output_type == joined[-1].output_type == "stream" and output.name == joined[-1].name:
            joined[-1].text += output.text
        else:
            joined.append(output)
    return joined


if __name__ == "__main__":
    nbformat.write(executed(), NOTEBOOK)  # type: ignore[no-untyped-call] # as above
