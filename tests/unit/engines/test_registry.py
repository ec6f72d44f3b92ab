"""Adapters found by entry point, without importing an engine."""

import sys
from collections.abc import Callable
from importlib import metadata
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from tests.cases import each
from tests.in_process_pool import InProcessPool
from tests.installed_adapters import clear_entry_point_caches, write_distribution

from carom.engines.api import Engine
from carom.engines.registry import (
    ENTRY_POINT_GROUP,
    explain_unavailable_adapter,
    explain_unavailable_engine,
    find_version,
)
from carom.execution.describe_engines import describe_engines, engines


def test_engines_lists_every_entry_point() -> None:
    """`engines()` lists all installed entry points, first `pic` and `pit` with Carom's version, the others by name."""
    infos = engines()
    names = [info.name for info in infos]
    assert set(names) == {point.name for point in metadata.entry_points(group=ENTRY_POINT_GROUP)}
    assert names == ["pic", "pit", *sorted(names[2:])]
    for info in infos[:2]:
        assert (info.available, info.unavailable, info.version) == (True, "", metadata.version("carom"))
        assert info.own_profiles(["default", "tuned"]) == list(info.profiles)


HERE = sys.version_info[:2]
ABSENT = "no_such_module_at_all"
NO_WHEEL = f"{ABSENT} is not installed, and X has no wheel for CPython 3.0 and later (this is {HERE[0]}.{HERE[1]})"
#: An engine, and why it is unavailable: empty where it is not.
REASONS = {
    "missing": (Engine("X", module=ABSENT, install="pip install x"), f"{ABSENT} is not installed; pip install x"),
    "no wheel here": (Engine("X", module=ABSENT, no_wheel_from=(3, 0)), NO_WHEEL),
    "no wheel later": (Engine("X", module=ABSENT, no_wheel_from=(HERE[0] + 1, 0)), f"{ABSENT} is not installed"),
    "dotted": (Engine("X", module="no_such_package.part"), "no_such_package.part is not installed"),
    "of no release": (Engine("X", module="json", distribution="no-such-thing", oldest="5.7"), ""),
    "there": (Engine("X", module="json.decoder"), ""),
    "of no module": (Engine("X"), ""),
}


@each("row", REASONS)
def test_engine_is_unavailable_only_if_a_module_is_missing(row: str) -> None:
    """The reason names the missing module and how to install it, or that no wheel exists for this Python."""
    engine, reason = REASONS[row]
    assert explain_unavailable_engine(engine) == reason


@each(
    "installed, oldest, refused",
    [
        ("5.4.1", "5.7", True),
        ("4", "5.7", True),
        ("5.7", "5.7.1", True),
        ("5.7", "5.7.0", False),
        ("5.10.0", "5.7", False),
        ("5.4.1", "", False),
    ],
)
def test_release_older_than_the_oldest_supported_is_unavailable(
    installed: str, oldest: str, refused: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Releases are compared as numbers, and the reason names both releases and the install command."""
    name = f"nonesuch{installed.replace('.', '')}"  # a process reads the release of a distribution once
    write_distribution(tmp_path, name, {}, version=installed)
    monkeypatch.syspath_prepend(tmp_path)
    engine = Engine("Nonesuch", module="json", distribution=name, install="pip install nonesuch", oldest=oldest)
    reason = f"Nonesuch {installed} is older than {oldest}, the oldest release that its adapter supports"
    assert explain_unavailable_engine(engine) == (f"{reason}; pip install nonesuch" if refused else "")


@each(
    "engine, own, reason, version",
    [
        (Engine("In its adapter"), {}, "", metadata.version("carom")),
        (Engine("Of a module", module="json"), {}, "", "unknown"),
        (Engine("Program"), {"version": str, "unavailable": lambda: "no node"}, "no node", "unknown"),
        (Engine("Both", module=ABSENT), {"unavailable": lambda: "no licence"}, f"{ABSENT} is not installed", "unknown"),
    ],
)
def test_adapter_reports_its_version_and_availability(
    engine: Engine, own: dict[str, Callable[[], str]], reason: str, version: str
) -> None:
    """An adapter's own version and reason are used unless its engine's module has them."""
    adapter: Any = SimpleNamespace(engine=engine, **own)
    assert (explain_unavailable_adapter(adapter), find_version(adapter, "carom")) == (reason, version)


def test_invalid_metadata_makes_only_its_own_entry_unavailable(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Unreadable entry points and metadata give unavailable engines with the reason, and the others stay available."""
    for name, entry_points in (
        ("bytes", b"[carom.adapters]\nq\xff = module:adapter\n"),
        ("words", b"[carom.adapters]\nno entry point\n"),
        ("value", b"[carom.adapters]\nq = no module !\nr =\n"),
        ("unnamed", b"[carom.adapters]\nu = no_such_module_at_all:adapter\n"),
    ):
        write_distribution(tmp_path / name, name, {})
        (info,) = (tmp_path / name).iterdir()
        (info / "entry_points.txt").write_bytes(entry_points)
        if name == "unnamed":
            (info / "METADATA").write_bytes(b"\xff")
        monkeypatch.syspath_prepend(str(tmp_path / name))
    clear_entry_point_caches()
    unreadable = "can't read the entry points of an installed distribution"
    reasons = {str(tmp_path / "bytes"): unreadable, str(tmp_path / "words"): unreadable}
    reasons |= dict.fromkeys("qr", "an entry point must name an object, as module:object, got")
    reasons |= {"u": "the adapter 'u' can't be loaded", "pit": ""}
    for found in describe_engines([*reasons], InProcessPool()):
        assert reasons[found.name] in found.unavailable
        assert found.available == (found.name == "pit")
    monkeypatch.undo()
    clear_entry_point_caches()
