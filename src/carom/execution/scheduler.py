"""The desk: where every study asks what it wants to know of engines, and has it written down as it is answered.

What a journal knows already is not asked again, what is refused is not sent, and the rest goes to a pool, whose
processes have the limits that were asked for. A study says what it asks, and makes its result of the answers.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from carom.execution.job import Answer, Task
from carom.execution.journal import Entry, Notes
from carom.execution.pool import Asker, Pool

#: A message holds as many questions as take this many steps together, a second or so: then what a message costs is
#: nothing, and what is lost with one is little. So many questions at most, that workers have equal shares to the end.
BATCH_STEPS = 50_000
BATCH_QUESTIONS = 16

S = TypeVar("S")
K = TypeVar("K")
T = TypeVar("T")


class Talk(ABC, Generic[T]):
    """A question that takes several tasks, of which the later ones depend on what came of the earlier."""

    @property
    @abstractmethod
    def engine(self) -> str:
        """Name of the adapter that is asked first."""

    @abstractmethod
    def answer(self, asker: Asker) -> Answer[T]:
        """Ask, and return what came of it all."""


#: What can be asked, and what travels together with the keys of its answers.
Question = Task[T] | Talk[T]
Message = list[tuple[K, Question[T]]]


@dataclass(frozen=True)
class Ask(Generic[S, K, T]):
    """What a study asks.

    Attributes:
        subject: What the study knows it by; it stays with the study.
        key: What tells it from all others that the journal may hold; its entry has the same.
        question: What is to be carried out.
        refused: Why it can't be carried out, as far as that is known; then it is not sent, nor written down.
        steps: Engine steps that it takes: questions of few steps share a message, others have one of their own.
    """

    subject: S
    key: K
    question: Question[T]
    refused: Answer[Any] | None = None
    steps: float = math.inf


def answers(
    asks: Iterable[Ask[S, K, T]], pool: Pool, notes: Notes[K, T], *, alone: bool = False
) -> Iterator[tuple[S, Answer[T]]]:
    """Yield the answer to each ask, with its subject: first what is known or refused, then the others as they come.

    Args:
        asks: What is asked; asks of one key are carried out once.
        pool: Where; it stays open.
        notes: What is known, and where more of it is written before it is yielded: a journal, or what lasts no longer
            than this process.
        alone: Whether one is carried out at a time, with nothing else running.
    """
    todo: dict[K, list[Ask[S, K, T]]] = {}
    for ask in asks:
        if (known := notes.entries.get(ask.key)) is not None:
            yield ask.subject, known.answer
        elif ask.refused is not None:
            yield ask.subject, ask.refused
        else:
            todo.setdefault(ask.key, []).append(ask)
    messages = batches((key, several[0].question, several[0].steps) for key, several in todo.items())
    found: Iterator[list[Entry[K, T]]]
    if alone:
        found = ([entry] for _, message in messages for entry in _carried_out(message, pool))
    else:
        found = pool.each(messages, _carried_out)
    for entries in found:
        notes.add(entries)
        for entry in entries:
            for ask in todo[entry.key]:
                yield ask.subject, entry.answer


def batches(asked: Iterable[tuple[K, Question[T], float]]) -> list[tuple[str, Message[K, T]]]:
    """Return questions, with their keys and steps, in messages, with the engine of each; an engine's stay in order."""
    messages: list[tuple[str, Message[K, T]]] = []
    taken = 0.0
    for key, question, steps in sorted(asked, key=lambda one: one[1].engine):
        full = not messages or taken + steps > BATCH_STEPS or len(messages[-1][1]) >= BATCH_QUESTIONS
        if full or messages[-1][0] != question.engine:
            messages.append((question.engine, []))
            taken = 0.0
        messages[-1][1].append((key, question))
        taken += steps
    return messages


def _carried_out(message: Message[K, T], asker: Asker) -> Iterator[Entry[K, T]]:
    """Have the questions of one message carried out."""
    tasks = [question for _, question in message if not isinstance(question, Talk)]
    talks = [question for _, question in message if isinstance(question, Talk)]  # a message of its own each
    told = [talk.answer(asker) for talk in talks] if talks else asker.ask_each(tasks)
    for (key, _), answer in zip(message, told, strict=True):
        yield Entry(key, answer)
