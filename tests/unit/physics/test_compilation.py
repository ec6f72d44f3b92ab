"""Compiled units: what they are made of, when they are used, where they are kept, and that nothing needs them."""

from __future__ import annotations

import contextlib
import math
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from carom.errors import CaromError
from carom.physics import compilation, machine_code, object_cache, translations
from carom.physics.compilation import Recipe, addresses, compiled_unit, is_cached, is_translated, translation

WITHOUT_NUMBA = """
import math, sys
sys.modules["numba"] = sys.modules["llvmlite"] = None  # importing them fails, as where they are not installed
import importlib.util
found = importlib.util.find_spec
importlib.util.find_spec = lambda name, *rest: None if name == "numba" else found(name, *rest)
import numpy as np
import carom
from carom.bench.gas import hard_disc_gas
from carom.solvers.event_driven.run import EventDrivenRun
run = EventDrivenRun(hard_disc_gas(1000, 0.3))
run.advance_to(math.inf, 5)
assert run.impacts == 5 and "numba is not installed" in run.notes[0], run.notes
p = np.tile([0.0, 0.0], (5, 1))
assert (carom.time_of_impact(p, [1.0, 0.0], 0.5, [3.0, 0.0], [0.0, 0.0], 0.5) == 2.0).all()
try:
    EventDrivenRun(hard_disc_gas(9, 0.3), compiled=True)
except carom.CaromError as error:
    assert "carom[fast]" in str(error)
else:
    raise SystemExit("a compiled run without numba was not refused")
"""


def test_everything_runs_where_numba_is_not_installed() -> None:
    """Without numba many discs run as plain Python and say so; a compiled run is refused with the remedy."""
    subprocess.run([sys.executable, "-c", WITHOUT_NUMBA], check=True)


def leaf(x: float) -> float:
    """Return a quarter of `x`."""
    return 0.25 * x


def total(values: np.ndarray, count: int) -> float:
    """Return the sum of a quarter of each value."""
    result = 0.0
    for k in range(count):
        result += leaf(values[k])
    return result


leaf.__module__ = "carom.example"  # of other packages nothing is compiled

FIRST, SECOND = 1.0, 2.0


def line(x: float) -> float:
    """Return a number in which two others, found by name, have different parts."""
    return x * FIRST - SECOND


def line_with_its_numbers_exchanged(x: float) -> float:
    """Return the same with the two in each other's place."""
    return x * SECOND - FIRST


class Ends(NamedTuple):
    """Two numbers."""

    first: float
    last: float


def make(x: float, y: float) -> float:
    """Return the first of two numbers."""
    return Ends(x, y).first


TOTAL = Recipe(total, "float64", ("float64*", "int64"))
LINE = Recipe(line, "float64", ("float64",))


CODES: dict[str, list[str]] = {}


def sum_of(recipe: Recipe) -> float:
    """Return what `total` of 1, 2 and 4 gives, compiled anew or loaded anew."""
    values = np.array([1.0, 2.0, 4.0])
    return float(compiled_unit.__wrapped__(recipe).ctypes(*addresses(values), 3))


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return an empty directory in which units are kept; what numba makes of a unit is made once for all tests."""
    pytest.importorskip("numba")
    monkeypatch.setenv("CAROM_CACHE_DIR", str(tmp_path))
    lowering = compilation._lowering  # noqa: SLF001 - numba takes seconds for what most of these tests don't ask about

    @contextlib.contextmanager
    def remembered(recipe: Recipe, symbol: str) -> Iterator[Callable[[], list[str]]]:
        if symbol in CODES:
            yield lambda: CODES[symbol]
        else:
            with lowering(recipe, symbol) as answer:
                yield lambda: CODES.setdefault(symbol, answer())

    monkeypatch.setattr(compilation, "_lowering", remembered)
    return tmp_path


def test_a_unit_is_named_after_all_the_code_that_went_into_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """A changed callee makes another unit, so that no stale machine code is ever taken from the cache."""
    before = TOTAL.name()
    monkeypatch.setattr(leaf, "__code__", (lambda x: 0.5 * x).__code__)
    assert TOTAL.name() != before


def test_a_unit_is_named_after_its_numbers_its_types_and_its_links(monkeypatch: pytest.MonkeyPatch) -> None:
    """Another value of a number found by name, other types, and a linked unit each make another unit."""
    digests = {
        LINE.name(),
        Recipe(line, "float64", ("int64",)).name(),
        Recipe(line, "float64", ("float64",), (TOTAL,)).name(),
    }
    monkeypatch.setitem(globals(), "FIRST", 3.0)
    assert len(digests | {LINE.name()}) == 4


def test_a_named_tuple_whose_parts_change_places_makes_another_unit(monkeypatch: pytest.MonkeyPatch) -> None:
    """The digest knows which part of a named tuple has which place."""
    recipe = Recipe(make, "float64", ("float64", "float64"))
    before = recipe.name()
    monkeypatch.setitem(globals(), "Ends", NamedTuple("Ends", [("last", float), ("first", float)]))
    assert recipe.name() != before


def test_numbers_that_change_places_make_another_unit(monkeypatch: pytest.MonkeyPatch) -> None:
    """The digest tells apart two functions that differ only in which of two numbers stands where."""
    before = LINE.name()
    code = line_with_its_numbers_exchanged.__code__.replace(co_name="line", co_consts=line.__code__.co_consts)
    monkeypatch.setattr(line, "__code__", code)
    assert LINE.name() != before


@pytest.mark.usefixtures("cache")
def test_a_linked_unit_stands_in_for_the_function_of_its_name(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is linked under a name is what the source's call of that name does."""
    monkeypatch.setattr(line, "__name__", "leaf")
    assert sum_of(TOTAL) == 1.75
    assert sum_of(Recipe(TOTAL.function, TOTAL.result, TOTAL.arguments, (LINE,))) == 7.0 - 6.0


def test_a_unit_is_cached_once_it_has_been_compiled(cache: Path) -> None:
    """Asking whether a unit need only be loaded says so from the first compilation on."""
    assert not is_cached(TOTAL)
    assert sum_of(TOTAL) == 1.75
    assert is_cached(TOTAL)
    assert len(list(cache.glob("total_*.unit"))) == 1


def test_a_cached_unit_is_not_compiled_again(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With its file there, loading a unit starts no compiler."""
    sum_of(TOTAL)
    monkeypatch.setattr(compilation, "_lowering", None)
    assert sum_of(TOTAL) == 1.75
    assert cache.exists()


@pytest.mark.parametrize("damage", ["emptied", "cut", "one bit"])
def test_a_damaged_file_is_compiled_anew(cache: Path, damage: str) -> None:
    """A file that is empty, cut short, or wrong in one bit is replaced, and the result is right."""
    sum_of(TOTAL)
    (path,) = cache.glob("total_*.unit")
    good = path.read_bytes()
    spoilt = bytearray(good)
    spoilt[len(good) // 2] ^= 1
    path.write_bytes({"emptied": b"", "cut": good[:-1], "one bit": bytes(spoilt)}[damage])
    assert sum_of(TOTAL) == 1.75
    assert path.read_bytes() == good


def test_a_unit_of_another_machine_is_not_loaded(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the directory holds the unit of another processor only, it is compiled, and both stay."""
    monkeypatch.setattr(machine_code, "target_name", lambda: "another processor")
    sum_of(TOTAL)
    monkeypatch.undo()
    monkeypatch.setenv("CAROM_CACHE_DIR", str(cache))
    assert sum_of(TOTAL) == 1.75
    assert len(list(cache.glob("total_*.unit"))) == 2


@pytest.mark.usefixtures("cache")
def test_a_unit_works_where_nothing_can_be_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without a directory that can be written, a unit is compiled and used, and nothing is raised."""
    monkeypatch.setattr(object_cache, "write", lambda *_: None)
    assert sum_of(TOTAL) == 1.75
    assert not is_cached(TOTAL)


@pytest.mark.usefixtures("cache")
def test_a_translation_that_came_with_the_package_spares_numba(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where numba did its part when the package was built, LLVM alone makes the unit; a spoilt file counts as none."""
    home = tmp_path / "units"
    home.mkdir()
    monkeypatch.setattr(translations, "_HOME", home)
    assert not is_translated(TOTAL)
    translations.write(home, TOTAL.name(), translation(TOTAL))
    assert is_translated(TOTAL)
    with monkeypatch.context() as without_numba:
        without_numba.setattr(compilation, "_lowering", None)
        assert sum_of(TOTAL) == 1.75
    (file,) = home.iterdir()
    file.write_bytes(file.read_bytes()[:-9])
    assert translations.read(TOTAL.name()) is None


def rounds(x: float) -> float:
    """Return what comes of functions of the C library, of a square root, and of a loop that clears."""
    mantissa, exponent = math.frexp(x)
    return math.ldexp(mantissa, exponent - 2) * math.sqrt(x)


def clears(column: np.ndarray, n: int) -> int:
    """Clear a column: of such a loop LLVM makes a call of `memset`."""
    for k in range(n):
        column[k] = -1
    return n


@pytest.mark.usefixtures("cache")
def test_units_that_call_the_c_library() -> None:
    """Functions of the C library, called by name or put in by LLVM, do what they do in Python."""
    unit = compiled_unit.__wrapped__(Recipe(rounds, "float64", ("float64",)))
    for x in (0.0, 5e-324, 0.7, 1e300):
        assert unit.ctypes(x) == rounds(x)
    column = np.zeros(100_000, np.int32)
    compiled_unit.__wrapped__(Recipe(clears, "int64", ("int32*", "int64"))).ctypes(*addresses(column), len(column))
    assert (column == -1).all()


def refused(x: float) -> float:
    """Return what a number has not."""
    return float(len(x))  # type: ignore[arg-type]


@pytest.mark.usefixtures("cache")
def test_what_numba_cannot_compile_is_an_error_that_says_what_to_do() -> None:
    """Where numba fails, its own words, the function's name, and a way on reach the user as one error of ours."""
    with pytest.raises(CaromError, match=r"(?s)test_compilation\.refused.*TypingError.*compiled=False"):
        compiled_unit.__wrapped__(Recipe(refused, "float64", ("float64",)))


@pytest.mark.usefixtures("cache")
def test_no_setting_of_numba_reaches_a_unit(monkeypatch: pytest.MonkeyPatch) -> None:
    """Settings of numba in the environment, such as the one that has it compile nothing, change no unit."""
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "1")
    assert compiled_unit.__wrapped__(Recipe(leaf, "float64", ("float64",))).ctypes(3.0) == 0.75


@pytest.mark.usefixtures("cache")
def test_an_interruption_ends_the_compiler_too(monkeypatch: pytest.MonkeyPatch) -> None:
    """A start that is interrupted while numba works leaves no process behind."""
    started: list[subprocess.Popen[bytes]] = []

    def interrupted(process: subprocess.Popen[bytes]) -> tuple[bytes, bytes]:
        started.append(process)
        raise KeyboardInterrupt

    monkeypatch.setattr(subprocess.Popen, "communicate", interrupted)
    with pytest.raises(KeyboardInterrupt):
        compiled_unit.__wrapped__(LINE)
    assert [process.returncode is not None for process in started] == [True]
