"""The desk: what is known or refused is not sent, what is asked twice is carried out once, and all is written down."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from carom.execution.job import Answer, Status, Task
from carom.execution.journal import JournalEntry, MemoryJournal
from carom.execution.pool import InProcessPool, TaskRunner
from carom.execution.scheduler import DependentTasks, TaskRequest, run_tasks


@dataclass(frozen=True)
class Double:
    """Twice a number."""

    number: int
    engine: str = "pit"

    def carry_out(self) -> int:
        return 2 * self.number


@dataclass(frozen=True)
class Quadruple(DependentTasks[int]):
    """Twice the answer for twice a number: the second task depends on the first answer."""

    number: int

    @property
    def engine(self) -> str:
        return "pit"

    def run(self, runner: TaskRunner) -> Answer[int]:
        half = runner.run(Double(self.number)).value
        assert half is not None
        return runner.run(Double(half))


class Counted(InProcessPool):
    """Notes how many tasks there were in each message."""

    def __init__(self) -> None:
        self.messages: list[int] = []

    def run_each(self, tasks: Sequence[Task[Any]]) -> Iterator[Answer[Any]]:
        self.messages.append(len(tasks))
        return super().run_each(tasks)


def test_what_is_known_or_refused_is_not_sent() -> None:
    """An answer in the notes is returned as it is; a refusal is not written; other tasks run and are kept."""
    pool, notes = Counted(), MemoryJournal[str, int]()
    notes.add([JournalEntry("known", Answer(Status.RAN, value=-1))])
    no = Answer[int](Status.UNSUPPORTED, "no")
    asks = [
        TaskRequest(1, "known", Double(1), no),
        TaskRequest(2, "refused", Double(2), no),
        TaskRequest(3, "new", Double(3)),
    ]
    found = dict(run_tasks(asks, pool, notes))
    assert found == {1: Answer(Status.RAN, value=-1), 2: no, 3: Answer(Status.RAN, value=6)}
    assert notes.entries.keys() == {"known", "new"}
    assert pool.messages == [1]


def test_what_is_asked_twice_is_carried_out_once() -> None:
    """Two asks of one key are one question, and each has its answer."""
    pool = Counted()
    found = list(run_tasks([TaskRequest(k, "same", Double(4)) for k in range(2)], pool, MemoryJournal[str, int]()))
    assert found == [(k, Answer(Status.RAN, value=8)) for k in range(2)]
    assert pool.messages == [1]


def test_an_answer_is_written_down_before_it_is_told() -> None:
    """If the caller stops after an answer, that one is in the notes."""
    notes = MemoryJournal[int, int]()
    for alone in (False, True):
        told = run_tasks(
            [TaskRequest(k, (k + 10 * alone), Double(k)) for k in range(3)], InProcessPool(), notes, alone=alone
        )
        subject, _ = next(told)
        assert subject + 10 * alone in notes.entries


def test_questions_of_few_steps_share_a_message() -> None:
    """Those of one engine whose steps are few go together; one of unknown length, or of another engine, does not."""
    pool = Counted()
    asks = [TaskRequest(k, k, Double(k), steps=1.0) for k in range(5)]
    asks += [TaskRequest(5, 5, Double(5)), TaskRequest(6, 6, Double(6, "pic"), steps=1.0)]
    assert len(dict(run_tasks(asks, pool, MemoryJournal[int, int]()))) == 7
    assert sorted(pool.messages) == [1, 1, 5]


def test_a_question_may_take_several_tasks() -> None:
    """A talk asks on, and its answer is one entry."""
    notes = MemoryJournal[int, int]()
    assert dict(run_tasks([TaskRequest("four", 4, Quadruple(3))], InProcessPool(), notes)) == {
        "four": Answer(Status.RAN, value=12)
    }
    assert notes.entries.keys() == {4}
