"""Every block of code in the documents is read by its loader, checked, and run."""

import json
import os
import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
import yaml
from tests.cases import each
from tests.documents.code_blocks import LANGUAGES, PAGES, ROOT, find_command_fault, find_unfenced, list_blocks

import carom
from carom.cli import COMMANDS
from carom.conformance.known_failures import load_known_failures

BLOCKS = [block for page in PAGES for block in list_blocks(page)]
SCENE = next(block for block in BLOCKS if block.page == "README.md" and block.file == "my-scene.toml")


def test_code_blocks_are_fenced_with_a_known_language() -> None:
    """Every code block is fenced with a known language, and each reason not to run one is used."""
    for page in PAGES:
        blocks, text = list_blocks(page), page.read_text(encoding="utf-8")
        assert find_unfenced(page) == [], page
        assert {block.language for block in blocks} <= LANGUAGES, page
        assert text.count("```") == 2 * len(blocks), page
        assert text.count("<!-- not run: ") == sum(bool(one.reason) for one in blocks), page


def test_data_blocks_load_and_python_blocks_compile(tmp_path: Path) -> None:
    """TOML, JSON and YAML blocks are readable, scenes and known failures load, and Python blocks compile."""
    loaders = {"toml": tomllib.loads, "json": json.loads, "yaml": yaml.safe_load}
    for block in BLOCKS:
        if block.language == "python":
            compile(block.text, str(block), "exec")
        elif block.language in loaders:
            path = tmp_path / f"block.{block.language}"
            path.write_text(block.text, encoding="utf-8")
            read = loaders[block.language](block.text)
            assert read, block
            if "discs" in read:
                assert carom.load_scene(path).discs
            if "known_failure" in read:
                assert load_known_failures(path)


def test_documented_commands_exist() -> None:
    """Each program, option, target and module in the documents exists, also in commands that are not run."""
    asked = [(str(block), command) for block in BLOCKS for command, _ in block.commands()]
    names = "|".join(COMMANDS)
    for page in PAGES:
        text = re.sub(r"\bN\b", "1", page.read_text(encoding="utf-8"))
        found = re.findall(rf"(?<=`)carom (?:{names}) [^`\n]+(?=`)|(?<=- run: )carom .+", text)
        asked += [(page.name, command) for command in found]
    assert len(asked) > 100
    assert [(where, command, fault) for where, command in asked if (fault := find_command_fault(command))] == []


def run_command(words: list[str], folder: Path) -> subprocess.CompletedProcess[str]:
    """Run a command in a folder, with the programs of this environment, as into a pipe."""
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    environment = {**os.environ, "MPLBACKEND": "agg", "PATH": path}
    return subprocess.run(words, cwd=folder, env=environment, capture_output=True, text=True, check=False)


def matches_output(expected: str, printed: str) -> bool:
    """Whether a command printed the shown lines, of any width; ... matches any lines."""
    shown = [" ".join(line.split()) for line in expected.strip().splitlines()]
    pattern = "\n".join("(?s:.*)" if line == "..." else re.escape(line) for line in shown)
    lines = "\n".join(" ".join(line.split()) for line in printed.strip().splitlines())
    return re.fullmatch(pattern, lines) is not None


@pytest.mark.long
@each("page", sorted({b.page for b in BLOCKS if b.language in {"python", "sh", "console"} and not b.reason}))
def test_blocks_of_a_page_run_as_printed(page: str, tmp_path: Path) -> None:
    """The files, Python blocks and commands of a page run, and print what the page shows."""
    blocks = [block for block in BLOCKS if block.page == page and not block.reason]
    for block in (SCENE, *blocks):
        if block.file:
            (tmp_path / block.file).write_text(block.text, encoding="utf-8")
    if script := "".join(block.text for block in blocks if block.language == "python"):
        (tmp_path / "script.py").write_text(script, encoding="utf-8")
        done = run_command([sys.executable, "-W", "error", "script.py"], tmp_path)
        assert done.returncode == 0, done.stderr
    for block in blocks:
        for command, shown in block.commands():
            if " # (" in command:
                continue
            words = shlex.split(command, comments=True)
            words, into = (words[:-2], words[-1]) if ">" in words else (words, "")
            done = run_command(words, tmp_path)
            if into:
                (tmp_path / into).write_text(done.stdout, encoding="utf-8")
            assert done.returncode in ({0, 1} if words[:2] in (["carom", "run"], ["carom", "diff"]) else {0}), (
                f"{block}: {command}\n{done.stdout}{done.stderr}"
            )
            assert shown is None or matches_output(shown, done.stdout), f"{block}: {command}\n{done.stdout}"


def test_output_pattern_detects_differences() -> None:
    """A shown output differs by an extra or missing line or another number; widths and `...` are ignored."""
    printed = "one 1.5\n\n  two\nthree\n"
    assert matches_output("one 1.5\n\ntwo\nthree", printed)
    assert matches_output("one    1.5\n...\nthree\n", printed)
    assert not matches_output("one 1.5\n\ntwo", printed)
    assert not matches_output("one 1x5\n...\n", printed)
    assert not matches_output("...\nfour", printed)
    assert SCENE.text.startswith("# my-scene.toml\n")
    assert (ROOT / SCENE.page).is_file()
