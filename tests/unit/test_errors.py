"""The errors that are raised on purpose."""

import pickle
from collections.abc import Callable
from typing import Any

import pytest
from tests.cases import each

import carom
from carom import errors
from carom.errors import AdapterError, CaromError, InputError, MissingExtraError, Problem, SceneError, UnknownNameError

#: Standard exceptions, for callers that do not import Carom's.
BUILTINS: dict[type[CaromError], type[Exception]] = {
    InputError: ValueError,
    SceneError: ValueError,
    UnknownNameError: LookupError,
    MissingExtraError: ImportError,
    AdapterError: RuntimeError,
}


def test_every_error_is_a_carom_error_and_a_builtin_error() -> None:
    """All exceptions of `carom.errors` are CaromErrors, and those in the table are also standard exceptions."""
    raised = [one for one in vars(errors).values() if isinstance(one, type) and issubclass(one, BaseException)]
    assert all(issubclass(one, CaromError) for one in raised)
    assert all(issubclass(error, builtin) for error, builtin in BUILTINS.items())


_ONE: Any = 1
_WORD: Any = "late"

#: Calls with an argument of a wrong type, and the message.
MISTYPED: dict[str, tuple[Callable[[], Any], str]] = {
    "solve_pic": (lambda: carom.solve_pic(_ONE), "scene must be a Scene or the name of one in the catalogue, got 1"),
    "save_scene": (lambda: carom.save_scene(_WORD, "late.toml"), "scene must be a Scene, got 'late'"),
    "EventDrivenRun": (lambda: carom.EventDrivenRun(_WORD), "start must be a Scene or DiscArrays, got 'late'"),
    "replay": (lambda: carom.replay("paper/late", _ONE), "observed must be a Trace, got 1"),
    "plot_beside": (lambda: carom.plot_beside(carom.solve_pic("paper/late"), _ONE), "traces[1] must be a Trace, got 1"),
    "engines": (lambda: carom.engines("pit"), "names must be a list, even for a single item, got 'pit'"),
    "cross_check": (lambda: carom.cross_check(_ONE), "scenes must be a list, even for a single item, got int"),
    "no option": (lambda: carom.tune("pymunk", trial=3), "tune has no option 'trial'"),
    "advise": (lambda: carom.advise("paper/late", "pit"), "engines must be a list, even for a single item, got 'pit'"),
}


@each("name", MISTYPED)
def test_argument_of_a_wrong_type_is_refused_with_its_name(name: str) -> None:
    """The InputError names the argument, what it must be and the value, or the unknown option."""
    call, message = MISTYPED[name]
    with pytest.raises(InputError) as caught:
        call()
    assert caught.value.message == message


def test_unknown_profile_is_refused_with_the_known_ones() -> None:
    """`carom.run` with a profile that the engine lacks raises UnknownNameError with the existing profiles."""
    with pytest.raises(UnknownNameError, match="no requested engine has a profile 'fast'; there are: tuned"):
        carom.run("paper/late", "pit", dt=1 / 24, profile="fast")


MANY = [Problem(("discs", k), "is wrong") for k in range(25)]
TEN = "\n".join(f"discs[{k}]: is wrong" for k in range(10))


@each(
    "problems, told, text",
    [
        ([Problem((), "is wrong")], {}, "is wrong"),
        ([Problem(("discs", 3, "radius_m"), "is wrong")], {}, "discs[3].radius_m: is wrong"),
        ([Problem(("discs", 3, "position_m", 1), "is wrong")], {}, "discs[3].position_m[1]: is wrong"),
        (
            [Problem(("a",), "is wrong"), Problem(("b",), "too")],
            {"source": "x.toml"},
            "x.toml: a: is wrong\nx.toml: b: too",
        ),
        (MANY, {}, f"{TEN}\nand 15 more"),
        (MANY[:10], {"more": True}, f"{TEN}\nand more of them"),
        (MANY[:12], {"more": True}, f"{TEN}\nand at least 2 others"),
    ],
)
def test_scene_error_has_one_line_per_problem(problems: list[Problem], told: dict[str, Any], text: str) -> None:
    """Each line has the file, the path of the field and the problem; of many, ten are shown and the rest counted."""
    error = SceneError(problems, **told)
    assert str(error) == text
    assert list(error.problems) == problems


@each("kind", [CaromError, InputError, UnknownNameError, MissingExtraError, AdapterError])
def test_hints_are_an_attribute_and_part_of_the_text(kind: type[CaromError]) -> None:
    """An error's text is its message with its hints, without control characters; pickling keeps both."""
    error = kind("no engine is named 'a\x1b\u202e'", hints=["did you mean 'b'?", "there are: b, c", "see \x1b"])
    for one in (error, pickle.loads(pickle.dumps(error))):  # noqa: S301 - our own bytes
        assert type(one) is kind
        assert one.message == "no engine is named 'a\\u001b\\u202e'"
        assert one.hints == ("did you mean 'b'?", "there are: b, c", "see \\u001b")
        assert str(one) == f"{one.message}; did you mean 'b'? there are: b, c; see \\u001b"
    assert kind("plain").hints == ()
    assert str(kind("plain")) == kind("plain").message == "plain"


def test_scene_error_survives_pickling() -> None:
    r"""A pickled scene error keeps its problems, source and text, so that workers can return it.

    Control characters in the text are escaped, and `hints` has the same hint of two problems only once.
    """
    problem = Problem(("name",), "no such\x1b[31m name\u202e", ("see b",))
    error = SceneError([problem, problem._replace(field=("d",))], source="a\x07.json", more=True)
    text = "no such\\u001b[31m name\\u202e"
    assert error.message == f"a\\u0007.json: name: {text}\na\\u0007.json: d: {text}\na\\u0007.json: and more of them"
    assert error.hints == ("see b",)
    copy = pickle.loads(pickle.dumps(error))  # noqa: S301 - our own bytes
    assert type(copy) is SceneError
    assert (copy.problems, copy.source, copy.more, copy.hints) == (error.problems, error.source, True, error.hints)
    assert str(copy) == str(error)
