from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from types import SimpleNamespace

import pytest
import tomli_w
import typer
from tests.command import carom_command, told
from tests.lengths import long_after
from tests.stage import disc_at, staged
from typer.main import get_command

import carom
from carom.cli import app
from carom.pages.records_line import records_schema
from carom.scene import scene_schema
from carom.scenes import all_scenes
from carom.shell.shared import resumable

SCENE = tomli_w.dumps(staged("mine", disc_at(0, 0, 1, 0), disc_at(3.0, 0.3, -1, 0), duration_s=2.0).model_dump())


@pytest.fixture
def scene_file(tmp_path: Path) -> Path:
    path = tmp_path / "my-scene.toml"
    path.write_text(SCENE)
    return path


@pytest.mark.usefixtures("in_process")
@pytest.mark.parametrize(("fail_on", "code"), long_after(1, [("inaccurate", 1), ("never", 0)]))
def test_a_violation_is_exit_code_1_and_the_line_can_be_moved(fail_on: str, code: int, tmp_path: Path) -> None:
    """PIT misses `paper/missed`: that is exit code 1, and 0 where nothing is to fail; JUnit says the same."""
    arguments = ("run", "paper/missed", "-e", "pit", "--dt", "1/24", "--no-timing", "--report", tmp_path)
    assert carom_command(*arguments, "--fail-on", fail_on).exit_code == code
    assert f'failures="{code}"' in (tmp_path / "junit.xml").read_text()


@pytest.mark.usefixtures("in_process")
def test_nothing_that_could_be_run_is_exit_code_3(scene_file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One that does not support the scene, and one that is not installed, are exit code 3, with the reason."""
    from carom.runs import engines

    result = carom_command("run", scene_file, "-e", "pit", "--dt", "1e-10", "--no-timing")
    assert result.exit_code == 3
    assert "more steps than an engine can count" in told(result)
    monkeypatch.setattr(engines, "why_unavailable", lambda _adapter: "it is on strike")
    monkeypatch.setattr(engines, "_KNOWN", {})
    result = carom_command("run", scene_file, "-e", "pit", "--dt", "0.1", "--no-timing")
    assert result.exit_code == 3
    assert "it is on strike" in result.output


@pytest.mark.long
def test_names_are_no_markup_and_tell_a_terminal_nothing(tmp_path: Path) -> None:
    """One with brackets is printed as it is, a control character by its escape; the report lies where it says."""
    path = tmp_path / "odd.toml"
    path.write_text(SCENE.replace('"mine"', '"[red]mine[/x]"'))
    folder = tmp_path / "r[red]q[/x]\x1b[31m"
    result = carom_command("run", path, "-e", "pic", "--dt", "0.1", "--no-timing", "--out", folder)
    assert result.exit_code == 0, result.output
    assert "[red]mine[/x]" in result.output
    assert (folder / "index.html").exists()
    assert "r[red]q[/x]\\u001b[31m" in result.output.replace("\n", "")
    assert "\x1b" not in result.output


@pytest.mark.long
def test_a_crash_is_exit_code_4(scene_file: Path) -> None:
    """An engine that gives no answer in time is exit code 4."""
    result = carom_command("run", scene_file, "-e", "pit", "--dt", "1e-7", "--no-timing", "--time-limit", "0.5")
    assert result.exit_code == 4, result.output
    assert "timed out" in result.output


def test_scenes_lists_shows_and_saves(tmp_path: Path) -> None:
    """`carom scenes` has a line a scene, its discs and impacts, shows one as a file that loads, and saves files."""
    lines = carom_command("scenes").output.splitlines()
    assert len(lines) == len(all_scenes()) + 1
    (missed,) = (line for line in lines if line.startswith("paper/missed"))
    assert missed.split()[1:3] == ["2", "1"]
    shown = carom_command("scenes", "paper/missed").output
    path = tmp_path / "copy.toml"
    path.write_text(shown)
    assert carom.load_scene(path).name == "paper/missed"
    saved = carom_command("scenes", "paper", "--save", str(tmp_path / "mine"))
    assert saved.exit_code == 0
    assert len(list((tmp_path / "mine").glob("*.toml"))) == 4


@pytest.mark.parametrize(("command", "schema"), [("scenes", scene_schema), ("diff", records_schema)])
def test_a_schema_is_printed_as_json(command: str, schema: Callable[[], object]) -> None:
    """`carom scenes --schema` prints that of a scene's file, and `carom diff --schema` that of JSON lines."""
    assert json.loads(carom_command(command, "--schema").output) == schema()


def test_engines_lists_each_with_version_or_reason() -> None:
    """`carom engines` names every method that is known, each with a version or why it is unavailable."""
    output = carom_command("engines").output
    for info in carom.engines():
        assert info.name in output
        assert info.version in output if info.available else "unavailable" in output
    lines = output.splitlines()
    assert len([line for line in lines if line.startswith(tuple(info.name for info in carom.engines()))]) == len(
        carom.engines()
    )
    assert all(len(line) <= 80 for line in lines)


def test_an_engine_is_shown_in_full() -> None:
    """`carom engines NAME` shows profiles, capabilities, knobs, how it is installed, and what was reported of it."""
    output = carom_command("engines", "mujoco").output
    for word in ("pip install", "cylinder-plain", "gravity", "stiffness", "issues/mujoco-441", "--show tuned"):
        assert word in output
    assert "tuned" in carom_command("engines", "pit").output


@pytest.mark.usefixtures("in_process")
def test_settings_are_printed_to_paste() -> None:
    """`carom engines NAME --show PROFILE` prints the engine's own code, with what was asked for in it."""
    arguments = ("--show", "tuned", "--dt", ".002", "--restitution", ".9", "--friction", ".3")
    model = carom_command("engines", "mujoco", *arguments).output
    assert 'timestep="0.002"' in model
    assert 'friction="0.3 0 0"' in model
    solref = -(1 + 0.9) / 0.002  # MuJoCo's damping that makes -0.9 v of v in one Euler step
    assert f'solref="0.0 {solref!r}"' in model
    assert "space.step(dt)" in carom_command("engines", "pymunk", "--show", "default", "--scene", "classics/box").output


def test_help_says_what_each_command_does() -> None:
    """`carom --help` shows first sentences whole, `carom COMMAND --help` all options, their types by plain words."""
    listing = told(carom_command("--help"))
    commands = get_command(app).commands  # type: ignore[attr-defined]  # a group, which the annotation does not say
    assert {"run", "bench", "advise", "certify", "stress", "scenes", "engines"} <= set(commands)
    for name, command in commands.items():
        assert f"{name} {command.help.partition(chr(10) * 2)[0]}" in listing
        shown = carom_command(name, "--help").output
        offered = [parameter for parameter in command.params if not getattr(parameter, "hidden", False)]
        assert all(option in shown for parameter in offered for option in parameter.opts if "--" in option)
        assert not re.search(r"<\w|--[\w-]+ (str|int|float|list|path)\b", shown)


@pytest.mark.long
@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="asks /proc which processes are left")
@pytest.mark.usefixtures("heard_interrupts")
def test_ctrl_c_leaves_no_mess(tmp_path: Path, scene_file: Path) -> None:
    """Ctrl-C in a long run ends it with exit code 130 and a sentence, leaves no report and no process behind."""
    report = tmp_path / "report"
    options = ("-e", "pit", "--dt", "1e-7", "--report", str(report))
    command = [sys.executable, "-m", "carom", "run", str(scene_file), *options]
    process = subprocess.Popen(
        command, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True, start_new_session=True
    )
    deadline = time.monotonic() + 120
    # The journal is there when adapters have been asked; the run has begun when a worker works: a keeper's child.
    while not ((report / "journal.jsonl").exists() and _works(children := _descendants(process.pid))):
        assert process.poll() is None
        assert time.monotonic() < deadline
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    try:
        _, error = process.communicate(timeout=120)
    finally:
        process.kill()  # of no effect on one that has ended
    assert process.returncode == 130
    assert "interrupted" in error
    assert "Traceback" not in error
    assert not report.exists()
    assert not any(Path(f"/proc/{child}").exists() for child in children)


def _children(pid: int) -> list[int]:
    try:
        lists = [task.read_text() for task in Path(f"/proc/{pid}/task").glob("*/children")]
    except (FileNotFoundError, ProcessLookupError):  # it has just ended
        return []
    return [int(child) for text in lists for child in text.split()]


def _descendants(pid: int) -> list[int]:
    return [one for child in _children(pid) for one in (child, *_descendants(child))]


def _works(pids: list[int]) -> bool:
    """Whether one of them has used a tenth of a second: a run of ten million steps does."""
    ticks = 0
    for pid in pids:
        with suppress(FileNotFoundError, ProcessLookupError):
            ticks = max(ticks, int(Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[11]))
    return ticks >= 0.1 * os.sysconf("SC_CLK_TCK")


def test_ctrl_c_before_anything_is_finished_promises_no_journal(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Where no journal is left, the interruption is handed on; where one is, it is told with what goes on from it."""

    def interrupt() -> None:
        with resumable(tmp_path / "journal.jsonl"):
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupt()
    assert capsys.readouterr().err == ""
    (tmp_path / "journal.jsonl").touch()
    with pytest.raises(typer.Exit):
        interrupt()
    assert f"is in {tmp_path / 'journal.jsonl'}, and --resume goes on from there" in capsys.readouterr().err


COMMANDS_WITH_JOURNALS = {
    "run": ("run", "classics/bullet", "-e", "pit"),
    "bench": ("bench", "classics/bullet", "-e", "pit"),
    "grow": ("bench", "--grow", "-e", "pic"),
    "stress": ("stress", "grazing", "--quick", "-e", "pit"),
    "tune": ("tune", "pit", "classics/bullet"),
}


@pytest.mark.usefixtures("in_process")
@pytest.mark.parametrize("moment", long_after(2, ["made", "opened", "written", "marked"]))
@pytest.mark.parametrize("command", long_after(1, COMMANDS_WITH_JOURNALS))
def test_ctrl_c_while_a_journal_is_made_leaves_nothing(
    command: str, moment: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A signal when the folder is marked, or a journal opened, begun or just made, ends in 130 and leaves no folder."""

    def ends(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    def opens(path: str | Path, flags: int, mode: int = 0o777) -> int:
        file = os.open(path, flags, mode)
        if str(path).endswith(".jsonl"):
            os.close(file)
            raise KeyboardInterrupt
        return file

    def begins(path: Path, _: object) -> None:
        path.touch()
        raise KeyboardInterrupt

    if moment == "marked":
        monkeypatch.setattr("carom.folders._put", begins)
    elif moment == "opened":
        monkeypatch.setattr("carom.runs.journal.os", SimpleNamespace(**{**vars(os), "open": opens}))
    elif moment == "written":
        monkeypatch.setattr("carom.runs.journal.os", SimpleNamespace(**{**vars(os), "fsync": ends}))
    else:
        monkeypatch.setattr("carom.runs.journal.Journal.__enter__", ends)
    out = tmp_path / "out"
    result = carom_command(*COMMANDS_WITH_JOURNALS[command], "--out", out)
    assert result.exit_code == 130, result.output
    assert not out.exists(), list(out.iterdir())


@pytest.mark.long
def test_a_run_of_one_scene_ends_with_the_command_that_prints_the_settings() -> None:
    """The best engine's settings at the step that was run, for the scene as asked; the command gives code."""
    asked = ["run", "paper/late", "-e", "pit", "-e", "pymunk", "-p", "default", "--no-timing", "--fail-on", "never"]
    *_, said, command = carom_command(*asked).output.splitlines()
    assert said == "Settings of pymunk default, as code to paste:"
    assert command == "carom engines pymunk --show default --dt 1/24 --scene paper/late"
    assert "space.step(dt)" in carom_command(*command.split()[1:]).output
    alone = carom_command("run", "paper/late", "-e", "pit", "-p", "tuned", "--no-timing").output
    assert "to paste" not in alone


def test_the_list_names_every_kind_of_line() -> None:
    """`--list` names attacks, relations and complaints, and runs nothing."""
    result = carom_command("stress", "--list")
    assert result.exit_code == 0
    for name in ("grazing", "boost", "mujoco-441"):
        assert name in result.output


@pytest.mark.usefixtures("in_process")
def test_a_quick_attack_prints_a_table_and_writes_its_files(tmp_path: Path) -> None:
    """One attack on PIT: the table, the summary, the documents, the journal and the scene of its number."""
    result = carom_command("stress", "tunnelling", "-e", "pit", "--quick", "--out", tmp_path)
    assert result.exit_code == 0, result.output
    assert "pit tuned" in result.output
    assert "tunnelling at" in result.output
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {"stress.html", "stress.md", "stress.json", "journal.jsonl", "scenes", ".carom"}
    assert (tmp_path / "scenes" / "tunnelling.pit.tuned.toml").exists()
