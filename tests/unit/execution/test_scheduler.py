"""The scheduler does not compute known results again, runs equal tasks once, and records all results."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from tests.in_process_pool import InProcessPool

from carom.execution.job import Answer, Status, Task
from carom.execution.journal import JournalEntry, MemoryJournal
from carom.execution.pool import TaskRunner
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


def test_known_and_refused_tasks_are_not_run() -> None:
    """A journaled answer is returned, a refusal is returned without journaling, and only a new task runs."""
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


def test_tasks_with_the_same_key_run_once() -> None:
    """Two requests with the same key run one task, and each gets its answer."""
    pool = Counted()
    found = list(run_tasks([TaskRequest(k, "same", Double(4)) for k in range(2)], pool, MemoryJournal[str, int]()))
    assert found == [(k, Answer(Status.RAN, value=8)) for k in range(2)]
    assert pool.messages == [1]


def test_answer_is_journaled_before_it_is_returned() -> None:
    """When the first answer is returned it is in the journal, so that it is kept if the caller stops."""
    notes = MemoryJournal[int, int]()
    for alone in (False, True):
        asks = [TaskRequest(k, (k + 10 * alone), Double(k)) for k in range(3)]
        subject, _ = next(run_tasks(asks, InProcessPool(), notes, one_at_a_time=alone))
        assert subject + 10 * alone in notes.entries


def test_dependent_tasks_give_one_journal_entry() -> None:
    """A request whose second task depends on the answer of its first gives one answer and one journal entry."""
    notes = MemoryJournal[int, int]()
    found = dict(run_tasks([TaskRequest("four", 4, Quadruple(3))], InProcessPool(), notes))
    assert found == {"four": Answer(Status.RAN, value=12)}
    assert notes.entries.keys() == {4}
