"""The scheduler runs equal tasks once."""

from dataclasses import dataclass, field

from tests.in_process_pool import InProcessPool

from carom.execution.job import Answer, Status
from carom.execution.scheduler import TaskRequest, run_tasks


@dataclass(frozen=True)
class Counted:
    """A task that counts how often it is carried out."""

    runs: list[str] = field(default_factory=list)
    engine: str = "pit"

    def carry_out(self) -> int:
        self.runs.append("run")
        return len(self.runs)


def test_tasks_with_the_same_key_run_once() -> None:
    """Two requests with the same key run one task, and each gets its answer."""
    task = Counted()
    found = list(run_tasks([TaskRequest(k, "same", task) for k in range(2)], InProcessPool()))
    assert found == [(k, Answer(Status.RAN, value=1)) for k in range(2)]
