"""Results and journals, one value in which is of another type, or out of range: read, or refused in a sentence."""

import json
from collections.abc import Iterator
from pathlib import Path
from random import Random

from tests.attacks.guard import PIECES, spoil, try_act
from tests.in_process_pool import InProcessPool

from carom import cross_check, solve_pit
from carom.catalogue import all_scenes
from carom.execution.cache_key import build_job_key
from carom.execution.job import Answer, Job, Method, Status
from carom.execution.journal import JournalEntry
from carom.report.render.markdown import render_markdown
from carom.report.results_file.results_jsonl import format_records
from carom.studies.cross_check.options import Options
from carom.studies.cross_check.run import observed_journal
from carom.studies.diff.compare_records import compare_records
from carom.studies.diff.document import build_diff_document


def results(rng: Random, folder: Path) -> Iterator[str]:
    """`results.jsonl` with values of wrong types.

    The file is compared, or refused with a message.
    """
    scenes = [all_scenes()[name].scene for name in ("paper/missed", "paper/wrong-direction", "spin/grip")]
    sound, path = folder / "sound.jsonl", folder / "results.jsonl"
    checked = cross_check(scenes, ["pit", "pic"], profiles=["tuned"], dts=[1 / 60], timing=False, pool=InProcessPool())
    sound.write_text(format_records(checked), encoding="utf-8")
    lines = [json.loads(line) for line in sound.read_text(encoding="utf-8").splitlines()]
    while True:
        changed = [*lines]
        for _ in range(rng.choice((1, 1, 1, 3))):
            k = rng.choice((0, rng.randrange(len(lines))))
            changed[k] = spoil(rng, changed[k])
        path.write_text("".join(f"{json.dumps(line)}\n" for line in changed), encoding="utf-8")

        def compared() -> str:
            old, new = rng.sample([sound, path], 2)
            document = build_diff_document(compare_records(old, new), str(old), str(new))
            return "" if render_markdown(document) else "nothing is said"

        yield try_act(compared, "results.jsonl", "no cell was run")


def journals(rng: Random, folder: Path) -> Iterator[str]:
    """Journals with values of wrong types.

    The file is read, or refused with a message.
    """
    path, scene = folder / "journal.jsonl", all_scenes()["spin/grip"].scene
    path.unlink(missing_ok=True)
    trace, job = solve_pit(scene, frame_rate_hz=60), Job(scene, Method("pit", "tuned"), 1 / 60)
    with observed_journal(path, Options().stamp) as journal:
        journal.add([JournalEntry(build_job_key(job), Answer(Status.RAN, value=trace))])
    head, entry = (json.loads(line) for line in path.read_text(encoding="utf-8").splitlines())
    told = json.loads(entry["answer"]["value"])
    while True:
        first, second = head, entry
        if rng.random() < 0.2:
            first = spoil(rng, head) if rng.random() < 0.7 else {**head, rng.choice("ab"): rng.choice(PIECES)}
        elif rng.random() < 0.3:
            second = spoil(rng, entry)
        else:
            second = {**entry, "answer": {**entry["answer"], "value": json.dumps(spoil(rng, told))}}
        path.write_text(f"{json.dumps(first)}\n{json.dumps(second)}\n", encoding="utf-8")

        def opened() -> str:
            with observed_journal(path, Options().stamp, resume=True):
                return ""

        yield try_act(opened, "journal.jsonl")
