"""The errors that are raised on purpose."""

from __future__ import annotations

import pickle

import pytest

from carom import errors
from carom.errors import AdapterError, CaromError, InputError, MissingExtraError, Problem, SceneError, UnknownNameError


@pytest.mark.parametrize("raised", [each for each in vars(errors).values() if isinstance(each, type)])
def test_every_deliberate_error_is_caught_by_the_one_base(raised: type) -> None:
    """`except CaromError` is enough to catch whatever Carom raises on purpose."""
    assert issubclass(raised, CaromError) or not issubclass(raised, BaseException)


@pytest.mark.parametrize(
    ("error", "builtin"),
    [
        (InputError, ValueError),
        (SceneError, ValueError),
        (UnknownNameError, LookupError),
        (MissingExtraError, ImportError),
        (AdapterError, RuntimeError),
    ],
)
def test_each_error_is_also_the_builtin_that_a_caller_would_expect(
    error: type[CaromError], builtin: type[Exception]
) -> None:
    """Code that knows nothing of Carom catches its errors as the built-in ones that they are."""
    assert issubclass(error, builtin)


@pytest.mark.parametrize(
    ("field", "shown"),
    [
        ((), "is wrong"),
        (("name",), "name: is wrong"),
        (("discs", 3, "radius_m"), "discs[3].radius_m: is wrong"),
        (("discs", 3, "position_m", 1), "discs[3].position_m[1]: is wrong"),
        (("walls", 0), "walls[0]: is wrong"),
    ],
)
def test_a_problem_is_shown_as_path_and_message(field: tuple[str | int, ...], shown: str) -> None:
    """A path reads as it would be written in Python, with indices in brackets."""
    assert str(Problem(field, "is wrong")) == shown


def test_a_scene_error_shows_each_problem_on_a_line_of_its_own_after_the_source() -> None:
    """Every line of a scene error names the file, so that each can be read alone."""
    error = SceneError([Problem(("a",), "is wrong"), Problem(("b",), "too")], source="x.toml")
    assert str(error) == "x.toml: a: is wrong\nx.toml: b: too"


def test_a_scene_error_counts_the_problems_that_it_does_not_show() -> None:
    """Of very many problems the first ten are shown and the rest counted, while `problems` keeps all."""
    error = SceneError([Problem(("discs", k), "is wrong") for k in range(25)])
    lines = str(error).splitlines()
    assert len(lines) == 11
    assert lines[9] == "discs[9]: is wrong"
    assert lines[10] == "and 15 more"
    assert len(error.problems) == 25


@pytest.mark.parametrize(("listed", "last"), [(10, "and more of them"), (12, "and 2 others at least")])
def test_a_scene_error_says_where_nobody_counted_the_rest(listed: int, last: str) -> None:
    """Where only the first problems were looked for, the last line says that there are more."""
    error = SceneError([Problem(("discs", k), "is wrong") for k in range(listed)], more=True)
    assert str(error).splitlines()[10:] == [last]


@pytest.mark.parametrize("kind", [CaromError, InputError, UnknownNameError, MissingExtraError, AdapterError])
def test_hints_stand_apart_and_in_the_text(kind: type[CaromError]) -> None:
    """The text is one sentence with its hints, the message has none, and a worker process sends both home."""
    error = kind("no engine is named 'a\x1b'", hints=["did you mean 'b'?", "there are: b, c", "see \x1b"])
    for one in (error, pickle.loads(pickle.dumps(error))):  # noqa: S301 - our own bytes
        assert type(one) is kind
        assert one.message == "no engine is named 'a\\u001b'"
        assert one.hints == ("did you mean 'b'?", "there are: b, c", "see \\u001b")
        assert str(one) == f"{one.message}; did you mean 'b'? there are: b, c; see \\u001b"
    assert kind("plain").hints == ()
    assert str(kind("plain")) == kind("plain").message == "plain"


def test_hints_of_a_scene_error_are_those_of_its_problems_each_once() -> None:
    """Each line of the text has its own hint; apart, the same hint of two problems is one."""
    none = Problem(("a",), "is none", ("see b",))
    problems = [none, Problem(("c",), "is wrong"), none._replace(field=("d",))]
    error = SceneError(problems, source="x.toml")
    assert str(error) == "x.toml: a: is none; see b\nx.toml: c: is wrong\nx.toml: d: is none; see b"
    assert error.message == "x.toml: a: is none\nx.toml: c: is wrong\nx.toml: d: is none"
    assert error.hints == ("see b",)


def test_a_scene_error_survives_pickling() -> None:
    """A worker process can send a scene error home whole."""
    error = SceneError([Problem(("discs", 0, "mass_kg"), "must be greater than 0, got 0")], source="x.json", more=True)
    copy = pickle.loads(pickle.dumps(error))  # noqa: S301 - our own bytes
    assert type(copy) is SceneError
    assert copy.problems == error.problems
    assert copy.source == error.source
    assert copy.more == error.more
    assert str(copy) == str(error)


@pytest.mark.parametrize(
    "error",
    [
        InputError("no such\x1b[31m name\u202e"),
        AdapterError("no such\x1b[31m name\u202e"),
        MissingExtraError("no such\x1b[31m name\u202e"),
        UnknownNameError("no such\x1b[31m name\u202e"),
        SceneError([Problem(("name",), "no such\x1b[31m name\u202e")], "a\x07.toml"),
    ],
)
def test_a_message_has_no_control_character(error: CaromError) -> None:
    """What it quotes is shown by its escapes, in Python's own traceback too, and tells a terminal nothing."""
    assert str(error).isprintable()
    assert "no such\\u001b[31m name\\u202e" in str(error)
    assert str(pickle.loads(pickle.dumps(error))) == str(error)  # noqa: S301 - written the moment before
