"""What the command does where its output can't be written as it is, or its options are out of reason."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from tests.command import carom_command

LIST = (sys.executable, "-m", "carom", "scenes")


@pytest.mark.long
def test_a_reader_that_has_seen_enough_is_no_error() -> None:
    """Into `head -1` the command ends with exit code 0 and says nothing of the pipe."""
    read, write = os.pipe()
    os.close(read)  # it has seen enough before the first line
    with os.fdopen(write, "wb") as out:
        done = subprocess.run(LIST, stdout=out, stderr=subprocess.PIPE, check=False)
    assert (done.returncode, done.stderr) == (0, b"")


@pytest.mark.long
@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no /dev/full here")
@pytest.mark.parametrize("arguments", [("scenes",), ("--help",), ("scenes", "paper")])
def test_a_full_disk_is_a_sentence_and_exit_code_2(arguments: tuple[str, ...]) -> None:
    """Output that can't be written ends in a sentence, however late it is found."""
    with Path("/dev/full").open("wb") as full:
        done = subprocess.run(
            [sys.executable, "-m", "carom", *arguments], stdout=full, stderr=subprocess.PIPE, check=False
        )
    assert done.returncode == 2
    assert done.stderr.decode().splitlines() == ["carom: output: No space left on device"]


@pytest.mark.long
def test_an_output_of_ascii_alone_gets_ascii() -> None:
    """With no encoding but ASCII nothing raises, in results or messages; each sign has one that stands for it."""
    plain = {**os.environ, "LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0", "PYTHONIOENCODING": "ascii"}
    command, missed = (
        (sys.executable, "-m", "carom", "run"),
        ("paper/missed", "-e", "pit", "--no-timing", "--dt", "1/24"),
    )
    done = subprocess.run([*command, *missed], env=plain, capture_output=True, check=False)
    assert done.returncode == 1
    assert done.stdout.isascii()
    done = subprocess.run([*command, "d\u00e9j\u00e0-\u2713"], env=plain, capture_output=True, check=False)
    assert done.returncode == 2
    assert done.stderr.isascii()
    assert b"no scene is named" in done.stderr


@pytest.mark.parametrize(
    "command",
    [
        "run paper/missed -e pit --no-timing",
        "bench paper/missed -e pit --no-timing",
        "bench --grow -e pit --discs 2",
        "stress small -e pit --quick",
        "certify paper/missed",
    ],
)
def test_a_folder_of_somebody_elses_is_refused_before_the_run(command: str, tmp_path: Path) -> None:
    """Every command that writes leaves a folder alone that holds what it did not write, and names its option."""
    (tmp_path / "index.html").write_text("mine")
    (tmp_path / "scenes").mkdir()
    result = carom_command(*command.split(), "--out", tmp_path)
    assert result.exit_code == 2
    assert "holds files that Carom did not write, such as index.html\n" in result.output
    assert "\nhint: name another folder by --out\n" in result.output
    assert sorted(path.name for path in tmp_path.iterdir()) == ["index.html", "scenes"]
    assert (tmp_path / "index.html").read_text() == "mine"


def test_a_scene_that_was_saved_and_edited_is_not_saved_over(tmp_path: Path) -> None:
    """A scene of the catalogue is its owner's once it is saved: saved a second time, it is refused."""
    arguments = ["scenes", "paper/missed", "--save", str(tmp_path)]
    assert carom_command(*arguments).exit_code == 0
    (tmp_path / "paper.missed.toml").write_text("edited")
    result = carom_command(*arguments)
    assert result.exit_code == 2
    assert "exists already, and may have been edited: name another folder by --out" in result.output
    assert (tmp_path / "paper.missed.toml").read_text() == "edited"


def test_a_scenes_own_file_is_not_certified_over(tmp_path: Path) -> None:
    """A scene named as its own file is certified into a folder of its own, not over itself."""
    assert carom_command("scenes", "paper/missed", "--save", str(tmp_path)).exit_code == 0
    scene = tmp_path / "paper.missed.toml"
    before = scene.read_bytes()
    assert carom_command("certify", str(scene), "--out", str(tmp_path)).exit_code == 2
    assert scene.read_bytes() == before


def test_two_scenes_whose_names_differ_little_have_two_files(tmp_path: Path) -> None:
    """Names that differ by a separator alone, or by capitals, are certified into files of their own."""
    saved = tmp_path / "mine"
    assert carom_command("scenes", "paper/missed", "--save", str(saved)).exit_code == 0
    text = (saved / "paper.missed.toml").read_text()
    names = ("a/b", "a-b", "A-b", "a.b")
    for k, name in enumerate(names):
        (saved / f"{k}.toml").write_text(text.replace("paper/missed", name))
    files = [str(saved / f"{k}.toml") for k in range(len(names))]
    assert carom_command("certify", *files, "--out", str(tmp_path / "out")).exit_code == 0
    found = [path.name.lower() for path in (tmp_path / "out").glob("*.json")]
    assert len(set(found)) == len(names)


@pytest.mark.skipif(sys.platform != "linux", reason="address space is limited on Linux")
def test_little_address_space_is_a_sentence_and_exit_code_2(tmp_path: Path) -> None:
    """Where NumPy gets no memory, that is no violation; help and version do without."""
    command = 'ulimit -v 100000; exec "$0" -m carom "$@"'
    run = ("run", "paper/late", "-e", "pit", "--no-timing", "--report", str(tmp_path / "report"))
    done = subprocess.run(["sh", "-c", command, sys.executable, *run], capture_output=True, text=True, check=False)
    assert done.returncode == 2, done.stderr
    assert "Traceback" not in done.stderr
    assert done.stderr.splitlines()[-1].startswith("carom: ")
    assert "(ulimit -v)" in done.stderr
    for words in (("--help",), ("--version",)):
        helped = subprocess.run(["sh", "-c", command, sys.executable, *words], capture_output=True, check=False)
        assert helped.returncode == 0
