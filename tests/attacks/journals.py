"""Journals, cut at every byte and filled with garbage: no whole line is lost, and nothing else is taken for one."""

import json
from collections.abc import Iterator
from pathlib import Path
from random import Random

from tests.attacks.guard import try_act
from tests.in_process_pool import InProcessPool
from tests.journal_lines import read_canonical_lines

from carom.catalogue import find_scenes
from carom.errors import InputError
from carom.execution.score_jobs import score_journal
from carom.studies.bench.options import BenchPlan, ErrorKind
from carom.studies.bench.run import measure_work_precision

GARBAGE = [
    *(b"\0" * 100, b"{", b"[" * 10**5, b'{"key":' * 10**4, b"null", b'""'),
    *(b"\xff\xfe", b"\n\n", b"\r", b"{}", b"1e999", b"\x1b[31m"),
]


def _make_journal(folder: Path) -> bytes:
    """Return a journal of a bench of a few steps."""
    path = folder / "made.jsonl"
    if not path.exists():
        scene = find_scenes(["paper/late"])[0].scene
        plan = BenchPlan(engines=("pit",), dts=(0.1, 0.05), phases=2, error=ErrorKind.IMPACT, timing=False)
        with score_journal(path) as journal:
            measure_work_precision([scene], plan, InProcessPool(), notes=journal)
    return path.read_bytes()


def _read_entries(path: Path) -> list[str]:
    with score_journal(path, resume=True) as journal:
        return [repr(entry) for entry in journal.entries.values()]


def attack_by_cuts(rng: Random, folder: Path) -> Iterator[str]:
    """Journals cut at any byte.

    Every complete line is read, and the incomplete one is dropped.
    """
    whole, path = _make_journal(folder), folder / "cut.jsonl"
    path.write_bytes(whole)
    every = _read_entries(path)
    while True:
        sizes = [*range(len(whole) + 1)]
        rng.shuffle(sizes)
        for size in sizes:
            path.write_bytes(whole[:size])
            expected = every[: max(0, whole[:size].count(b"\n") - 1)]
            try:
                found = _read_entries(path)
                kept = whole[: whole[:size].rfind(b"\n") + 1]
                held = found == expected and (not expected or path.read_bytes() == kept)
            except InputError as error:
                held, found = False, [str(error)]
            yield "" if held else f"cut at byte {size}: {len(found)} of {len(expected)} entries: {found[:1]}"


def attack_by_garbage(rng: Random, folder: Path) -> Iterator[str]:
    """Journals with random bytes.

    The journal is read, or refused with a message and not changed.
    """
    whole, path = _make_journal(folder), folder / "garbage.jsonl"
    path.write_bytes(whole)
    every = _read_entries(path)
    while True:
        lines = whole.splitlines(keepends=True)
        for _ in range(rng.choice((1, 1, 2))):
            at, piece = rng.randrange(len(lines) + 1), rng.choice(GARBAGE)
            if rng.random() < 0.5:
                lines.insert(at, piece + rng.choice((b"", b"\n")))
            elif at < len(lines):
                inside = rng.randrange(len(lines[at]))
                lines[at] = lines[at][:inside] + piece + lines[at][inside:]
        data = b"".join(lines)
        path.write_bytes(data)

        def read(data: bytes = data) -> str:
            try:
                found = _read_entries(path)
            except InputError:
                if path.read_bytes() != data:
                    return "refused, but touched"
                raise
            return "" if set(found) <= set(every) or _is_all_json(path) else f"entries that nobody wrote: {found}"

        yield try_act(read, "")


def _is_all_json(path: Path) -> bool:
    """Whether garbage has made other lines, which are sound."""
    return all(isinstance(json.loads(line), dict) for line in read_canonical_lines(path))
