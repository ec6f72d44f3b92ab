"""Packages of the mutation tests: their sources and their tests."""

from typing import NamedTuple


class Package(NamedTuple):
    """Patterns of the sources (after "!": of exceptions), and the tests that must notice a fault in them."""

    sources: tuple[str, ...]
    tests: tuple[str, ...]


_S, _U, _V = "src/carom/solvers", "tests/unit/solvers", "tests/validation"
#: Files of the core by what they compute; all others are of the event-driven loop.
_CORE = "src/carom/core"
_PRIMITIVES = tuple(
    f"{_CORE}/{name}"
    for name in (
        *("primitives.pyx", "arithmetic/double_double.h", "feature.h", "straight/*.h"),
        *("parabola/fall_time.h", "wall_contact_law.h"),
    )
)
_PIT = tuple(f"{_CORE}/{name}" for name in ("pit.*", "pit/*"))
_LOOP = (
    f"{_CORE}/*",
    f"{_CORE}/*/*.h",
    f"{_CORE}/*/*.c",
    f"!{_CORE}/*.py",
    f"!{_CORE}/wasm/*",  # `core.wasm` is built before the tests
    *(f"!{path}" for path in (*_PRIMITIVES, *_PIT)),
)
#: Any of these tests may be the one that notices a fault in the solvers.
_SOLVER_TESTS = ("tests/unit/core", _U, _V, "tests/unit/model/test_disc_arrays.py")

PACKAGES = {
    "physics": Package(("src/carom/core/*.py", *_PRIMITIVES), _SOLVER_TESTS),
    "event-driven": Package((f"{_S}/event_driven/*.py", *_LOOP), _SOLVER_TESTS),
    "solvers": Package((f"{_S}/*.py", f"{_S}/reference/*.py"), _SOLVER_TESTS),
    "pit": Package((f"{_S}/pit/*.py", *_PIT), _SOLVER_TESTS),
    "certified": Package(
        (f"{_S}/certified/*.p[yx]*",),
        (
            f"{_U}/certified",
            *(f"{_V}/test_certified_{name}.py" for name in ("known_answers", "laws", "tables", "driven", "contact")),
        ),
    ),
    "comparator": Package(("src/carom/comparator/**/*.py",), ("tests/unit/comparator", "tests/planted")),
    "execution": Package(
        (
            *(
                f"src/carom/execution/{name}.py"
                for name in ("observation/[a-z]*", "timing", "methods", "journal", "phases")
            ),
            "src/carom/studies/cross_check/plan.py",
        ),
        (
            "tests/unit/execution/observation",
            *(f"tests/unit/execution/test_{name}.py" for name in ("timing", "journal", "phases")),
            "tests/unit/studies/cross_check/test_plan.py",
        ),
    ),
}
