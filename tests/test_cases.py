"""Rows of `each`: every row runs, and every row that fails is reported, whatever it raises and how deep."""

from collections.abc import Callable

import pytest
from tests.cases import each


def fail_deep(second: str) -> None:
    if second == "a":
        raise ValueError(second)
    pytest.fail(second)


def fail_to_raise(_: str) -> None:
    with pytest.raises(ValueError, match="never"):
        pass


@pytest.mark.parametrize("fails", [fail_deep, fail_to_raise])
def test_nested_each_runs_every_row(fails: Callable[[str], None]) -> None:
    r"""With two nested `each` all rows run, and failures of inner rows do not hide the next outer row.

    Each failure carries a note with its arguments.
    """
    tried = []

    @each("first", [1, 2, 3])
    @each("second", ["a", "b", "c"])
    def test(first: int, second: str) -> None:
        tried.append((first, second))
        if first < 3 and second != "c":
            fails(second)

    with pytest.raises(BaseExceptionGroup, match="2 of 3 rows fail") as caught:
        test()
    assert len(tried) == 9
    inner = [one for one in caught.value.exceptions if isinstance(one, BaseExceptionGroup)]
    assert [len(one.exceptions) for one in inner] == [2, 2]
    assert [one.__notes__ for one in inner] == [["with {'first': 1}"], ["with {'first': 2}"]]
    assert [one.__notes__ for one in inner[0].exceptions] == [["with {'second': 'a'}"], ["with {'second': 'b'}"]]
