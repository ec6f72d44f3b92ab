"""What is compiled does what Python does, to the bit; what cannot be compiled is refused, with its place."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from carom.errors import CaromError
from carom.physics.compilation import Recipe, addresses, compiled_unit, prefetch
from carom.physics.double_double import two_sum

pytest.importorskip("llvmlite")

Column = Any
LIMIT, SHIFT = 2.5, 3


def of_numbers(a: float, b: float, i: int, j: int, out: Column) -> int:
    """Do arithmetic, comparisons and conversions of floats and integers."""
    out[0], out[1], out[2] = a + b, a - b * i, -a
    out[3] = a / b if b != 0.0 else math.inf
    out[4] = i / j if j != 0 else 0
    out[5] = abs(a) + abs(i)
    out[6] = max(a, b) - min(a, b, LIMIT)
    out[7] = (a < b) + 2 * (a <= b) + 4 * (a > b) + 8 * (a >= b) + 16 * (a == b) + 32 * (a != b)
    out[8] = (i < j) + 2 * (i <= j) + 4 * (i > j) + 8 * (i >= j) + 16 * (i == j) + 32 * (i != j)
    out[9] = (i + j) * (i - j) + (i & 255) - (j | 6) + (i ^ j)
    out[10] = (i >> SHIFT) + (j << 2) - (i >> 1 << 1)
    out[11] = i // j if j != 0 else 0
    out[12] = i % j if j != 0 else 0
    out[13] = 1 if -1.0 < a <= b < LIMIT else 0
    out[14] = int(a) if abs(a) < 1e9 else 0
    out[15] = float(i) * (2.0**-20) + (7 // 2) + -(3) % 5
    out[16] = 1.0 if (a < b and not i < j) or bool(j) else 0.0
    out[17] = math.sqrt(abs(a))
    mantissa, exponent = math.frexp(b)
    out[18], out[19] = mantissa, exponent
    out[20] = math.ldexp(mantissa, exponent - 2)
    certain = (a < b) & (i < j) | (i == 0)
    out[21] = certain
    return i if i > j else j


def of_branches(a: float, b: float, i: int, j: int, out: Column) -> int:
    """Go through loops and branches, early ends among them, and tuples."""
    count = 0
    for k in range(7):
        if k == 2:
            continue
        if k > i & 7:
            break
        count += k
    out[0] = count
    for k in range(5, 0, -2):
        out[1] += k * a
    place = i & 15
    while place > 0:
        place >>= 1
        if place == j & 3:
            break
        out[2] += 1
    pair = (a, (b, i))
    for part in (pair[0], pair[1][0], a * b):
        if part > 1e100:
            break
        if part < 0.0:
            continue
        out[3] += part
    high, low = two_sum(*(a, b))
    high, low = low, high
    out[4], out[5] = high, low
    first, (second, third) = pair if a < b else (b, (a, j))
    out[6], out[7], out[8] = first, second, third
    out[9] = out[10] = early(i, j)
    if i < j:
        if a < b:
            return 1
    elif a > b:
        return 2
    else:
        out[11] -= 1.0
    while True:
        count += 1
        if count > j & 31:
            return count


def early(i: int, j: int) -> float:
    """Return a float or an integer, from the midst of a loop."""
    for k in range(i & 7):
        if k == j & 7:
            return k
    return -0.5


early.__module__ = "carom.example"  # of other packages nothing is compiled

ARGUMENTS = ("float64", "float64", "int64", "int64", "float64*")
numbers = st.one_of(
    st.floats(width=64), st.sampled_from([0.0, -0.0, 1.0, 2.5, math.inf, -math.inf, math.nan, 5e-324, 1.7e308])
)
integers = st.integers(-(2**30), 2**30) | st.integers(-9, 9)


@pytest.fixture(scope="module", autouse=True)
def _cache(tmp_path_factory: pytest.TempPathFactory) -> Any:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("CAROM_CACHE_DIR", str(tmp_path_factory.mktemp("units")))
        yield


@pytest.mark.parametrize("function", [of_numbers, of_branches])
@settings(max_examples=200, deadline=None)
@given(a=numbers, b=numbers, i=integers, j=integers)
def test_compiled_code_does_what_python_does(function: Callable[..., int], a: float, b: float, i: int, j: int) -> None:
    """For all numbers, infinite and missing ones too, every result of the two forms has the same bits."""
    plain, column = [0.0] * 24, np.zeros(24)
    expected = function(a, b, i, j, plain)
    unit = compiled_unit(Recipe(function, "int64", ARGUMENTS))
    assert unit.ctypes(a, b, i, j, *addresses(column)) == expected
    got = np.array(plain, np.float64)
    same = (got.view(np.int64) == column.view(np.int64)) | (np.isnan(got) & np.isnan(column))
    assert same.all(), (np.flatnonzero(~same), got[~same], column[~same])


class Pair(NamedTuple):
    """Two columns."""

    first: Column
    second: Column


def of_names(first: Column, second: Column, n: int) -> int:
    """Hand columns on together, and take them apart by name."""
    pair = Pair(first, second)
    for k in range(n):
        prefetch(pair.second, k + 1)
        exchange(pair, k)
    swapped = Pair(pair.second, pair.first) if n > 2 else pair
    return int(swapped.first[0] * 10.0 + swapped[1][0])


def exchange(pair: Pair, k: int) -> None:
    """Exchange two elements."""
    first, second = pair
    pair.first[k], pair.second[k] = second[k], first[k]


exchange.__module__ = "carom.example"


def test_tuples_with_names() -> None:
    """Columns travel together in a named tuple, and asking for memory ahead of time changes nothing."""
    for n in (2, 3):
        lists = [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]
        arrays = [np.array(each) for each in lists]
        plain: Callable[..., int] = of_names
        expected = plain(*lists, n)
        unit = compiled_unit(Recipe(of_names, "int64", ("float64*", "float64*", "int64")))
        assert unit.ctypes(*addresses(*arrays), n) == expected
        assert [each.tolist() for each in arrays] == lists


def of_columns(floats: Column, wide: Column, narrow: Column, bytes_: Column, n: int) -> int:
    """Read and write columns of every type."""
    for k in range(n):
        wide[k] += narrow[k] * bytes_[k]
        narrow[k] = wide[k] - 3
        bytes_[k] = bytes_[k] >> 1
        floats[k] *= narrow[k]
    for k in range(n):
        bytes_[k] = 0 if k == 0 else bytes_[k - 1] + 1
    return n


def test_columns_of_every_type() -> None:
    """Elements are widened when read, sign or not, and narrowed when written."""
    columns = [
        np.array([1.5, -2.0, 3.0]),
        np.array([2**40, -5, 7]),
        np.array([-7, 8, 2**31 - 1], np.int32),
        np.array([255, 128, 1], np.uint8),
    ]
    columns[1][2] = 0
    lists = [column.tolist() for column in columns]
    columns[1][0] = lists[1][0] = 2**20
    plain: Callable[..., int] = of_columns
    plain(*lists, 3)
    types = ("float64*", "int64*", "int32*", "uint8*", "int64")
    compiled_unit(Recipe(of_columns, "int64", types)).ctypes(*addresses(*columns), 3)
    assert [column.tolist() for column in columns] == lists


def clears(column: Column, n: int) -> int:
    """Clear a column: of such a loop LLVM makes a call of `memset`."""
    for k in range(n):
        column[k] = -1
    return n


def copies(source: Column, target: Column, n: int) -> int:
    """Copy a column: of such a loop LLVM makes a call of the C library, if it knows that the two do not overlap."""
    for k in range(n):
        target[k] = source[k]
    return n


def test_loops_that_become_library_calls() -> None:
    """A loop that clears or copies a large array works, whatever it is turned into."""
    column, other = np.zeros(100_000, np.int32), np.zeros(100_000, np.int32)
    compiled_unit(Recipe(clears, "int64", ("int32*", "int64"))).ctypes(*addresses(column), len(column))
    compiled_unit(Recipe(copies, "int64", ("int32*", "int32*", "int64"))).ctypes(*addresses(column, other), len(column))
    assert (column == -1).all()
    assert (other == -1).all()


REFUSED = {
    "another function": ("    return len(x)", "call of len"),
    "a list display": ("    y = [1, 2]\n    return 1", "List"),
    "a name of a module": ("    return int(math.tau * np.pi)", "np.pi"),
    "another type": ("    y = 1\n    y = x\n    return y", "double in place of i64"),
    "a number as truth value": ("    return 1 and 2", "i64 in place of i1"),
    "a float's remainder": ("    return int(x % 2.0)", "Mod of double"),
    "no result": ("    if x > 0.0:\n        return 1", "returns a number here and none there"),
    "recursion": ("    return refused(x)", "calls itself"),
    "a keyword": ("    return int(max(x, x, key=abs))", "call with keywords"),
    "exceptions": ("    try:\n        return 1\n    finally:\n        pass", "Try"),
    "a string": ("    return 'a'", "constant 'a'"),
    "an else of a loop": (
        "    for k in range(3):\n        pass\n    else:\n        return 1\n    return 2",
        "loop with else",
    ),
    "a wrong number of arguments": ("    return early(1)", "call with 1 arguments for 2"),
    "a changing index": ("    y = (1, 2)\n    return y[int(x)]", "an index into a tuple"),
    "a float as an index": ("    return int(x[x])", "indexing double"),
}


def function_of(path: Path, body: str) -> Callable[..., Any]:
    """Return a function `refused` of one float, defined in a file."""
    text = f"import math\nimport numpy as np\ndef refused(x):\n{body}\n"
    path.write_text(text)
    names: dict[str, Any] = {"__name__": "carom.example", "early": early}
    exec(compile(text, str(path), "exec"), names)  # noqa: S102 - the text is from this file
    function: Callable[..., Any] = names["refused"]
    return function


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_compiled_is_refused_with_its_place(tmp_path: Path, name: str) -> None:
    """Anything outside the part of Python that is translated is an error that names file, line and thing."""
    body, complaint = REFUSED[name]
    function = function_of(tmp_path / "example.py", body)
    with pytest.raises(CaromError, match=complaint) as error:
        compiled_unit(Recipe(function, "int64", ("float64",)))
    assert ".py:" in str(error.value) or name == "recursion"


def test_a_source_changed_since_it_was_imported_is_not_compiled(tmp_path: Path) -> None:
    """Where the file now says something else than what runs, compiling it is refused."""
    function = function_of(tmp_path / "example.py", "    return 1")
    (tmp_path / "example.py").write_text("import math\nimport numpy as np\ndef refused(x):\n    return 2\n")
    with pytest.raises(CaromError, match="start Python anew"):
        compiled_unit(Recipe(function, "int64", ("float64",)))


def test_a_result_of_another_type_is_refused(tmp_path: Path) -> None:
    """A unit declared as an integer's must not return a float."""
    with pytest.raises(CaromError, match="returns double, not int64"):
        compiled_unit(Recipe(function_of(tmp_path / "example.py", "    return x"), "int64", ("float64",)))
