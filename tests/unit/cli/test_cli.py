"""The command line as a user types it: what it writes, what it refuses, and how it ends."""

import base64
import hashlib
import json
import os
import re
import shlex
import signal
import subprocess
import sys
import time
import tomllib
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
import tomli_w
import typer
from tests.cases import each, release_after
from tests.command import carom_command, told
from tests.processes import PATIENT_S, ended
from tests.scene_builders import disc_at, staged
from tests.unit.cli.test_options import STUDIES
from tests.validation.certified_files import from_enclosures
from typer.main import get_command
from typer.testing import CliRunner

import carom
from carom import Disc, Scene, save_scene
from carom.catalogue import all_scenes
from carom.cli import app, build_app
from carom.cli.command_line import get_command_line
from carom.cli.common import guard_journals
from carom.engines.api import Profile
from carom.errors import InputError
from carom.execution import describe_engines
from carom.model.scene_file import build_scene_schema
from carom.report.results_file.json_lines import build_records_schema
from carom.studies.tune.search import KnobSearch
from carom.support.options import list_declared_options
from carom.web.engine_script import PageEngine, link_script
from carom.web.packages import PACKAGES, load_package_script
from carom.web.page import add_gallery, build_page_script, render_page

SCENE = tomli_w.dumps(staged("mine", disc_at(0, 0, 1, 0), disc_at(3.0, 0.3, -1, 0), duration_s=2.0).model_dump())


@pytest.fixture
def scene_file(tmp_path: Path) -> Path:
    path = tmp_path / "my-scene.toml"
    path.write_text(SCENE)
    return path


@pytest.mark.usefixtures("in_process")
@pytest.mark.parametrize(("fail_on", "code"), release_after(1, [("inaccurate", 1), ("never", 0)]))
def test_a_violation_is_exit_code_1_and_the_line_can_be_moved(fail_on: str, code: int, tmp_path: Path) -> None:
    """PIT misses `paper/missed`: that is exit code 1, and 0 where nothing is to fail; JUnit says the same."""
    arguments = ("run", "paper/missed", "-e", "pit", "--dt", "1/24", "--no-timing", "--report", tmp_path)
    assert carom_command(*arguments, "--fail-on", fail_on).exit_code == code
    assert f'failures="{code}"' in (tmp_path / "junit.xml").read_text()


@pytest.mark.usefixtures("in_process")
def test_nothing_that_could_be_run_is_exit_code_3(scene_file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One that does not support the scene, and one that is not installed, are exit code 3, with the reason."""
    result = carom_command("run", scene_file, "-e", "pit", "--dt", "1e-10", "--no-timing")
    assert result.exit_code == 3
    assert "more steps than an engine can count" in told(result)
    monkeypatch.setattr(describe_engines, "explain_unavailable_adapter", lambda _adapter: "it is on strike")
    monkeypatch.setattr(describe_engines, "_KNOWN", {})
    result = carom_command("run", scene_file, "-e", "pit", "--dt", "0.1", "--no-timing")
    assert result.exit_code == 3
    assert "it is on strike" in result.output


@pytest.mark.long
def test_names_are_no_markup_and_tell_a_terminal_nothing(tmp_path: Path) -> None:
    """A name with brackets is printed unchanged, a control character as its escape; the printed path is right."""
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
    """`carom scenes` counts groups, lists one group or all, prints a scene as a file that loads, and saves files."""
    groups = carom_command("scenes").output.splitlines()
    assert ["paper", "4"] in [line.split()[:2] for line in groups]
    assert all(len(line) <= 80 for line in groups)
    listed = {entry.group for entry in all_scenes().values()}
    assert {line.split()[0] for line in groups[1:-2]} == listed
    assert all(line.split()[2:] for line in groups[1:-2])
    assert len(carom_command("scenes", "paper").output.splitlines()) == 4 + 1
    lines = carom_command("scenes", "--all").output.splitlines()
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


@each("command, schema", [("scenes", build_scene_schema), ("diff", build_records_schema)])
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
    options = ("-e", "pit", "--dt", "1e-7", "--time-limit", "1e6", "--report", str(report))
    command = [sys.executable, "-m", "carom", "run", str(scene_file), *options]
    process = subprocess.Popen(
        command, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True, start_new_session=True
    )
    until = time.monotonic() + PATIENT_S
    # The journal is there when adapters have been asked; the run has begun when a worker works: a keeper's child.
    while not ((report / "journal.jsonl").exists() and _works(children := _descendants(process.pid))):
        assert process.poll() is None
        assert time.monotonic() < until
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    try:
        _, error = process.communicate(timeout=PATIENT_S)
    finally:
        process.kill()  # of no effect on one that has ended
    assert process.returncode == 130
    assert "interrupted" in error
    assert "Traceback" not in error
    assert not report.exists()
    assert ended(*children)


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
    """An interruption without a journal is raised again; with one, the message says how to resume."""

    def interrupt() -> None:
        with guard_journals(tmp_path / "journal.jsonl"):
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupt()
    assert capsys.readouterr().err == ""
    (tmp_path / "journal.jsonl").touch()
    with pytest.raises(typer.Exit):
        interrupt()
    assert f"are in {tmp_path / 'journal.jsonl'}, and --resume continues from them" in capsys.readouterr().err


COMMANDS_WITH_JOURNALS = {
    "run": ("run", "classics/bullet", "-e", "pit"),
    "bench": ("bench", "classics/bullet", "-e", "pit"),
    "grow": ("bench", "--grow", "-e", "pic"),
    "stress": ("stress", "grazing", "--quick", "-e", "pit"),
    "tune": ("tune", "pit", "classics/bullet"),
}


@pytest.mark.usefixtures("in_process")
@pytest.mark.parametrize("moment", release_after(2, ["made", "opened", "written", "marked"]))
@pytest.mark.parametrize("command", release_after(1, COMMANDS_WITH_JOURNALS))
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
        monkeypatch.setattr("carom.support.folders._put", begins)
    elif moment == "opened":
        monkeypatch.setattr("carom.execution.journal.os", SimpleNamespace(**{**vars(os), "open": opens}))
    elif moment == "written":
        monkeypatch.setattr("carom.execution.journal.os", SimpleNamespace(**{**vars(os), "fsync": ends}))
    else:
        monkeypatch.setattr("carom.execution.journal.Journal.__enter__", ends)
    out = tmp_path / "out"
    result = carom_command(*COMMANDS_WITH_JOURNALS[command], "--out", out)
    assert result.exit_code == 130, result.output
    assert not out.exists(), list(out.iterdir())


@pytest.mark.long
def test_a_run_of_one_scene_ends_with_the_command_that_prints_the_settings() -> None:
    """The best engine's settings at the step that was run, for the scene as asked; the command gives code."""
    asked = ["run", "paper/late", "-e", "pit", "-e", "pymunk", "-p", "default", "--no-timing", "--fail-on", "never"]
    *_, said, command = carom_command(*asked).output.splitlines()
    assert said == "To print the settings of pymunk default as code:"
    assert command == "carom engines pymunk --show default --dt 1/24 --scene paper/late"
    assert "space.step(dt)" in carom_command(*command.split()[1:]).output
    alone = carom_command("run", "paper/late", "-e", "pit", "-p", "tuned", "--no-timing").output
    assert "To print the settings" not in alone


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
    assert "pit: passes 0 of 1" in result.output
    assert "tunnelling at" in result.output
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {"stress.html", "stress.md", "stress.json", "journal.jsonl", "scenes", ".carom"}
    assert (tmp_path / "scenes" / "tunnelling.pit.tuned.toml").exists()


#: A text of each kind of option, by its word in `--help`; of choices the last one.
TEXTS = {"NAME": "it's", "SECONDS": "1/240", "MEGABYTES": "900", "ANGLE": "2deg", "NUMBER": "0.5", "INTEGER": "9"}
TEXTS |= {"NAME=VALUE": "a=b c", "OLD=NEW": "pit=pic", "ADDRESS": "tcp://host:8786"}


def asked(name: str, words: list[str]) -> tuple[dict[str, Any], str]:
    """Return what a command's body is given of some words, and the command again."""
    group: Any = get_command(build_app([name, "explain"]))
    command = group.commands[name]
    seen: list[tuple[dict[str, Any], str]] = []
    command.callback = lambda **given: seen.append((given, get_command_line()))
    with command.make_context(name, words) as context:
        command.invoke(context)
    return seen[0]


@each("study", [study for study, command in STUDIES.items() if command])
def test_the_command_again_asks_for_the_same(study: Any) -> None:
    """With every option that a study declares, the command that is shown is read as the one that was given."""
    name, *words = STUDIES[study]
    for one in list_declared_options(study).values():
        if one.flags:
            flag = one.flags[-1].partition("/")[0]
            text = TEXTS.get(one.kind.word, one.kind.word.rpartition("|")[2])
            words += [flag, text] if one.kind.word else [flag]
    given, again = asked(name, words)
    first, named, *rest = shlex.split(again)
    assert (first, named) == ("carom", name)
    assert asked(name, rest) == (given, again)
    assert all(given[option] is not None for option, one in list_declared_options(study).items() if one.flags)


def test_what_continues_or_prints_more_is_no_part_of_it() -> None:
    """A repeated result is the same, however much is printed."""
    _, again = asked("run", ["paper/missed", "--resume", "--retry", "-v", "--no-timing", "-e", "pit"])
    assert again == "carom run paper/missed --engine pit --no-timing"


def test_from_python_there_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    """What the process was started with is no command of Carom's."""
    monkeypatch.setattr("sys.argv", ["pytest", "-x"])
    assert get_command_line() == "carom"


def test_a_scene_is_printed_with_its_proven_digits() -> None:
    """The slanted wall is met at .63 s; thirty digits are shown where thirty are asked for."""
    result = carom_command("certify", "classics/slanted-wall", "--digits", "30")
    assert result.exit_code == 0, result.output
    assert "0.6300000000000000" in result.output or "0.62999999999999" in result.output
    assert "certified to 30 digits for 1 impact, to 1.5 s of 1.5 s" in result.output
    assert "Certified to the end of the scene." in result.output


def test_spins_are_printed_where_something_turns() -> None:
    """Between two rough plates a disc leaves the first rolling, with -2 rad/s; elsewhere there is no such column."""
    result = carom_command("certify", "spin/plates")
    assert result.exit_code == 0, result.output
    assert "spins after, rad/s" in result.output
    assert "-2.0" in result.output
    assert "spins" not in carom_command("certify", "classics/slanted-wall").output


def test_a_degenerate_scene_is_named_and_is_exit_code_1() -> None:
    """What has no certain answer is a sentence with its bodies, and what came before it is kept."""
    result = carom_command("certify", "classics/cradle-touching")
    assert result.exit_code == 1
    assert "two bodies already in contact are pressed together: disc 0, disc 1, disc 2" in result.output
    assert "certified to 15 digits for 1 impact" in result.output


def test_json_and_files_hold_the_whole_run(tmp_path: Path) -> None:
    """Both are the document that `from_enclosures` reads."""
    result = carom_command("certify", "classics/box", "--max-impacts", "5", "--json", "--out", tmp_path)
    assert result.exit_code == 0
    assert json.loads(result.output) == json.loads((tmp_path / "classics.box.json").read_text())
    assert len(from_enclosures(json.loads(result.output))) == 5


@pytest.mark.long
def test_a_cross_check_says_how_far_its_reference_is_certified() -> None:
    """The impact up to which a scene is certified is printed for many discs, and on request for any scene."""
    arguments = ("run", "-e", "pic", "--dt", "1/60", "--no-timing")
    by_default = told(carom_command(*arguments, "classics/cradle-gaps", "classics/head-on"))
    assert "certified to impact 4" in by_default
    assert "certified to impact 1" not in by_default
    asked = told(carom_command(*arguments, "classics/head-on", "--certify"))
    assert "classics/head-on: certified to impact 1, the last; float64 agrees to 1e-09 in all impacts." in asked


LIST = (sys.executable, "-m", "carom", "scenes")


@pytest.mark.long
def test_a_reader_that_has_seen_enough_is_no_error() -> None:
    """Into `head -1` the command ends with exit code 0 and no message about the pipe."""
    read, write = os.pipe()
    os.close(read)  # it has seen enough before the first line
    with os.fdopen(write, "wb") as out:
        done = subprocess.run(LIST, stdout=out, stderr=subprocess.PIPE, check=False)
    assert (done.returncode, done.stderr) == (0, b"")


@pytest.mark.long
@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no /dev/full here")
@each("arguments", [("scenes",), ("--help",), ("scenes", "paper")])
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
    """In ASCII no result or message raises; each sign has a replacement."""
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


@each(
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
    assert "already exists: name another folder with --out" in result.output
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
    """Where NumPy gets no memory, that is no violation; help does without."""
    command = 'ulimit -v 100000; exec "$0" -m carom "$@"'
    run = ("run", "paper/late", "-e", "pit", "--no-timing", "--report", str(tmp_path / "report"))
    done = subprocess.run(["sh", "-c", command, sys.executable, *run], capture_output=True, text=True, check=False)
    assert done.returncode == 2, done.stderr
    assert "Traceback" not in done.stderr
    assert done.stderr.splitlines()[-1].startswith("carom: ")
    assert "(ulimit -v)" in done.stderr
    helped = subprocess.run(["sh", "-c", command, sys.executable, "--help"], capture_output=True, check=False)
    assert helped.returncode == 0


def _play(*words: str) -> tuple[int, str]:
    found = CliRunner().invoke(build_app(["play"]), ["play", *words, "--no-open"])
    return found.exit_code, found.output


def test_it_writes_a_page_with_the_scene(tmp_path: Path) -> None:
    """The page has the scene that was named, first of those to choose from, and a policy without unsafe scripts."""
    page = tmp_path / "play.html"
    code, said = _play("paper/late", "-e", "none", "--out", str(page))
    text = page.read_text(encoding="utf-8")
    assert (code, "play.html" in said) == (0, True)
    assert 'id="scenes" data-first="paper/late">' in text
    assert "default-src 'none'; script-src 'sha256-" in text
    assert "http" not in text.replace("http-equiv", "")


def test_the_policy_allows_scripts_by_their_hashes_and_webassembly() -> None:
    """The policy has the engine's hash, and the word for WebAssembly, which the solvers are, and no other."""
    engine = PageEngine("toy", "Toy", {"default": {}}, "0;", "of no licence")
    (policy,) = re.findall(r'Content-Security-Policy" content="(.*?)"', render_page(add_gallery(), [engine]))
    assert f"'sha256-{base64.b64encode(hashlib.sha256(b'0;').digest()).decode()}'" in policy
    assert "'wasm-unsafe-eval'" in policy
    assert "'unsafe-eval'" not in policy


def test_an_engine_that_is_not_installed_is_refused_with_what_installs_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """An engine that was asked for and whose package is not there is bad usage, and the answer says what to run."""
    monkeypatch.setattr("carom.web.installed_engines.build_page_engine", lambda *_: None)
    code, said = _play("-e", "rapier2d")
    assert code == 2
    assert "rapier2d is not installed: " in " ".join(said.split())
    assert "npm install" in " ".join(said.split())


def test_a_package_of_another_form_is_refused(tmp_path: Path) -> None:
    """Text that the page must alter and that a release no longer has is an error, not a page that fails later."""
    script = tmp_path / PACKAGES["cannon"].script
    script.parent.mkdir(parents=True)
    script.write_text("exports.World = class {};\n", encoding="utf-8")
    with pytest.raises(InputError, match="has an unexpected version"):
        load_package_script(PACKAGES["cannon"], tmp_path)


def test_the_scripts_are_one() -> None:
    """The joined script has no import or export of its own left, which a page from a file can't have."""
    lines = build_page_script().splitlines()
    assert not [line for line in lines if line.startswith(("import ", "export ", "//"))]


def test_an_import_that_is_not_linked_is_refused() -> None:
    """An adapter with another import is refused for the page."""
    with pytest.raises(InputError, match="imports other"):
        link_script("matter", package="", package_name="matter-js", module='import Other from "other";\n')


@pytest.fixture
def slow(tmp_path: Path) -> Path:
    """Two discs that meet head-on at 0.4 m/s; Box2D as it is shipped makes impacts of up to 1 m/s inelastic."""
    discs = [
        Disc(position_m=(0, 0), velocity_m_s=(0.4, 0), radius_m=0.5),
        Disc(position_m=(1.23, 0), velocity_m_s=(0, 0), radius_m=0.5),
    ]
    path = tmp_path / "slow.toml"
    save_scene(Scene(name="slow", discs=discs, duration_s=1.5, frame_rate_hz=60.0), path)
    return path


def blocks(text: str, heading: str) -> str:
    """Return the code below a heading of a report in Markdown."""
    below = text.partition(f"## {heading}\n")[2].partition("\n#")[0]
    return "".join(f"{line[4:]}\n" for line in below.splitlines() if line.startswith("    "))


@pytest.mark.long
def test_what_lifts_a_threshold_is_found_and_can_be_pasted(slow: Path, tmp_path: Path) -> None:
    """Of Box2D's knobs the scaling of velocities alone mends a slow impact; the profiles to paste hold it, and run."""
    out = tmp_path / "out"
    done = carom_command("tune", "box2d", slow, "--trials", 12, "--out", out, "-j", 1)
    assert done.exit_code == 0, done.output
    text = (out / "tune.md").read_text()
    profile = eval(f"{{{blocks(text, 'Profile in Python')}}}", {"Profile": Profile})["found"]  # noqa: S307 - our own
    settings = profile.settings(1 / 60)
    assert settings["velocity_scale"] > 1.0 / 0.4
    assert settings["positionIterations"] == 3  # as in `default`, since nothing is gained by another
    pasted = tomllib.loads(blocks(text, "Profile in engine.toml"))["profiles"]["found"]
    assert {**pasted["settings"], "dt_s": 1 / 60} == settings
    command = blocks(text, "Command with these settings").split()
    assert command[:2] == ["carom", "run"]
    assert f"velocity_scale={settings['velocity_scale']}" in command
    ran = carom_command(*command[1:], "--dt", "1/60", "--no-timing")
    assert ran.exit_code == 0, ran.output


@pytest.mark.long
def test_a_search_that_is_interrupted_says_what_it_has_and_goes_on(
    slow: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ctrl-C leaves the best so far and the way on; taken up, the search ends where it would have ended whole."""
    one, other = tmp_path / "one", tmp_path / "other"
    assert carom_command("tune", "box2d", slow, "--trials", 12, "--out", other, "-j", 1).exit_code == 0
    tried = KnobSearch.evaluate

    def interrupted(self: KnobSearch, point: dict[str, int]) -> Any:
        if self.best is not self.begun:
            raise KeyboardInterrupt
        return tried(self, point)

    with monkeypatch.context() as patched:
        patched.setattr(KnobSearch, "evaluate", interrupted)
        done = carom_command("tune", "box2d", slow, "--trials", 12, "--out", one, "-j", 1)
    assert done.exit_code == 130
    assert "best so far (trial" in done.output
    assert "--set velocity_scale=" in done.output
    assert "--resume continues from them" in done.output
    refused = carom_command("tune", "box2d", slow, "--trials", 12, "--out", one)
    assert refused.exit_code == 2
    assert "continue from them by --resume" in refused.output
    assert carom_command("tune", "box2d", slow, "--trials", 12, "--out", one, "-j", 1, "--resume").exit_code == 0
    whole, resumed = ((folder / "tune.md").read_text() for folder in (other, one))
    assert blocks(resumed, "Profile in Python") == blocks(whole, "Profile in Python")
