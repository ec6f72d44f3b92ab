"""Settings and fixtures of every test, for the processes that run tests.

Property tests draw the same examples in every run, so that a failure is the code's and not the day's; more of them with
``HYPOTHESIS_PROFILE=more``, as in `make test-long`. To search further, run with ``HYPOTHESIS_PROFILE=search``: new
examples each time, and many more.
"""

import gc
import os
import signal
import socket
import sys
from collections.abc import Callable, Generator, Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from typing import Any

import pytest
from hypothesis import HealthCheck, settings
from hypothesis.internal.conjecture import providers
from tests.conftest import is_short
from typer.main import get_command

from carom import Scene
from carom.engines.api import Adapter, Observation, Setting, World
from carom.engines.registry import explain_unavailable_adapter, load_adapter
from carom.execution.workers.fork_server import PATIENCE_S, ForkServer
from carom.web import page

# Hypothesis measures by the clock, which a busy machine stretches: neither an example nor the drawing of some is timed.
UNTIMED: dict[str, Any] = {"deadline": None, "suppress_health_check": [HealthCheck.too_slow]}
settings.register_profile("carom", **UNTIMED, derandomize=True, max_examples=8)
settings.register_profile("more", **UNTIMED, derandomize=True, max_examples=50)
settings.register_profile("search", **UNTIMED, max_examples=2000, print_blob=True)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "carom"))
# Hypothesis also draws constants of the loaded modules, and these depend on the tests that ran before.
pytest.MonkeyPatch().setattr(providers, "_get_local_constants", lambda: providers._local_constants, raising=False)  # noqa: SLF001

# Hundreds of tests run commands of one program, so its options are read only once.
pytest.MonkeyPatch().setattr("typer.main.get_command", cache(get_command))
# Each page of a scene has the same scripts, packed once for all.
pytest.MonkeyPatch().setattr(page, "pack_block", cache(page.pack_block))


class _Shared(ForkServer):
    """One for all pools, which ends with the tests."""

    def close(self) -> None:
        pass


@cache
def _template() -> ForkServer:
    """A process that has a worker's imports done and forks workers, as that of `carom`; the tests' own has threads."""
    ours, its = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    its.set_inheritable(True)
    program = (
        "import os, socket, sys, carom.execution.describe_engines, carom.engines.registry\n"
        "import carom.execution.observation.engine_run\n"
        "import carom.execution.workers.worker_main, carom.execution.workers.fork_server as it\n"
        "carom.engines.registry.list_adapter_points()\n"  # inherited, unless a test changes what is installed
        "it._serve(socket.socket(fileno=int(sys.argv[1])), os.getppid())"
    )
    process = os.posix_spawn(sys.executable, [sys.executable, "-c", program, str(its.fileno())], os.environ)
    its.close()
    ours.settimeout(5 * PATIENCE_S)
    return _Shared(ours, process)


def pytest_configure(config: pytest.Config) -> None:
    """Let workers be forked, as by the command, except in long tests and where lines are counted."""
    if is_short(config) and not config.getoption("cov_source", None):
        pytest.MonkeyPatch().setattr(ForkServer, "launch", _template)


def pytest_unconfigure() -> None:
    """End the process that forks workers, if there is one, without a last garbage collection."""
    gc.freeze()
    if _template.cache_info().currsize:
        ForkServer.close(_template())


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Exclude the collected tests from garbage collection, because they exist until the end anyway.

    Timing passes collect garbage before each run and would take a hundred times as long. Rarer collections between
    them save a twentieth of the time.
    """
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.set_threshold(100_000, 20, 100)
        gc.enable()


@pytest.fixture
def heard_interrupts() -> Iterator[None]:
    """Let processes that the test starts receive signals, which background jobs of a script ignore."""
    numbers = (signal.SIGINT, signal.SIGHUP, signal.SIGQUIT)
    before = {number: signal.signal(number, signal.default_int_handler) for number in numbers}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.fixture
def in_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """Run engines in this process, because the start of a worker takes longer than most tests."""
    from tests.in_process_pool import InProcessPool

    from carom.execution import describe_engines, pool, scene_import, settings_code

    for module in (settings_code, describe_engines, scene_import, pool):
        monkeypatch.setattr(module, "LocalPool", lambda *_: InProcessPool())


@pytest.fixture
def blank_pages(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave the page of a report empty, for tests of its other files: drawing the page takes most of the time."""
    monkeypatch.setattr("carom.report.render.html.render_html", lambda _document: "")


@cache
def _found(name: str) -> tuple[Adapter, str]:
    adapter = load_adapter(name)
    return adapter, explain_unavailable_adapter(adapter)


@pytest.fixture
def named() -> Callable[[str], Adapter]:
    """One adapter by its name; the test is skipped where its engine is missing."""

    def find(name: str) -> Adapter:
        adapter, reason = _found(name)
        if reason:
            pytest.skip(reason)
        return adapter

    return find


def _engine(name: str) -> object:
    @pytest.fixture(name=name)
    def found(named: Callable[[str], Adapter]) -> Adapter:
        """Return the adapter of this engine, or skip."""
        return named(name)

    return found


pymunk, pybullet, mujoco, box2d = map(_engine, ("pymunk", "pybullet", "mujoco", "box2d"))
rapier, dart, drake, ode, newton = map(_engine, ("rapier", "dart", "drake", "ode", "newton"))


@contextmanager
def _world(
    adapter: Adapter, scene: Scene, dt_s: float, profile: str, changes: Mapping[str, Setting]
) -> Iterator[World]:
    world = adapter.prepare(scene, {**adapter.profiles[profile].settings(dt_s), **changes})
    try:
        yield world
    finally:
        world.close()


@pytest.fixture
def drive() -> Callable[..., list[Observation]]:
    """Run a scene to its end, and return the observations at the start and after every step."""

    def run(
        adapter: Adapter, scene: Scene, dt_s: float, profile: str = "tuned", **changes: Setting
    ) -> list[Observation]:
        with _world(adapter, scene, dt_s, profile, changes) as world:
            seen = [world.observe()]
            for _ in range(scene.step_count(dt_s)):
                world.advance(1)
                seen.append(world.observe())
            return seen

    return run


@pytest.fixture
def finish() -> Callable[..., Observation]:
    """Run a scene to its end in one call, and return the observation there."""

    def run(adapter: Adapter, scene: Scene, dt_s: float, profile: str = "tuned", **changes: Setting) -> Observation:
        with _world(adapter, scene, dt_s, profile, changes) as world:
            world.advance(scene.step_count(dt_s))
            return world.observe()

    return run
