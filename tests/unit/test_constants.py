"""The constants of the compiled rooms: each has its reason, and is that of plain Python where it has it too."""

from __future__ import annotations

import importlib
import re
from pathlib import Path

from tests.lengths import each

import carom

HEADER = (Path(carom.__file__).parent / "constants.h").read_text(encoding="utf-8")
NAMES = (Path(carom.__file__).parent / "constants.pxd").read_text(encoding="utf-8")

#: Where plain Python has it, by its name in the header.
PLAIN = {
    "INF": "math.inf",
    "SPLITTER": "carom.physics.double_double._SPLITTER",
    "ERROR": "carom.physics.pair_time.ERROR",
    "NEGLIGIBLE": "carom.physics.pair_time.NEGLIGIBLE",
    "GRID": "carom.physics.pair_time._GRID",
    "DOUBTFUL_SUM": "carom.physics.pair_time._DOUBTFUL_SUM",
    "DOUBTFUL_DISCRIMINANT": "carom.physics.pair_time.DOUBTFUL_DISCRIMINANT",
    "DOUBTFUL_GAP": "carom.physics.face_time._DOUBTFUL_GAP",
    "PAIR_ERROR": "carom.physics.arc_time._PAIR_ERROR",
    "PAIR_LEAST": "carom.physics.pair_time_any_size._LEAST",
    "PAIR_MOST": "carom.physics.pair_time_any_size._MOST",
    "ORDINARY": "carom.limits.ORDINARY",
    "LEAST_ORDINARY": "carom.solvers.units._LEAST",
    "ULP": "carom.solvers.impact.resolution.ULP",
    "FARTHEST": "carom.solvers.impact.resolution.FARTHEST",
    "EPOCH_IMPACTS": "carom.solvers.plain.run.EPOCH_IMPACTS",
}


#: Numbers of an enum, by the source that has it, and where plain Python has them.
NUMBERED = {
    "physics/features.pxd": {
        **{name: f"carom.physics.numbered._{name}" for name in ("PLANE", "FACE", "VERTEX", "OUTER_ARC", "INNER_ARC")},
        "FEATURE_NUMBERS": "carom.physics.numbered.FEATURE_NUMBERS",
    },
    "physics/pair_time.pxd": {"LARGEST_EXPONENT": "carom.physics.pair_time._LARGEST_EXPONENT"},
    "solvers/event_driven/layout.pxd": {
        "NO_BODY": "carom.solvers.event_driven.driven.NO_BODY",
        "MOST_OBSTACLES": "carom.solvers.event_driven.obstacles.MOST_OBSTACLES",
        **{
            name: f"carom.solvers.event_driven.run._{name}"
            for name in ("DONE", "LIMIT", "STANDSTILL", "PAUSE", "GLIDES", "CRUSHED")
        },
    },
}


def number(text: str) -> float:
    """Return the value of a C constant: a float, decimal or hexadecimal, or an integer."""
    if text.endswith("ull"):
        return int(text.removesuffix("ull"), 16)
    return float.fromhex(text) if text.startswith("0x") else float(text.replace("HUGE_VAL", "inf"))


def values() -> dict[str, float]:
    """Return the header's constants, sums of numbers."""
    found = re.findall(r"^#define CAROM_(\w+) +(\S.*)$", HEADER, re.MULTILINE)
    return {name: sum(map(number, text.strip("()").split(" + "))) for name, text in found}


@each("name", PLAIN)
def test_plain_python_computes_with_the_same_value(name: str) -> None:
    """A constant that both forms have is the same number in both."""
    assert values()[name] == plain(PLAIN[name])


def plain(where: str) -> float:
    """Return the value that plain Python has."""
    module, attribute = where.rsplit(".", 1)
    value: float = getattr(importlib.import_module(module), attribute)
    return value


@each("source", NUMBERED)
def test_plain_python_has_the_numbers_of_enums(source: str) -> None:
    """What is numbered in a compiled room has the same number in Python."""
    text = (Path(carom.__file__).parent / source).read_text(encoding="utf-8")
    for name, where in NUMBERED[source].items():
        assert re.findall(rf"^    {name} = (-?\d+)", text, re.MULTILINE) == [str(plain(where))]


def test_every_constant_is_named_for_cython_and_has_a_reason() -> None:
    """`constants.pxd` names each once, and in the header a comment stands above each or its neighbours."""
    assert re.findall(r'"CAROM_(\w+)"', NAMES) == list(values())
    assert re.findall(r"const [a-z ]+ (\w+) ", NAMES) == list(values())
    for block in re.findall(r"((?:^#define CAROM_\w+ +\S.*\n)+)", HEADER, re.MULTILINE):
        above = HEADER[: HEADER.index(block)].rstrip("\n").splitlines()[-1]
        assert above.endswith("*/"), block


def test_no_room_defines_constants_of_its_own() -> None:
    """All `#define` of a number stand in the header."""
    for source in Path(carom.__file__).parent.rglob("*.p[yx][xd]"):
        assert not re.search(r"#define carom_[A-Z_]+ [-(\d]", source.read_text(encoding="utf-8")), source
