"""Commands in unusual surroundings: streams, arguments, variables, folders and disks."""

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from random import Random
from shutil import rmtree
from typing import Any

from tests.processes import PATIENT_S

RUN = ("run", "paper/missed", "-e", "pit", "--no-timing", "--fail-on", "never", "--dt", "1/60")
BENCH = ("bench", *RUN[1:5], "--budget", "5")
#: Commands that are quickly done; `OUT` is a path of the attack's folder.
COMMANDS = (
    *(("scenes",), ("scenes", "paper/missed"), ("engines",), ("engines", "pit"), ("--help",), ("--version",)),
    *(("explain", "missed"), ("nonsense",), ("run", "nowhere.toml"), RUN, (*RUN, "--report", "OUT"), ("serve", "pit")),
    *(("certify", "paper/missed"), (*BENCH, "--dt", "1/60", "-o", "OUT")),
    ("play", "--out", "OUT.html", "-e", "none", "--no-open"),
    *(("scenes", "paper/missed", "--save", "OUT.toml"), ("import", "OUT.pkl"), ("diff", "OUT", "OUT")),
    ("report", "OUT"),
)
#: Environments: an empty value takes the variable away.
ENVIRONMENTS: tuple[dict[str, str], ...] = (
    *({"HOME": ""}, {"HOME": "/nowhere"}, {"TMPDIR": "/nowhere"}, {"TMPDIR": "/proc"}, {"PATH": ""}),
    {"PATH": "/nowhere"},
    *({"COLUMNS": value} for value in ("0", "-1", "1", "99999999999", "abc")),
    *({"LC_ALL": value, "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"} for value in ("C", "xx_YY.UTF-8", "POSIX")),
    *({"PYTHONIOENCODING": value} for value in ("ascii", "latin-1", "utf-16", "cp1252:strict")),
    *({"TERM": "dumb"}, {"TERM": ""}, {"NO_COLOR": "1"}, {"FORCE_COLOR": "1"}, {"PYTHONOPTIMIZE": "2"}),
    {"TZ": "../../x"},
    *({"XDG_CACHE_HOME": "/proc"}, {"CAROM_ENGINES": "relative"}, {"CAROM_ENGINES": "/nowhere"}),
    {"CAROM_ENGINES": "/dev/zero"},
    *({"OMP_NUM_THREADS": "x"}, {"PYTHONDEVMODE": "1"}, {"PYTHONWARNINGS": "error::ResourceWarning"}),
    {"PYTHONHASHSEED": "0"},
)
#: Arguments that are no text in UTF-8, or control a terminal.
BYTES = (
    *(b"\xff", b"\xff\xfe.toml", b"a\x80b.json", b"\xed\xa0\x80"),
    *(b"\x1b[31m.toml", b"\n", b"a" * 300, b"\xe2\x80\xae.toml"),
)


def attack(rng: Random, folder: Path) -> Iterator[str]:
    """Closed streams, unusual arguments and environments, read-only and full disks, two commands in one folder.

    The command exits with a code from 0 to 4 and shows a message.
    """
    acts = [_close_streams, _pass_odd_arguments, _change_environment, _run_two_at_once, _remove_folder]
    if _can_mount():
        acts += [_mount_read_only, _fill_disk]
    while True:
        rmtree(folder / "work", ignore_errors=True)
        (folder / "work").mkdir()
        yield rng.choice(acts)(rng, folder / "work")


def _draw_command(rng: Random, work: Path) -> list[str]:
    return [word.replace("OUT", str(work / "out")) for word in rng.choice(COMMANDS)]


def _run_carom(words: Sequence[str | bytes], work: Path, **options: Any) -> subprocess.CompletedProcess[bytes]:
    """Run a command of Carom in a folder; `before` are the words of a program that starts it."""
    command = [*options.pop("before", ()), sys.executable, "-m", "carom", *words]
    usual = {"stdin": subprocess.DEVNULL, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    return subprocess.run(command, cwd=work, timeout=4 * PATIENT_S, check=False, **{**usual, **options})


def _find_loss(done: subprocess.CompletedProcess[bytes], what: str, *, says: bool = True) -> str:
    """Return what is wrong with the end of a command."""
    said = (done.stdout or b"") + (done.stderr or b"")
    if done.returncode not in range(5) or b"Traceback" in said or b"Exception ignored" in said:
        return f"{what}: exit code {done.returncode}: {said[-600:]!r}"
    if says and done.returncode > 1 and not (done.stderr or b"").strip():
        return f"{what}: exit code {done.returncode} without a sentence"
    return f"{what}: an escape sequence in {said[-300:]!r}" if b"\x1b[31m" in said else ""


def _close_streams(rng: Random, work: Path) -> str:
    """Close standard streams, or lead them to a pipe that nobody reads, or a device that is full."""
    words, closed = _draw_command(rng, work), [number for number in range(3) if rng.random() < 0.5]

    def close() -> None:
        for number in closed:
            os.close(number)

    if rng.random() < 0.5:
        done = _run_carom(words, work, preexec_fn=close)
        return _find_loss(done, f"{words}, closed {closed}", says=2 not in closed)
    reader, writer = os.pipe()
    os.close(reader)
    with os.fdopen(writer, "wb") as unread, Path("/dev/full").open("wb") as full:
        out, err = rng.choice((unread, full, subprocess.PIPE)), rng.choice((unread, full, subprocess.PIPE))
        done = _run_carom(words, work, stdout=out, stderr=err)
    return _find_loss(done, f"{words}, to {out} and {err}", says=False)


def _pass_odd_arguments(rng: Random, work: Path) -> str:
    words: list[bytes] = [word.encode() for word in _draw_command(rng, work)]
    odd = rng.choice(BYTES)
    if rng.random() < 0.5:  # a file or folder of that name
        words = [word.replace(os.fsencode(work / "out"), os.fsencode(work / "out") + odd) for word in words]
    else:
        words.insert(rng.randrange(len(words) + 1), odd)
    environment = {**os.environ, **rng.choice(({}, {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}))}
    return _find_loss(_run_carom(words, work, env=environment), f"{words}")


def _change_environment(rng: Random, work: Path) -> str:
    words, changed = _draw_command(rng, work), rng.choice(ENVIRONMENTS)
    environment = {name: value for name, value in {**os.environ, **changed}.items() if value}
    done = _run_carom(words, work, env=environment)
    coloured = "FORCE_COLOR" in changed and b"Traceback" not in done.stderr
    return "" if coloured else _find_loss(done, f"{words}, {changed}")


def _remove_folder(rng: Random, work: Path) -> str:
    """Take the current folder away before the command starts."""
    words, gone = _draw_command(rng, work), work / "gone"
    gone.mkdir()
    done = _run_carom(words, work, before=("sh", "-c", f'cd "{gone}" && rmdir "{gone}" && exec "$@"', "sh"))
    return _find_loss(done, f"{words} in a folder that is gone")


def _run_two_at_once(rng: Random, work: Path) -> str:
    """Have two commands write into one folder; then it has the files of one of them, whole."""
    command, options = rng.choice(((RUN[:-2], "--report"), (BENCH, "-o")))
    steps = ("1/60", rng.choice(("1/60", "1/30")))
    out, ends = work / "out", []
    commands = [[sys.executable, "-m", "carom", *command, options, str(out), "--dt", dt] for dt in steps]
    both = [subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE) for words in commands]
    for one in both:
        printed = one.communicate(timeout=4 * PATIENT_S)
        ends.append(subprocess.CompletedProcess(one.args, one.returncode, *printed))
    lost = "".join(_find_loss(done, f"two at once: {done.args[3:]}") for done in ends)
    if left := [path.name for path in out.glob(".carom?*")]:
        lost += f"two at once: {left} stay: {[done.args[3:] for done in ends]}"
    if not lost and command[0] == "run" and any(done.returncode == 0 for done in ends):
        return _find_loss(_run_carom(["report", str(out)], work), "two at once, then carom report")
    return lost


def _can_mount() -> bool:
    """Whether this user may mount something in a namespace of its own."""
    if shutil.which("unshare") is None:
        return False
    command = ["unshare", "-rm", "mount", "-t", "tmpfs", "tmpfs", tempfile.gettempdir()]
    return subprocess.run(command, capture_output=True, check=False).returncode == 0


def _run_mounted(words: Sequence[str], mount: str, **options: Any) -> str:
    """Return what is lost after a command, in `/`, that has something mounted which no other process sees."""
    before = ("unshare", "-rm", "sh", "-c", f'{mount} && exec "$@"', "sh")
    return _find_loss(_run_carom(words, Path("/"), before=before, **options), f"{words}, {mount}")


def _mount_read_only(rng: Random, work: Path) -> str:
    """Make the install, or all of the disk, read-only."""
    words = _draw_command(rng, work)
    root = rng.choice((Path(__file__).parents[2], Path(sys.prefix), Path("/")))
    bind = f'mount --bind "{root}" "{root}" && ' if root != Path("/") else ""
    return _run_mounted(words, f'{bind}mount -o remount,bind,ro "{root}"')


def _fill_disk(rng: Random, work: Path) -> str:
    """Fill the disk of the output folder, or of the temporary one."""
    words, temporary = _draw_command(rng, work), work / "temporary"
    temporary.mkdir()
    place = rng.choice((work, temporary))
    size, files = rng.choice((4096, 8192, 65536, 2**20)), rng.choice((2, 10, 100))
    mount = f'mount -t tmpfs -o size={size},nr_inodes={files} tmpfs "{place}"'
    return _run_mounted(words, mount, env={**os.environ, "TMPDIR": str(temporary)})
