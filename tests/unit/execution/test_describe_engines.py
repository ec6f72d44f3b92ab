"""Descriptions of installed adapters: a broken adapter is unavailable with a reason and affects no other adapter."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from tests.in_process_pool import InProcessPool
from tests.processes import PATIENT_S
from tests.scene_builders import require_value

from carom import Disc, Scene, cross_check
from carom.engines.api import Capabilities
from carom.engines.registry import EngineInfo
from carom.errors import UnknownNameError
from carom.execution.describe_engines import DescribeTask, describe_engines, select_engines
from carom.execution.job import Method, Status
from carom.execution.methods import SettingsTask, list_methods
from carom.execution.pool import LocalPool

Install = Callable[[str, dict[str, str]], None]

ADAPTER = """
import ctypes, os, signal, sys, threading, time
from types import SimpleNamespace
from carom.engines.api import Capabilities, Engine, Profile

def made(**fields):
    there = dict(name="x", engine=Engine("X"), capabilities=Capabilities(), prepare=print)
    there["profiles"] = {"tuned": Profile("as it comes", lambda dt: {"dt_s": dt})}
    return SimpleNamespace(**(there | fields))

def setting(act):
    return made(profiles={"tuned": Profile("acts", lambda dt: exec(act, globals())), "sound": made().profiles["tuned"]})

class Raising:
    name = engine = capabilities = profiles = prepare = property(lambda self: sys.no_such_version)
"""

#: What happens when an entry point is loaded, and what the line says of it.
LOADING = {
    "exits-0": ("sys.exit(0)", "crashed: exit code 0"),
    "aborts": ("os.abort()", "ended by SIGABRT"),
    "base-exception": ("raise BaseException('no')", "BaseException: no"),
    "interrupts": ("raise KeyboardInterrupt", "crashed: "),
    "raises": ("raise OSError('no licence')", "OSError: no licence"),
    "thread-stays": (
        "threading.Thread(target=time.sleep, args=(3600,)).start(); sys.exit(1)",
        "closed the pipe for answers, and continued",
    ),
    "closes-all": ("os.closerange(0, 256)", "closed the pipe for answers"),
    "loops": ("while True: pass", "timed out: no answer within"),
    "holds-the-lock": ("ctypes.PyDLL(None).sleep(3600)", "timed out: no answer within"),
}

#: What an entry point refers to, and the reason that makes the adapter unavailable.
DECLARED = {
    "no-capabilities": ("made(capabilities=None)", "capabilities must be Capabilities(...), got None"),
    "half-floats": (
        "made(capabilities=Capabilities(float_bits=16))",
        "capabilities.float_bits must be one of [32, 64], got 16; declare 32 for narrower floats",
    ),
    "nan": ("made(capabilities=Capabilities(max_speed_m_s=float('nan')))", "max_speed_m_s must be a number"),
    "order": ("made(capabilities=Capabilities(restitution=(1.0, 0.0)))", "must be a smallest and a largest value"),
    "no-engine": ("made(engine=None)", "engine must be Engine(...), got None"),
    "no-engine-name": ("made(engine=Engine(None))", "engine.name: Input should be a valid string, got None"),
    "old": ("made(engine=Engine('X', oldest='v2'))", "engine.oldest must be numbers with dots between them, got 'v2'"),
    "no-name": ("made(name=None)", "the name of an adapter must be a text, got None"),
    "no-profiles": ("made(profiles={})", "profiles must be a mapping with at least one profile"),
    "odd-profile": ("made(profiles={'odd': 'text'})", "profiles['odd'] must be a Profile, got 'text' (str)"),
    "changed-no-mapping": (
        "made(profiles={'tuned': Profile('x', dict, changed='friction')})",
        "profiles['tuned'].changed must be a mapping, got 'friction'",
    ),
    "changed-no-reason": (
        "made(profiles={'tuned': Profile('x', dict, changed={'friction': None})})",
        "profiles['tuned'].changed['friction'] must be a text, got None",
    ),
    "own-capabilities": (
        "made(profiles={'tuned': Profile('x', dict, capabilities=Capabilities(float_bits=8))})",
        "profiles['tuned'].capabilities.float_bits must be one of",
    ),
    "wrong": ("42", "is not an adapter: it lacks name, engine, capabilities, profiles, prepare"),
    "raising": ("Raising()", "failed: AttributeError: module 'sys' has no attribute 'no_such_version'"),
    "lacking": ("made(version=lambda: sys.no_such_version)", "has no attribute 'no_such_version'"),
}


@pytest.fixture
def importing_adapters(install: Install) -> None:
    """Adapters with side effects at import, as attributes that are created at their first use."""
    acts = {name.replace("-", "_"): act for name, (act, _) in LOADING.items()}
    source = f"{ADAPTER}\nACTS = {acts!r}\ndef __getattr__(name):\n    return exec(ACTS[name], globals())\n"
    install(source, {name: name.replace("-", "_") for name in LOADING})


@pytest.mark.usefixtures("importing_adapters")
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.long] * (name != "exits-0")) for name in LOADING]
)
def test_adapter_that_fails_on_import_is_unavailable(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """An adapter that crashes, hangs or raises on import is listed as unavailable with the reason."""
    # An adapter that hangs is ended soon, and one that ends by itself is waited for, however slowly its process starts.
    monkeypatch.setattr(DescribeTask, "min_time_limit_s", 6.0 if "timed out" in LOADING[name][1] else PATIENT_S)
    if "closed" not in LOADING[name][1]:
        monkeypatch.setattr("carom.execution.workers.worker_process.GRACE_S", PATIENT_S)
    with LocalPool(1, 6.0) as pool:
        (line,) = describe_engines([name], pool)
    assert LOADING[name][1] in line.unavailable
    assert not line.profiles


def test_invalid_declarations_make_an_adapter_unavailable(install: Install) -> None:
    """The reason names the wrong field and its value; a sound adapter of the same distribution has its version."""
    source = ADAPTER + "".join(f"{name.replace('-', '_')} = {what}\n" for name, (what, _) in DECLARED.items())
    points = {name: name.replace("-", "_") for name in (*DECLARED, "sound", "misspelt")}
    install(f"{source}sound = made()\n", points)
    with InProcessPool() as pool:
        found = {info.name: info for info in describe_engines([*points], pool)}
    sound = found["sound"]
    assert (sound.available, sound.engine, sound.version) == (True, "X", "1.0")
    assert sound.distribution.startswith("hostile_")
    for name, (_, words) in {**DECLARED, "misspelt": ("", "has no attribute 'misspelt'")}.items():
        assert words in found[name].unavailable
        assert (found[name].version, found[name].distribution) == ("", sound.distribution)


@pytest.mark.long
def test_adapters_of_a_distribution_share_a_process(install: Install) -> None:
    """Adapters of one distribution share a process; one that fails there is described again in its own."""
    spoils = "import builtins, os\nbuiltins.spoilt = True\nfirst = made(version=lambda: str(os.getpid()))\n"
    fails = "def version():\n    assert not hasattr(builtins, 'spoilt')\n    return 'alone'\n"
    install(
        f"{ADAPTER}\nimport builtins\ndef __getattr__(name):\n    exec({spoils!r}, globals())\n    return first\n"
        f"{fails}second, third = made(version=lambda: str(os.getpid())), made(version=version)\n",
        {"a-first": "first", "b-second": "second", "c-third": "third"},
    )
    with LocalPool(2) as pool:
        found = {info.name: info for info in describe_engines(["a-first", "b-second", "c-third"], pool)}
    assert found["a-first"].version == found["b-second"].version != ""
    assert found["c-third"].version == "alone", found["c-third"].unavailable


def test_missing_engine_is_selected_only_by_name() -> None:
    """By default engines that are not installed are left out; broken adapters are always selected."""
    there = EngineInfo("there", "There", "1", "", Capabilities(), {"tuned": ""}, "")
    missing = replace(there, name="missing", version="", unavailable="not installed; pip install it")
    broken = replace(missing, name="broken", capabilities=None, profiles={})
    infos = [there, missing, broken]
    assert select_engines(infos, None) == [there, broken]
    assert select_engines(infos, ["there", "missing", "broken"]) == infos


def test_unrequested_adapter_is_not_imported(install: Install, tmp_path: Path) -> None:
    """A cross-check of PIT imports no other adapter, and neither does the refusal of an unknown engine."""
    install(f"open({str(tmp_path / 'imported')!r}, 'w')\nimport os; os._exit(0)\n", {"deadly": "adapter"})
    scene = Scene(name="one", discs=[Disc(position_m=(0, 0), radius_m=1)], duration_s=1)
    results = cross_check([scene], ["pit"], dts=[0.1], timing=False, pool=InProcessPool())
    assert {row.status for row in results.rows} == {Status.RAN}
    with pytest.raises(UnknownNameError, match="deadly"):
        describe_engines(["nonesuch"], InProcessPool())
    assert not (tmp_path / "imported").exists()


@pytest.mark.long
@pytest.mark.parametrize(
    ("act", "said"),
    [
        ("os._exit(0)", "crashed: query of its settings: exit code 0"),
        ("time.sleep(3600)", "timed out: query of its settings: no answer within"),
    ],
)
def test_failing_settings_affect_only_their_profile(
    install: Install, monkeypatch: pytest.MonkeyPatch, act: str, said: str
) -> None:
    """A profile whose settings crash or hang is refused with the reason, and the other profiles run."""
    monkeypatch.setattr(DescribeTask, "min_time_limit_s", PATIENT_S)
    # The limit is that of both profiles: long enough for a process to start slowly after the one that hung.
    monkeypatch.setattr(SettingsTask, "min_time_limit_s", 30.0 if "sleep" in act else PATIENT_S)
    install(ADAPTER + f"odd = setting({act!r})\n", {"odd": "odd"})
    with LocalPool(1, 30.0) as pool:
        methods = list_methods(describe_engines(["odd"], pool), ["tuned", "sound"], [0.1], pool)
    tuned, sound = Method("odd", "tuned"), Method("odd", "sound")
    assert set(methods.by_engine_and_step["odd", 0.1]) == {tuned, sound}
    assert require_value(methods.find_refusal(tuned, 0.1)).problem.startswith(said)
    assert methods.find_refusal(sound, 0.1) is None
