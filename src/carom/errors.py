"""Every error that Carom raises on purpose.

All errors have the same base class, so ``except CaromError`` catches each of them. A message states what is wrong and
where. Hints state what to do.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from carom.support.escaping import escape_controls, shorten


class CaromError(Exception):
    """Base class of all errors that Carom raises on purpose. Control characters in the text are escaped.

    The text, including the hints, is one sentence. On a terminal, each hint is on a separate line.

    Attributes:
        hints: Remedies, each a question or a phrase without a full stop.

    Examples:
        >>> try:
        ...     carom.scene("paper/lat")
        ... except carom.CaromError as error:
        ...     print(error)
        no scene is named 'paper/lat'; did you mean 'paper/late'?
    """

    def __init__(self, *args: object, hints: Sequence[str] = ()) -> None:
        super().__init__(*args)
        self.hints = tuple(escape_controls(hint) for hint in hints)

    @property
    def message(self) -> str:
        """What is wrong and where, without the hints."""
        return escape_controls(super().__str__())

    def __str__(self) -> str:
        return _with_hints(self.message, self.hints)


class InputError(CaromError, ValueError):
    """An argument is outside the range for which a function is defined."""


class UnknownNameError(CaromError, LookupError):
    """No scene, engine or profile has the requested name."""


class MissingExtraError(CaromError, ImportError):
    """A requested function needs an optional dependency that is not installed."""


class AdapterError(CaromError, RuntimeError):
    """Carom can't continue a run because of a fault of an engine or its adapter."""


class Problem(NamedTuple):
    """One problem of a scene: the path to the field, what is wrong with the field's value, and what to do."""

    field: tuple[str | int, ...]
    message: str
    hints: tuple[str, ...] = ()

    @property
    def sentence(self) -> str:
        """The path to the field, and what is wrong with the field."""
        parts = (f"[{part}]" if isinstance(part, int) else f".{escape_controls(shorten(part))}" for part in self.field)
        path = "".join(parts).lstrip(".")
        return f"{path}: {self.message}" if path else self.message

    def __str__(self) -> str:
        return _with_hints(self.sentence, self.hints)


class SceneError(InputError):
    """A scene, or the file that contains it, is not valid.

    Attributes:
        problems: All problems of the scene, or the first problem of each kind.
        source: The scene's file, if there is a file.
        more: Whether the scene has an unknown number of further problems.

    Examples:
        >>> carom.Disc(position_m=(0.0, 0.0), radius_m=-1.0)
        Traceback (most recent call last):
        carom.errors.SceneError: radius_m: must be greater than 0, got -1.0
    """

    #: Largest number of problems in a message. In a longer message, the first line would scroll out of the terminal.
    SHOWN = 10

    def __init__(self, problems: Sequence[Problem], source: str = "", *, more: bool = False) -> None:
        self.problems = tuple(problems)
        self.source = source
        self.more = more
        shown_problems = self.problems[: self.SHOWN]
        super().__init__(
            self.problems, source, hints=tuple(dict.fromkeys(hint for one in shown_problems for hint in one.hints))
        )

    @property
    def message(self) -> str:
        """One line for each of the first `SHOWN` problems. Hints are not included."""
        return self._format_lines([problem.sentence for problem in self.problems[: self.SHOWN]])

    def __str__(self) -> str:
        return self._format_lines([str(problem) for problem in self.problems[: self.SHOWN]])

    def _format_lines(self, lines: list[str]) -> str:
        hidden = len(self.problems) - self.SHOWN
        if self.more:
            lines.append(f"and at least {hidden} others" if hidden > 0 else "and more of them")
        elif hidden > 0:
            lines.append(f"and {hidden} more")
        return escape_controls("\n".join(f"{self.source}: {line}" if self.source else line for line in lines))


def _with_hints(text: str, hints: Sequence[str]) -> str:
    for hint in hints:
        text += f"{' ' if text.endswith('?') else '; '}{hint}"
    return text
