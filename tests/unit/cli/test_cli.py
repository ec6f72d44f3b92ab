"""The command line: output, refused arguments and exit codes."""

import base64
import hashlib
import json
import os
import re
import shlex
import subprocess
import sys
import tomllib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest
import tomli_w
import typer
from tests.cases import each, release_after
from tests.command import carom_command, printed_text
from tests.scene_builders import disc_at, staged
from tests.unit.cli.test_options import STUDIES
from tests.validation.certified_files import from_enclosures
from typer.main import get_command
from typer.testing import CliRunner, Result

import carom
from carom import save_scene
from carom.catalogue import all_scenes
from carom.cli import app, build_app
from carom.cli.command_line import get_command_line
from carom.cli.error_handling import guard_journals
from carom.engines.api import Profile
from carom.errors import InputError
from carom.execution import describe_engines
from carom.execution.results import Row
from carom.model.scene_file import build_scene_schema
from carom.report.results_file.line_codec import build_records_schema
from carom.studies.tune.search import KnobSearch
from carom.support.options import list_declared_options
from carom.web.engine_script import PageEngine, link_script
from carom.web.packages import PACKAGES, load_package_script
from carom.web.page import add_gallery, render_page

SCENE = tomli_w.dumps(staged("mine", disc_at(0, 0, 1, 0), disc_at(3.0, 0.3, -1, 0), duration_s=2.0).model_dump())


@pytest.fixture
def scene_file(tmp_path: Path) -> Path:
    path = tmp_path / "my-scene.toml"
    path.write_text(SCENE)
    return path


@pytest.mark.usefixtures("in_process", "blank_pages")
@pytest.mark.parametrize(("fail_on", "code"), release_after(1, [("inaccurate", 1), ("never", 0)]))
def test_fail_on_sets_the_exit_code_of_a_missed_impact(fail_on: str, code: int, tmp_path: Path) -> None:
    """A missed impact is exit code 1 with `--fail-on inaccurate` and 0 with `never`, in JUnit as well."""
    arguments = ("run", "paper/missed", "-e", "pit", "--dt", "1/24", "--no-timing", "--report", tmp_path)
    assert carom_command(*arguments, "--fail-on", fail_on).exit_code == code
    assert f'failures="{code}"' in (tmp_path / "junit.xml").read_text()


@pytest.mark.usefixtures("in_process", "blank_pages")
def test_run_times_engines_only_for_a_report(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """`carom run` times runs only if it writes a report, since nothing else shows run times."""
    timed: list[int] = []

    def count_rows(rows: Sequence[Row], _observer: object) -> dict[object, Row]:
        timed.append(len(rows))
        return {}

    monkeypatch.setattr("carom.studies.cross_check.run._time_jobs", count_rows)
    for words in ((), ("--out", tmp_path)):
        carom_command("run", "paper/missed", "-e", "pit", "--dt", "1/24", *words)
    assert timed == [0, 1]


@pytest.mark.usefixtures("in_process")
def test_run_without_a_usable_engine_has_exit_code_3(scene_file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A run ends with exit code 3 and the reason if its engine can't run the scene or is not available."""
    for dt, words in (("1e-10", "more steps than an engine can count"), ("0.1", "it is on strike")):
        result = carom_command("run", scene_file, "-e", "pit", "--dt", dt, "--no-timing")
        assert result.exit_code == 3
        assert words in printed_text(result)
        monkeypatch.setattr(describe_engines, "explain_unavailable_adapter", lambda _adapter: "it is on strike")
        monkeypatch.setattr(describe_engines, "_KNOWN", {})


@pytest.mark.long
def test_names_are_printed_without_markup_and_control_characters(tmp_path: Path) -> None:
    """Brackets in names are printed unchanged, and control characters as escapes."""
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
def test_timeout_has_exit_code_4(scene_file: Path) -> None:
    """A run that exceeds `--time-limit` ends the command with exit code 4 and the words "timed out"."""
    result = carom_command("run", scene_file, "-e", "pit", "--dt", "1e-7", "--no-timing", "--time-limit", "0.5")
    assert result.exit_code == 4, result.output
    assert "timed out" in result.output


def test_scenes_command_lists_prints_and_saves_scenes(tmp_path: Path) -> None:
    """`carom scenes` counts groups, lists one group or all, prints a scene as a loadable file, and saves files."""
    _, *rows, _, _ = groups = carom_command("scenes").output.splitlines()
    assert all(len(line) <= 80 for line in groups)
    counts = {line.split()[0]: line.split()[1:] for line in rows}
    assert counts.keys() == {entry.group for entry in all_scenes().values()}
    assert all(told[1:] for told in counts.values())
    assert counts["paper"][0] == "4"
    assert len(carom_command("scenes", "paper").output.splitlines()) == 4 + 1
    lines = carom_command("scenes", "--all").output.splitlines()
    assert len(lines) == len(all_scenes()) + 1
    (missed,) = (line for line in lines if line.startswith("paper/missed"))
    assert missed.split()[1:3] == ["2", "1"]
    path = tmp_path / "copy.toml"
    path.write_text(carom_command("scenes", "paper/missed").output)
    assert carom.load_scene(path).name == "paper/missed"
    assert carom_command("scenes", "paper", "--save", tmp_path / "mine").exit_code == 0
    assert len(list((tmp_path / "mine").glob("*.toml"))) == 4


def test_engines_command_lists_every_engine() -> None:
    """`carom engines` has one line for each engine, with versions or "unavailable", of at most 80 characters."""
    lines = carom_command("engines").output.splitlines()
    infos = {info.name: info for info in carom.engines()}
    found = {line.split()[0]: line for line in lines if line.split() and line.split()[0] in infos}
    assert found.keys() == infos.keys()
    assert all((info.version if info.available else "unavailable") in found[name] for name, info in infos.items())
    assert all(len(line) <= 80 for line in lines)


@each("command, schema", [("scenes", build_scene_schema), ("diff", build_records_schema)])
def test_schema_option_prints_json(command: str, schema: Callable[[], object]) -> None:
    """`carom scenes --schema` prints the schema of scene files, and `carom diff --schema` that of JSON lines."""
    assert json.loads(carom_command(command, "--schema").output) == schema()


SHOW = "--dt .002 --restitution .9 --friction .3"


@pytest.mark.usefixtures("in_process")
@each(
    "words, shown",
    [
        ("stress --list", ["grazing", "boost", "mujoco-441"]),
        (
            "engines mujoco",
            ["pip install", "cylinder-plain", "gravity", "stiffness", "issues/mujoco-441", "--show tuned"],
        ),
        ("engines pit", ["tuned"]),
        # MuJoCo's damping that makes -0.9 v of v in one Euler step
        (f"engines mujoco --show tuned {SHOW}", ['timestep="0.002"', f'solref="0.0 {-(1 + 0.9) / 0.002!r}"']),
        (f"engines mujoco --show tuned {SHOW}", ['friction="0.3 0 0"']),
        ("engines pymunk --show default --scene classics/box", ["space.step(dt)"]),
        ("explain missed", ["missed (verdict): an impact is missed.", "passed through each other"]),
        ("explain wrong direction", ["wrong direction (verdict)"]),
    ],
)
def test_command_prints_descriptions_and_code(words: str, shown: list[str]) -> None:
    """Commands list tests, describe engines and words, and print engine code with the given coefficients."""
    output = carom_command(*words.split()).output
    assert [text for text in shown if text not in output] == []


def test_help_describes_every_command_and_option() -> None:
    """`carom --help` shows every command's summary, and `carom COMMAND --help` all options in plain words."""
    listing = printed_text(carom_command("--help"))
    commands = get_command(app).commands  # type: ignore[attr-defined]  # a group, which the annotation does not say
    assert {"run", "bench", "advise", "certify", "stress", "scenes", "engines"} <= set(commands)
    for name, command in commands.items():
        assert f"{name} {command.help.partition(chr(10) * 2)[0]}" in listing
        shown = carom_command(name, "--help").output
        offered = [parameter for parameter in command.params if not getattr(parameter, "hidden", False)]
        assert all(option in shown for parameter in offered for option in parameter.opts if "--" in option)
        assert not re.search(r"<\w|--[\w-]+ (str|int|float|list|path)\b", shown)


def test_interrupt_mentions_resume_only_if_a_journal_exists(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Ctrl-C prints how to resume if a journal exists; otherwise KeyboardInterrupt propagates without a message."""

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


def raise_interrupt(*_: object, **__: object) -> None:
    raise KeyboardInterrupt


def open_and_interrupt(path: str | Path, flags: int, mode: int = 0o777, *, opened: Callable[..., int] = os.open) -> int:
    file = opened(path, flags, mode)
    if not str(path).endswith(".jsonl"):
        return file
    os.close(file)
    raise KeyboardInterrupt


@pytest.mark.usefixtures("in_process")
@pytest.mark.parametrize(
    ("place", "interrupt"),
    release_after(
        2,
        [
            ("carom.execution.journal.Journal.__enter__", raise_interrupt),
            ("os.open", open_and_interrupt),
            ("os.fsync", raise_interrupt),
        ],
    ),
)
@pytest.mark.parametrize("command", release_after(1, COMMANDS_WITH_JOURNALS))
def test_interrupt_during_creation_of_a_journal_leaves_no_folder(
    command: str, place: str, interrupt: Callable[..., object], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ctrl-C at any moment while a journal is created ends with exit code 130 and leaves no folder."""
    monkeypatch.setattr(place, interrupt)
    out = tmp_path / "out"
    result = carom_command(*COMMANDS_WITH_JOURNALS[command], "--out", out)
    assert result.exit_code == 130, result.output
    assert not out.exists(), list(out.iterdir())


@pytest.mark.long
def test_run_of_one_scene_prints_a_settings_command() -> None:
    """The output ends with a command that prints the best engine's settings as code, and that command works."""
    asked = ["run", "paper/late", "-e", "pit", "-e", "pymunk", "-p", "default", "--no-timing", "--fail-on", "never"]
    *_, said, command = carom_command(*asked).output.splitlines()
    assert said == "To print the settings of pymunk default as code:"
    assert command == "carom engines pymunk --show default --dt 1/24 --scene paper/late"
    assert "space.step(dt)" in carom_command(*command.split()[1:]).output
    alone = carom_command("run", "paper/late", "-e", "pit", "-p", "tuned", "--no-timing").output
    assert "To print the settings" not in alone


@pytest.mark.usefixtures("in_process")
def test_stress_prints_a_summary_and_writes_its_files(tmp_path: Path) -> None:
    """One quick stress test of PIT prints its result and writes the reports, the journal and the failing scene."""
    result = carom_command("stress", "tunnelling", "-e", "pit", "--quick", "--out", tmp_path)
    assert result.exit_code == 0, result.output
    assert "pit passes 0 of 1" in result.output
    assert "tunnelling at" in result.output
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {"stress.html", "stress.md", "stress.json", "journal.jsonl", "scenes", ".carom"}
    assert (tmp_path / "scenes" / "tunnelling.pit.tuned.toml").exists()


#: A text of each kind of option, by its word in `--help`; of choices the last one.
TEXTS = {"NAME": "it's", "SECONDS": "1/240", "MEGABYTES": "900", "ANGLE": "2deg", "NUMBER": "0.5", "INTEGER": "9"}
TEXTS |= {"NAME=VALUE": "a=b c", "OLD=NEW": "pit=pic", "ADDRESS": "tcp://host:8786"}


def parse_command(name: str, words: list[str]) -> tuple[dict[str, Any], str]:
    """Return what a command's body is given of some words, and the command again."""
    group: Any = get_command(build_app([name, "explain"]))
    command = group.commands[name]
    seen: list[tuple[dict[str, Any], str]] = []
    command.callback = lambda **given: seen.append((given, get_command_line()))
    with command.make_context(name, words) as context:
        command.invoke(context)
    return seen[0]


@each("study", [study for study, command in STUDIES.items() if command])
def test_command_line_in_reports_parses_to_the_same_options(study: Any) -> None:
    """With every option of a study set, the reproduced command line parses to the options that were given."""
    name, *words = STUDIES[study]
    for one in list_declared_options(study).values():
        if one.flags:
            flag = one.flags[-1].partition("/")[0]
            text = TEXTS.get(one.kind.word, one.kind.word.rpartition("|")[2])
            words += [flag, text] if one.kind.word else [flag]
    given, again = parse_command(name, words)
    first, named, *rest = shlex.split(again)
    assert (first, named) == ("carom", name)
    assert parse_command(name, rest) == (given, again)
    assert all(given[option] is not None for option, one in list_declared_options(study).items() if one.flags)


def test_command_line_in_reports_omits_resume_and_verbosity() -> None:
    """The reproduced command line omits `--resume`, `--retry` and `-v`, which do not change results."""
    _, again = parse_command("run", ["paper/missed", "--resume", "--retry", "-v", "--no-timing", "-e", "pit"])
    assert again == "carom run paper/missed --engine pit --no-timing"


@each(
    "words, code, shown",
    [
        ("classics/slanted-wall --digits 30", 0, "certified to 30 digits for 1 impact in the first 1.5 s of 1.5 s"),
        ("spin/plates", 0, "spins after, rad/s"),
        ("classics/cradle-touching", 1, "already in contact are pressed together: disc 0, disc 1, disc 2"),
        ("classics/cradle-touching", 1, "certified to 15 digits for 1 impact"),
    ],
)
def test_certify_prints_what_is_certified(words: str, code: int, shown: str) -> None:
    """`carom certify` states digits and end, has spins only if a disc turns, and ends a degenerate scene with 1."""
    result = carom_command("certify", *words.split())
    assert result.exit_code == code, result.output
    assert shown in result.output
    assert ("spins" in result.output) == ("spin" in words)


def test_certify_prints_and_writes_the_same_json(tmp_path: Path) -> None:
    """`carom certify --json` prints the document that `--out` writes; it contains all 5 requested impacts."""
    result = carom_command("certify", "classics/box", "--max-impacts", "5", "--json", "--out", tmp_path)
    assert result.exit_code == 0
    assert json.loads(result.output) == json.loads((tmp_path / "classics.box.json").read_text())
    assert len(from_enclosures(json.loads(result.output))) == 5


CAROM = (sys.executable, "-m", "carom")


@pytest.mark.long
@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no /dev/full here")
def test_closed_pipe_is_no_error_and_full_disk_has_exit_code_2() -> None:
    """A reader that closes the pipe, as `head -1` does, gives exit code 0; a full disk gives 2 and one line."""
    read, write = os.pipe()
    os.close(read)
    with os.fdopen(write, "wb") as unread, Path("/dev/full").open("wb") as full:
        for output, code, said in ((unread, 0, b""), (full, 2, b"carom: output: No space left on device\n")):
            done = subprocess.run([*CAROM, "scenes"], stdout=output, stderr=subprocess.PIPE, check=False)
            assert (done.returncode, done.stderr) == (code, said)


@pytest.mark.long
def test_output_is_ascii_if_the_encoding_is_ascii() -> None:
    """With an ASCII encoding, results and error messages are printed in ASCII and no command fails to print."""
    plain = {**os.environ, "LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0", "PYTHONIOENCODING": "ascii"}
    for words, code, said in (
        ("run paper/missed -e pit --no-timing --dt 1/24", 1, b""),
        ("run d\u00e9j\u00e0-\u2713", 2, b"no scene is named"),
    ):
        done = subprocess.run([*CAROM, *words.split()], env=plain, capture_output=True, check=False)
        assert done.returncode == code
        assert done.stdout.isascii()
        assert done.stderr.isascii()
        assert said in done.stderr


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
def test_output_folder_with_other_files_is_refused(command: str, tmp_path: Path) -> None:
    """An output folder with files that Carom did not write is refused with a hint, and left unchanged."""
    (tmp_path / "index.html").write_text("mine")
    (tmp_path / "scenes").mkdir()
    result = carom_command(*command.split(), "--out", tmp_path)
    assert result.exit_code == 2
    assert "holds files that Carom did not write, such as index.html\n" in result.output
    assert "\nhint: name another folder by --out\n" in result.output
    assert sorted(path.name for path in tmp_path.iterdir()) == ["index.html", "scenes"]
    assert (tmp_path / "index.html").read_text() == "mine"


def test_scenes_command_does_not_overwrite_an_edited_file(tmp_path: Path) -> None:
    """A scene file that was saved and then edited is not overwritten: a second save ends with exit code 2."""
    arguments = ["scenes", "paper/missed", "--save", str(tmp_path)]
    assert carom_command(*arguments).exit_code == 0
    (tmp_path / "paper.missed.toml").write_text("edited")
    result = carom_command(*arguments)
    assert result.exit_code == 2
    assert "already exists: name another folder with --out" in result.output
    assert (tmp_path / "paper.missed.toml").read_text() == "edited"


@pytest.mark.skipif(sys.platform != "linux", reason="address space is limited on Linux")
def test_small_address_space_is_reported_with_exit_code_2(tmp_path: Path) -> None:
    """With 100 MB of address space a run ends with exit code 2 and names `ulimit -v`; `--help` works."""
    command = 'ulimit -v 100000; exec "$0" -m carom "$@"'
    run = ("run", "paper/late", "-e", "pit", "--no-timing", "--report", str(tmp_path / "report"))
    done = subprocess.run(["sh", "-c", command, sys.executable, *run], capture_output=True, text=True, check=False)
    assert done.returncode == 2, done.stderr
    assert "Traceback" not in done.stderr
    assert done.stderr.splitlines()[-1].startswith("carom: ")
    assert "(ulimit -v)" in done.stderr
    helped = subprocess.run(["sh", "-c", command, sys.executable, "--help"], capture_output=True, check=False)
    assert helped.returncode == 0


def _run_play(*words: object) -> Result:
    return CliRunner().invoke(build_app(["play"]), ["play", *map(str, words), "--no-open"])


def test_play_writes_a_page_with_the_scene(tmp_path: Path) -> None:
    """`carom play` writes a self-contained page that selects the named scene and allows only hashed scripts."""
    page = tmp_path / "play.html"
    result = _run_play("paper/late", "-e", "none", "--out", page)
    text = page.read_text(encoding="utf-8")
    assert (result.exit_code, "play.html" in result.output) == (0, True)
    assert 'id="scenes" data-first="paper/late">' in text
    assert "default-src 'none'; script-src 'sha256-" in text
    assert " 'wasm-unsafe-eval'" in text
    assert " 'unsafe-eval'" not in text
    assert "http" not in text.replace("http-equiv", "")


def test_play_refuses_a_missing_engine_with_its_install_command(monkeypatch: pytest.MonkeyPatch) -> None:
    """An engine whose package is not installed ends `carom play` with exit code 2 and the `npm install` command."""
    monkeypatch.setattr("carom.web.installed_engines.build_page_engine", lambda *_: None)
    result = _run_play("-e", "rapier2d")
    assert result.exit_code == 2
    assert "rapier2d is not installed: " in printed_text(result)
    assert "npm install" in printed_text(result)


def test_page_hashes_an_engines_script_and_refuses_other_imports() -> None:
    """The page's policy contains the hash of an engine's script; an adapter that imports other packages is refused."""
    engine = PageEngine("toy", "Toy", {"default": {}}, "0;", "of no licence")
    digest = base64.b64encode(hashlib.sha256(b"0;").digest()).decode()
    assert f"'sha256-{digest}'" in render_page(add_gallery(), [engine])
    with pytest.raises(InputError, match="imports other"):
        link_script("matter", package="", package_name="matter-js", module='import Other from "other";\n')


def test_page_refuses_an_unexpected_package_version(tmp_path: Path) -> None:
    """A package that lacks the text which the page must replace is refused as an unexpected version."""
    script = tmp_path / PACKAGES["cannon"].script
    script.parent.mkdir(parents=True)
    script.write_text("exports.World = class {};\n", encoding="utf-8")
    with pytest.raises(InputError, match="has an unexpected version"):
        load_package_script(PACKAGES["cannon"], tmp_path)


@pytest.fixture
def slow_scene_file(tmp_path: Path) -> Path:
    """Two discs that meet head-on at 0.4 m/s; Box2D as it is shipped makes impacts of up to 1 m/s inelastic."""
    discs = disc_at(0, 0, 0.4), disc_at(1.23, 0)
    path = tmp_path / "slow.toml"
    save_scene(staged("slow", *discs, duration_s=1.5, frame_rate_hz=60.0), path)
    return path


def run_tune(scene: Path, out: Path, *options: str) -> Result:
    """Tune Box2D in twelve trials, in this process."""
    return carom_command("tune", "box2d", scene, "--trials", 12, "--out", out, "-j", 1, *options)


def extract_code(text: str, heading: str) -> str:
    """Return the code below a heading of a report in Markdown."""
    below = text.partition(f"## {heading}\n")[2].partition("\n#")[0]
    return "".join(f"{line[4:]}\n" for line in below.splitlines() if line.startswith("    "))


@pytest.mark.long
def test_tune_finds_the_velocity_scale_of_box2d(slow_scene_file: Path, tmp_path: Path) -> None:
    """`carom tune` finds the velocity scale that corrects a slow impact in Box2D; its printed outputs work."""
    out = tmp_path / "out"
    done = run_tune(slow_scene_file, out)
    assert done.exit_code == 0, done.output
    text = (out / "tune.md").read_text()
    profile = eval(f"{{{extract_code(text, 'Profile in Python')}}}", {"Profile": Profile})["found"]  # noqa: S307 - our own
    settings = profile.settings(1 / 60)
    assert settings["velocity_scale"] > 1.0 / 0.4
    assert settings["positionIterations"] == 3  # as in `default`, since nothing is gained by another
    pasted = tomllib.loads(extract_code(text, "Profile in engine.toml"))["profiles"]["found"]
    assert {**pasted["settings"], "dt_s": 1 / 60} == settings
    command = extract_code(text, "Command with these settings").split()
    assert command[:2] == ["carom", "run"]
    assert f"velocity_scale={settings['velocity_scale']}" in command
    ran = carom_command(*command[1:], "--dt", "1/60", "--no-timing")
    assert ran.exit_code == 0, ran.output


@pytest.mark.long
def test_interrupted_tune_prints_the_best_settings_and_can_be_resumed(
    slow_scene_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ctrl-C prints the best settings so far, and only `--resume` continues in the same folder."""
    tried = KnobSearch.evaluate

    def interrupted(self: KnobSearch, point: dict[str, int]) -> Any:
        if self.best is not self.first:
            raise KeyboardInterrupt
        return tried(self, point)

    with monkeypatch.context() as patched:
        patched.setattr(KnobSearch, "evaluate", interrupted)
        done = run_tune(slow_scene_file, tmp_path / "out")
    assert done.exit_code == 130
    for words in ("best so far (trial", "--set velocity_scale=", "--resume continues from them"):
        assert words in done.output
    assert run_tune(slow_scene_file, tmp_path / "out").exit_code == 2
    assert run_tune(slow_scene_file, tmp_path / "out", "--resume").exit_code == 0
