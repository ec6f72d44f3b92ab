"""Constants of the core: each has a reason and a use, and equals that of plain Python where there is one."""

import importlib
import re
from pathlib import Path

from tests.cases import each

import carom

PACKAGE = Path(carom.__file__).parent
CORE = PACKAGE / "core"
HEADER = (CORE / "constants.h").read_text(encoding="utf-8")

#: Constants of plain Python, by their names in the header.
PLAIN = {
    "INF": "math.inf",
    "PAIR_LEAST": "carom.core.time_of_impact._LEAST",
    "PAIR_MOST": "carom.core.time_of_impact._MOST",
    "ORDINARY": "carom.support.limits.ORDINARY",
    "LEAST_ORDINARY": "carom.solvers.units._LEAST",
    "ULP": "carom.core.resolution.ULP",
    "FARTHEST": "carom.core.resolution.FARTHEST",
}


#: Constants of plain Python that are members of enums, by the header with the enum.
NUMBERED = {
    "feature.h": {
        **{name: f"carom.core.input_rows._{name}" for name in ("PLANE", "FACE", "VERTEX", "OUTER_ARC", "INNER_ARC")},
        "FEATURE_NUMBERS": "carom.core.input_rows.FEATURE_NUMBERS",
    },
    "pic/state.h": {
        "MOST_OBSTACLES": "carom.solvers.event_driven.obstacles.MOST_OBSTACLES",
        **{
            name: f"carom.solvers.event_driven.run._{name}"
            for name in ("DONE", "LIMIT", "STANDSTILL", "PAUSE", "GLIDES", "CRUSHED")
        },
    },
}


def parse_constant(text: str) -> float:
    """Return the value of a C constant: a float, decimal or hexadecimal, or an integer."""
    if text.endswith("ull"):
        return int(text.removesuffix("ull"), 16)
    if text == "INT32_MIN":
        return -(2**31)
    return float.fromhex(text) if text.startswith("0x") else float(text.replace("HUGE_VAL", "inf"))


def read_header_constants() -> dict[str, float]:
    """Return the header's constants, which are numbers and sums of numbers."""
    found = re.findall(r"^#define CAROM_(\w+) +([-(\dH].*)$", HEADER, re.MULTILINE)
    return {name: sum(map(parse_constant, text.strip("()").split(" + "))) for name, text in found}


@each("name", PLAIN)
def test_constants_equal_those_in_python(name: str) -> None:
    """Each constant of constants.h that Python code also defines has the same value there."""
    assert read_header_constants()[name] == load_python_constant(PLAIN[name])


def load_python_constant(where: str) -> float:
    """Return the value that plain Python has."""
    module, attribute = where.rsplit(".", 1)
    value: float = getattr(importlib.import_module(module), attribute)
    return value


@each("source", NUMBERED)
def test_enum_values_equal_those_in_python(source: str) -> None:
    """The listed enum members of the core's headers have the same numbers in Python."""
    text = (CORE / source).read_text(encoding="utf-8")
    for name, where in NUMBERED[source].items():
        assert [parse_constant(value) for value in re.findall(rf"\b{name} = (-?\w+)", text)] == [
            load_python_constant(where)
        ]


def test_every_constant_is_commented_and_used() -> None:
    """In constants.h a comment precedes every block of constants, and another source uses each constant."""
    assert len(read_header_constants()) > 40
    for block in re.findall(r"((?:^#define CAROM_\w+ +[-(\dH].*\n)+)", HEADER, re.MULTILINE):
        above = HEADER[: HEADER.index(block)].rstrip("\n").splitlines()[-1]
        assert above.endswith("*/"), block
    used = {
        name
        for path in list_sources()
        if path.name != "constants.h"
        for name in re.findall(r"CAROM_(\w+)", read_text(path))
    }
    assert set(read_header_constants()) <= used


def test_numeric_macros_are_only_in_the_constants_header() -> None:
    """No source of the extension except constants.h defines a macro that is a number."""
    for path in list_sources():
        if path.name != "constants.h":
            assert not re.search(r"#define \w+ +[-(]?\d", read_text(path)), path


def list_sources() -> list[Path]:
    """Return all sources of the extension."""
    return [path for kind in ("pyx", "pxd", "h", "c") for path in PACKAGE.rglob(f"*.{kind}")]


def read_text(path: Path) -> str:
    return path.read_text(encoding="utf-8")
