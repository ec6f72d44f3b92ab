"""Hostile adapters: each gets a row with the true reason in bounded time, and leaves no process and no folder."""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from tests.fake_clock import Clock
from tests.processes import PATIENT_S, limit_only, wait_until_begun, wait_until_ended
from tests.scene_builders import disc_at, staged
from tests.unit.execution.conftest import STANDING

from carom import save_scene
from carom.execution.environment import measure_resident_bytes
from carom.execution.job import Status
from carom.execution.pool import LocalPool
from carom.execution.results import Row
from carom.execution.workers.working_folder import _clear_abandoned
from carom.studies.cross_check.options import Options
from carom.studies.cross_check.plan import build_plan
from carom.studies.cross_check.run import execute

LINUX = pytest.mark.skipif(sys.platform != "linux", reason="elsewhere what leaves its group is not found")

RAN, FAILED, CRASHED, TIMED_OUT = Status.RAN, Status.FAILED, Status.CRASHED, Status.TIMED_OUT
SLEEPER = "os.setsid(), os.execve('/bin/sleep', ['sleep', '3600'], {})"
#: What an adapter does in its first step, and the status and reason of its row. `here` is a folder of its own.
ACTS = {
    "answers-garbage": ("tell_others(b'\\x00\\xff{garbage\\n')", FAILED, "invalid answer: '..{garbage'"),
    "answers-ahead": ("tell_others(ANSWER)", FAILED, "invalid answer: '[0, {"),
    "answers-without-end": ("tell_others(b'x' * 2**28)", FAILED, "invalid answer: 'xxxx"),
    "answers-empty-lines": ("tell_others(b'\\n' * 2**20)", FAILED, "invalid answer: ''"),
    "forks-and-aborts": ("child(sleep); os.abort()", CRASHED, "ended by SIGABRT"),
    "forks": ("child(sleep)", RAN, ""),
    "forks-and-leaves": ("child(lambda: (os.setsid(), child(sleep), os._exit(0)))", RAN, ""),
    "forgets-everything": (f"child(lambda: ({SLEEPER}))", RAN, ""),
    "forgets-and-sleeps": (f"child(lambda: ({SLEEPER})); sleep()", TIMED_OUT, "no answer within"),
    "comes-back-twice": ("os.fork()", RAN, ""),
    "prints-much": (
        "[os.write(2, b'nothing\\n' * 4000) for _ in range(4000)]; os.abort()",
        CRASHED,
        "printed: nothing",
    ),
    "prints-for-ever": ("thread(lambda: [os.write(2, b'noise\\n' * 1000) for _ in iter(int, 1)])", RAN, ""),
    "stops": ("note(os.getpid()); os.kill(os.getpid(), signal.SIGSTOP)", TIMED_OUT, "no answer within"),
    "stops-its-keeper": ("os.kill(os.getppid(), signal.SIGSTOP); hang()", TIMED_OUT, "no answer within"),
    "kills-its-keeper": ("note(os.getpid()); os.kill(os.getppid(), signal.SIGKILL); sleep()", CRASHED, "by SIGKILL"),
    "holds-the-lock": ("note(os.getpid()); ctypes.PyDLL(None).sleep(3600)", TIMED_OUT, "no answer within"),
    "closes-all": ("os.closerange(0, 256); hang()", FAILED, "closed the pipe for answers, and continued"),
    "closes-its-answers": ("os.closerange(3, 256)", FAILED, "closed the pipe for answers; its process then ended"),
    "closes-its-output": ("sys.stdout.close()", RAN, ""),
    "has-no-output": ("sys.stdout = None", RAN, ""),
    "takes-memory": ("self.hoard = [bytearray(2**34)]", FAILED, "--memory-limit"),
    "leaves": ("sys.exit(0)", CRASHED, "exit code 0"),
    "ends": ("os._exit(0)", CRASHED, "exit code 0"),
    "fails-to-fail": ("raise Mute()", FAILED, "Mute: its message can't be built: RuntimeError"),
    "fails-in-surrogates": ("raise ValueError('\\ud800' * 10_000)", FAILED, "ValueError: \\ud800"),
    "kills-its-template": ("os.kill(parent(os.getppid()), signal.SIGKILL); sleep()", CRASHED, ""),
    "tells": ("tell()", RAN, ""),
    "leaves-a-link": ("cwd = os.getcwd(); os.chdir('/'); os.rmdir(cwd); os.symlink(here, cwd)", RAN, ""),
    "digs-deep": ("[(os.mkdir('deep'), os.chdir('deep')) for _ in range(1500)]; os.chdir('/')", RAN, ""),
    "litters": ("os.makedirs('a/b'); open('a/b/c', 'w').write('x'); os.chmod('a/b', 0); os.chmod('a', 0)", RAN, ""),
}

SOURCE = (
    STANDING
    + """
import ctypes, json, resource, signal, threading
from pathlib import Path

here = Path(os.environ["CAROM_TEST_FOLDER"])

ANSWER = b'[0, {"status": "ran", "reason": "", "value": null}]\\n'

def note(pid):
    (here / str(pid)).touch()

def sleep():
    time.sleep(3600)

def hang():
    note(os.getpid())
    sleep()

def child(act):
    pid = os.fork()
    if not pid:
        note(os.getpid())
        act()
        os._exit(0)

def thread(act):
    threading.Thread(target=act, daemon=True).start()

def others():
    return [int(name) for name in os.listdir("/proc/self/fd") if int(name) > 2]

def parent(pid):
    return int(Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[1])

def tell():
    named = {number: signal.getsignal(number) for number in signal.valid_signals()}
    Path(here.parent / "seen").write_text(json.dumps({
        "files": [os.path.basename(os.readlink(f"/proc/self/fd/{k}")).partition(":")[0] for k in sorted(others())
                  if os.path.exists(f"/proc/self/fd/{k}")],
        "signals": [int(number) for number, how in named.items() if callable(how) or how is signal.SIG_IGN],
        "limits": resource.getrlimit(resource.RLIMIT_DATA),
        "path": os.environ["PYTHONPATH"].split(os.pathsep)[-1:],
        "variables": sorted({**os.environ}),
        "leads": os.getsid(0) == os.getpid(), "keeper leads": os.getsid(os.getppid()) == os.getppid(),
        "engines": sorted({"pymunk", "mujoco", "pybullet", "Box2D"} & sys.modules.keys()),
        "work": os.path.basename(os.getcwd()),
        "threads": threading.active_count(),
        "keeper": Path(f"/proc/{os.getppid()}/cmdline").read_text(),
    }))

def tell_others(data):
    for file in others():
        left = data
        try:
            while left:
                left = left[os.write(file, left):]
        except OSError:
            pass

class Mute(Exception):
    def __str__(self):
        raise RuntimeError

class World(Standing):
    def advance(self, steps):
        exec(self.act, {**globals(), "self": self})
        self.act = ""
"""
)

#: Time limit of an act that never answers, from when it has begun.
LIMIT_S = 2.0


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, install: Callable[[str, dict[str, str]], None]) -> None:
    """Hostile adapters. Each writes its notes and files into its own folder."""
    for variable, name in (("CAROM_TEST_FOLDER", "here"), ("TMPDIR", "temp")):
        (tmp_path / name).mkdir()
        monkeypatch.setenv(variable, str(tmp_path / name))
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "temp"))
    made = "".join(f"{name.replace('-', '_')} = Adapter({name!r}, {act!r})\n" for name, (act, *_) in ACTS.items())
    install(SOURCE + made, {name: name.replace("-", "_") for name in ACTS})


@pytest.fixture
def forking(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pools fork their workers, as in the command `carom`: no thread and no engine, whatever the runner has."""
    for engine in ("pymunk", "mujoco", "pybullet", "Box2D"):
        monkeypatch.delitem(sys.modules, engine, raising=False)
    monkeypatch.setattr("carom.execution.workers.fork_server._allowed", True)
    monkeypatch.setattr("threading.active_count", lambda: 1)


@pytest.fixture
def run_acts(
    installed: None,  # noqa: ARG001 - its adapters are run
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> Callable[..., dict[str, Row]]:
    """Run a scene on adapters that do these acts, and on PIT."""

    def run(*names: str) -> dict[str, Row]:
        if hang := [name for name in names if ACTS[name][1] is Status.TIMED_OUT]:
            limit_only(monkeypatch, *hang)
            # An act notes a process when it begins; until then no time passes, however slowly the worker starts.
            clock = Clock(1.0, starts=lambda: any((tmp_path / "here").iterdir()))
            monkeypatch.setattr("carom.execution.workers.worker_process.time", clock)
        if not any("continued" in ACTS[name][2] for name in names):
            # each process may end slowly
            monkeypatch.setattr("carom.execution.workers.worker_process.GRACE_S", PATIENT_S)
        with LocalPool(2, LIMIT_S if hang else PATIENT_S, memory_limit_mb=1500) as pool:
            rows = execute_untimed(pool, "pit", *names)
        assert rows["pit"].status is Status.RAN
        return rows

    return run


SCENE = staged("one disc", disc_at(0, 0, 1, 0), duration_s=2)


def execute_untimed(pool: LocalPool, *engines: str) -> dict[str, Row]:
    """Return the row of each engine, from workers of a pool."""
    asked = Options(engines, [0.1], ["tuned"], timing=False, samples=False)
    return {row.job.engine: row for row in execute(build_plan([SCENE], asked, pool), pool).rows}


def nothing_is_left(tmp_path: Path, noted: int | None = None) -> bool:
    """Whether each process that was noted has ended, and each folder is gone."""
    pids = [int(file.name) for file in (tmp_path / "here").iterdir()]
    assert noted is None or len(pids) == noted
    return wait_until_ended(*pids) and not any((tmp_path / "temp").iterdir())


@LINUX
@pytest.mark.release
@pytest.mark.parametrize("start", ["fresh", "forked"])
@pytest.mark.parametrize("name", [name for name in ACTS if name != "kills-its-template"])
def test_hostile_act_gives_a_truthful_row(
    run_acts: Callable[..., dict[str, Row]], name: str, start: str, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    """Each hostile act ends in a row with status and reason, without leftovers; PIT's row is complete."""
    if start == "forked":
        request.getfixturevalue("forking")
    row = run_acts(name)[name]
    _, status, words = ACTS[name]
    assert row.status is status, row.reason
    assert words in row.reason
    assert len(row.reason) < 3000
    assert nothing_is_left(tmp_path)


@pytest.mark.long
@LINUX
def test_hostile_acts_at_once_affect_only_their_own_rows(
    run_acts: Callable[..., dict[str, Row]], tmp_path: Path
) -> None:
    """Five hostile acts in one run have their own rows, leave nothing, and cost less than 64 MiB."""
    names = ("forgets-everything", "answers-garbage", "prints-much", "takes-memory", "fails-to-fail")
    before = measure_resident_bytes("VmHWM") or 0
    rows = run_acts(*names)
    for name in names:
        _, status, words = ACTS[name]
        assert (rows[name].status, words in rows[name].reason) == (status, True), rows[name].reason
    assert (measure_resident_bytes("VmHWM") or 0) - before < 2**26  # of the 128 MB that were printed, the end is kept
    assert nothing_is_left(tmp_path, noted=1)


def start_run(tmp_path: Path, act: str) -> subprocess.Popen[str]:
    """Start `carom run` on an adapter, and return when its act has begun."""
    save_scene(SCENE, tmp_path / "scene.toml")
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")])}
    command = [sys.executable, "-m", "carom", "run", str(tmp_path / "scene.toml"), "-e", act, "--dt", "0.1"]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=environment)
    wait_until_begun(process, lambda: any((tmp_path / "here").iterdir()))
    return process


def pop_observations(tmp_path: Path) -> dict[str, object]:
    """Return what an adapter finds of its process, and clear it."""
    found: dict[str, object] = json.loads((tmp_path / "seen").read_text())
    (tmp_path / "seen").unlink()
    return found


@pytest.mark.release
@LINUX
def test_forked_worker_equals_a_fresh_one(
    run_acts: Callable[..., dict[str, Row]], tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    """A forked worker has the files, signals, limits, variables, session and engines of a fresh interpreter."""
    secret = os.open(tmp_path / "secret", os.O_CREAT | os.O_RDWR)
    os.set_inheritable(secret, True)
    rows = run_acts("tells")
    fresh = pop_observations(tmp_path)
    request.getfixturevalue("forking")
    forked_rows, forked = run_acts("tells"), pop_observations(tmp_path)
    os.close(secret)
    for pair in (rows, forked_rows):
        assert pair["tells"].status is Status.RAN, pair["tells"].reason
    assert fresh.pop("keeper") != forked.pop("keeper")  # an interpreter of its own, or a copy of this one
    assert forked == fresh


@pytest.mark.long
@LINUX
@pytest.mark.usefixtures("installed", "forking")
def test_workers_start_after_the_fork_server_is_killed(tmp_path: Path) -> None:
    """If an adapter kills the fork server, its own run crashes, and later runs start without the server."""
    with LocalPool(1, PATIENT_S) as pool:
        row = execute_untimed(pool, "kills-its-template")["kills-its-template"]
        after = execute_untimed(pool, "tells")["tells"]
    assert (row.status, after.status) == (Status.CRASHED, Status.RAN), (row.reason, after.reason)
    assert nothing_is_left(tmp_path)


@pytest.mark.long  # `workers` has short tests of a killed parent and of a folder that is left
@LINUX
@pytest.mark.usefixtures("installed")
@pytest.mark.parametrize("act", ["holds-the-lock", "stops", "stops-its-keeper", "forgets-and-sleeps"])
def test_killed_parent_ends_its_workers(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, act: str, run_acts: Callable[..., dict[str, Row]]
) -> None:
    """A blocked worker and its child processes end with their killed parent; the next start removes its folder."""
    with start_run(tmp_path, act) as process:
        process.kill()
    assert any((tmp_path / "temp").iterdir())
    # As in a new process.
    monkeypatch.setattr("carom.execution.workers.working_folder._clear_abandoned", _clear_abandoned.__wrapped__)
    run_acts()
    assert nothing_is_left(tmp_path, noted=1)


@pytest.mark.long
@LINUX
@pytest.mark.usefixtures("installed", "heard_interrupts")
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT])
def test_signal_ends_a_command_cleanly(tmp_path: Path, number: signal.Signals) -> None:
    """The exit code is 128 plus the signal's number, a message names it, and no process or folder remains."""
    with start_run(tmp_path, "stops") as process:
        process.send_signal(number)
        process.send_signal(number)
        _, said = process.communicate(timeout=PATIENT_S)
    assert process.returncode == 128 + number
    assert said == f"carom: ended by {number.name}; no report was written\n"
    assert nothing_is_left(tmp_path, noted=1)
