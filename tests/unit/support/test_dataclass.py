"""`carom.support.dataclass` makes the classes that `dataclasses.dataclass` makes."""

from __future__ import annotations

import dataclasses
import inspect
import pickle
from typing import Any

import pytest

from carom.support.dataclass import dataclass


@dataclass(frozen=True, order=True)
class Point:
    """A point."""

    x: float
    y: float = 2.0
    tags: list[str] = dataclasses.field(default_factory=list, compare=False, repr=False)
    _: dataclasses.KW_ONLY
    name: str = "p"


@dataclass(frozen=True)
class Checked(Point):
    """A point that refuses a negative z."""

    z: int = 0

    def __post_init__(self) -> None:
        if self.z < 0:
            raise ValueError("z")


@dataclass(frozen=True, repr=False)
class Shown:
    """A class with methods of its own."""

    x: int

    def __repr__(self) -> str:
        return "shown"


@dataclass
class Mutable:
    """A class whose fields change."""

    x: int


def built_in(kind: type[Any], **options: bool) -> type[Any]:
    """Return the class that `dataclasses` makes of the same body."""
    fields = dataclasses.fields(kind)
    body = {"__annotations__": {f.name: f.type for f in fields}, **{f.name: f for f in fields}}
    return dataclasses.dataclass(**options)(type(kind.__name__, (), body))


def test_fields_are_set_as_by_the_built_in_decorator() -> None:
    other = built_in(Point, frozen=True, order=True)
    cases: list[tuple[list[Any], dict[str, Any]]]
    cases = [([1.0], {}), ([1.0, 3.0, ["a"]], {"name": "q"}), ([], {"x": 5, "tags": ["b"]})]
    for given, named in cases:
        assert vars(Point(*given, **named)) == vars(other(*given, **named))
    assert repr(Point(1.0)) == repr(other(1.0))
    assert list(inspect.signature(Point).parameters) == list(inspect.signature(other).parameters)
    assert Point.__match_args__ == other.__match_args__


@pytest.mark.parametrize(("given", "named"), [((), {}), ((1.0, 2.0, [], "p"), {}), ((1.0,), {"unknown": 1})])
def test_wrong_arguments_are_refused(given: tuple[Any, ...], named: dict[str, Any]) -> None:
    with pytest.raises(TypeError, match="__init__"):
        Point(*given, **named)


def test_comparisons() -> None:
    assert Point(1.0, tags=["a"]) == Point(1.0, tags=["b"])
    assert hash(Point(1.0, tags=["a"])) == hash(Point(1.0, tags=["b"]))
    assert Point(1.0) != Point(1.0, name="q")
    assert Point(1.0) < Point(1.5) <= Point(1.5)
    assert Point(1.0, 2.0) > Point(1.0, 1.0)
    assert Point(1.0) != Checked(1.0)  # the classes differ
    assert Shown(1) == Shown(1) != Shown(2)
    with pytest.raises(TypeError, match="not supported"):
        _ = Point(1.0) < 1.0  # type: ignore[operator]


def test_frozen() -> None:
    point = Checked(1.0)
    for name in ("x", "new"):
        with pytest.raises(dataclasses.FrozenInstanceError):
            setattr(point, name, 2.0)
    with pytest.raises(dataclasses.FrozenInstanceError):
        del point.x
    assert point.x == 1.0
    mutable = Mutable(1)
    mutable.x = 2
    assert mutable == Mutable(2)
    with pytest.raises(TypeError, match="unhashable"):
        hash(mutable)


def test_inheritance_and_post_init() -> None:
    assert (Checked(1.0, 2.0, [], 3).z, Checked(1.0, name="q").name) == (3, "q")
    with pytest.raises(ValueError, match="z"):
        Checked(1.0, z=-1)
    assert repr(Shown(1)) == "shown"


def test_copies() -> None:
    point = Checked(1.0, name="q")
    assert dataclasses.replace(point, y=4.0) == Checked(1.0, 4.0, name="q")
    assert pickle.loads(pickle.dumps(point)) == point  # noqa: S301 - of this test
    assert dataclasses.asdict(point) == {"x": 1.0, "y": 2.0, "tags": [], "name": "q", "z": 0}
