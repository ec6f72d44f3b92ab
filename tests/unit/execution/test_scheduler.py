"""The desk: what is known or refused is not sent, what is asked twice is carried out once, and all is written down."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from carom.execution.job import Answer, Status, Task
from carom.execution.journal import Entry, Notes
from carom.execution.pool import Asker, InProcess
from carom.execution.scheduler import Ask, Talk, answers


@dataclass(frozen=True)
class Double:
    """Twice a number."""

    number: int
    engine: str = "pit"

    def carry_out(self) -> int:
        return 2 * self.number


@dataclass(frozen=True)
class Quadruple(Talk[int]):
    """Twice what twice a number was told to be: the second question depends on the first answer."""

    number: int

    @property
    def engine(self) -> str:
        return "pit"

    def answer(self, asker: Asker) -> Answer[int]:
        half = asker.ask(Double(self.number)).value
        assert half is not None
        return asker.ask(Double(half))


class Counted(InProcess):
    """Notes how many tasks there were in each message."""

    def __init__(self) -> None:
        self.messages: list[int] = []

    def ask_each(self, tasks: Sequence[Task[Any]]) -> Iterator[Answer[Any]]:
        self.messages.append(len(tasks))
        return super().ask_each(tasks)


def test_what_is_known_or_refused_is_not_sent() -> None:
    """An answer in the notes is taken as it is; a refusal is told and not written; all else is carried out and kept."""
    pool, notes = Counted(), Notes[str, int]()
    notes.add([Entry("known", Answer(Status.RAN, value=-1))])
    no = Answer[int](Status.UNSUPPORTED, "no")
    asks = [Ask(1, "known", Double(1), no), Ask(2, "refused", Double(2), no), Ask(3, "new", Double(3))]
    found = dict(answers(asks, pool, notes))
    assert found == {1: Answer(Status.RAN, value=-1), 2: no, 3: Answer(Status.RAN, value=6)}
    assert notes.entries.keys() == {"known", "new"}
    assert pool.messages == [1]


def test_what_is_asked_twice_is_carried_out_once() -> None:
    """Two asks of one key are one question, and each has its answer."""
    pool = Counted()
    found = list(answers([Ask(k, "same", Double(4)) for k in range(2)], pool, Notes[str, int]()))
    assert found == [(k, Answer(Status.RAN, value=8)) for k in range(2)]
    assert pool.messages == [1]


def test_an_answer_is_written_down_before_it_is_told() -> None:
    """Whoever stops listening after an answer has that one in the notes."""
    notes = Notes[int, int]()
    for alone in (False, True):
        told = answers([Ask(k, (k + 10 * alone), Double(k)) for k in range(3)], InProcess(), notes, alone=alone)
        subject, _ = next(told)
        assert subject + 10 * alone in notes.entries


def test_questions_of_few_steps_share_a_message() -> None:
    """Those of one engine whose steps are few go together; one of unknown length, or of another engine, does not."""
    pool = Counted()
    asks = [Ask(k, k, Double(k), steps=1.0) for k in range(5)]
    asks += [Ask(5, 5, Double(5)), Ask(6, 6, Double(6, "pic"), steps=1.0)]
    assert len(dict(answers(asks, pool, Notes[int, int]()))) == 7
    assert sorted(pool.messages) == [1, 1, 5]


def test_a_question_may_take_several_tasks() -> None:
    """A talk asks on, and its answer is one entry."""
    notes = Notes[int, int]()
    assert dict(answers([Ask("four", 4, Quadruple(3))], InProcess(), notes)) == {"four": Answer(Status.RAN, value=12)}
    assert notes.entries.keys() == {4}
