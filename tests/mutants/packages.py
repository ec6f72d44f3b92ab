"""Which sources are tried, and the tests of each package: those that are run when it changes."""

from typing import NamedTuple


class Package(NamedTuple):
    """Patterns of the sources, without those after "!", and the tests that must notice a fault in them."""

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
_PIC = (
    *(f"{_U}/event_driven", f"{_U}/test_pic.py", f"{_U}/test_ambiguity.py"),
    *(f"{_U}/test_options.py", f"{_U}/test_run.py", f"{_U}/test_two_discs.py", f"{_U}/test_turning.py"),
    *(f"{_V}/test_equivalences.py::test_all_forms_of_pic", f"{_V}/test_equivalences.py::test_all_pairs_are"),
    *(f"{_V}/test_equivalences.py::test_framewise_pic_is", f"{_V}/test_pic_kernel_known_answers.py"),
    *(f"{_V}/test_friction_law.py", f"{_V}/test_driven.py", f"{_V}/test_gravity.py", f"{_V}/test_contact.py"),
    *(f"{_V}/test_table_friction.py", f"{_V}/test_pic_against_certified.py", f"{_U}/test_touched_bodies.py"),
    *(f"{_U}/test_falling.py", f"{_U}/test_contacts.py"),
)

PACKAGES = {
    "physics": Package(("src/carom/core/*.py", *_PRIMITIVES), ("tests/unit/core",)),
    "event-driven": Package((f"{_S}/event_driven/*.py", *_LOOP), _PIC),
    "solvers": Package(
        (f"{_S}/*.py", f"{_S}/reference/*.py"),
        (
            *(*_PIC, "tests/unit/model/test_disc_arrays.py", f"{_V}/test_invariance.py", f"{_V}/test_equivalences.py"),
            *(f"{_U}/test_finite_walls.py", f"{_U}/test_damped.py"),
        ),
    ),
    "pit": Package((f"{_S}/pit/*.py", *_PIT), (f"{_U}/pit", f"{_U}/test_run.py", f"{_V}/test_equivalences.py")),
    "certified": Package(
        (f"{_S}/certified/*.p[yx]*",),
        (
            f"{_U}/certified",
            *(f"{_V}/test_certified_{name}.py" for name in ("known_answers", "laws", "tables", "driven", "contact")),
        ),
    ),
    "comparator": Package(("src/carom/comparator/**/*.py",), ("tests/unit/comparator", "tests/planted")),
    "execution": Package(
        tuple(
            f"src/carom/execution/{name}.py"
            for name in (
                "free_flight",
                "impact_collector",
                "open_contact",
                "final_state",
                "step_cutter",
                "engine_run",
                "timing",
                "plan",
                "journal",
                "phases",
            )
        ),
        (
            *(f"tests/unit/execution/test_{name}.py" for name in ("free_flight", "impact_collector", "step_cutter")),
            *(f"tests/unit/execution/test_{name}.py" for name in ("timing", "engine_run", "plan", "journal")),
            *(f"tests/unit/execution/test_{name}.py" for name in ("phases", "spin_in_runs")),
        ),
    ),
}
