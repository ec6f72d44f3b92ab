"""Constants of the core that Python code also defines."""

import importlib
import re
from pathlib import Path

from tests.cases import each

import carom

CORE = Path(carom.__file__).parent / "core"

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


def load_python_constant(where: str) -> float:
    """Return the value in Python of a constant, whose module and name are given."""
    module, attribute = where.rsplit(".", 1)
    value: float = getattr(importlib.import_module(module), attribute)
    return value


@each("name", PLAIN)
def test_constants_equal_those_in_python(name: str) -> None:
    """Each constant of constants.h that Python code also defines has the same value there."""
    header = (CORE / "constants.h").read_text(encoding="utf-8")
    ((text,),) = [re.findall(rf"^#define CAROM_{name} +(.*)$", header, re.MULTILINE)]
    assert sum(map(parse_constant, text.strip("()").split(" + "))) == load_python_constant(PLAIN[name])


@each("source", NUMBERED)
def test_enum_values_equal_those_in_python(source: str) -> None:
    """The listed enum members of the core's headers have the same numbers in Python."""
    text = (CORE / source).read_text(encoding="utf-8")
    for name, where in NUMBERED[source].items():
        assert [parse_constant(value) for value in re.findall(rf"\b{name} = (-?\w+)", text)] == [
            load_python_constant(where)
        ]
