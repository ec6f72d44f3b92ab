"""The stages of a comparison: each uses results of those before, and none of their functions."""

from __future__ import annotations

import inspect
from importlib import import_module
from itertools import pairwise

from docs.figures.stages import ROOT, imported_names, package_of, stages
from tests.lengths import each

PARTS = [package_of(module) for _, module, _ in stages()]


@each("part", PARTS)
def test_a_stage_calls_no_other_stage(part: str) -> None:
    """What a stage imports from another one is a type or a constant."""
    files = (ROOT / "src" / "carom" / "comparator").rglob("*.py")
    names = [".".join(file.relative_to(ROOT / "src").with_suffix("").parts) for file in files]
    imported = [
        (module, name)
        for own in names
        if package_of(own) == part
        for name, module in imported_names(own).items()
        if package_of(module) in set(PARTS) - {part}
    ]
    assert imported or part == PARTS[0]
    called = [
        name for module, name in imported if not (name.isupper() or inspect.isclass(vars(import_module(module))[name]))
    ]
    assert called == []


def test_each_stage_extends_the_result_of_the_stage_before() -> None:
    """The result of a stage has all that the results before have, so each stage takes one result."""
    results = [
        inspect.get_annotations(getattr(import_module(module), name), eval_str=True) for name, module, _ in stages()
    ]
    types = [annotations["return"] for annotations in results]
    assert all(issubclass(later, earlier) for earlier, later in pairwise(types))
    assert [next(iter(annotations.values())) for annotations in results[1:]] == types[:-1]
