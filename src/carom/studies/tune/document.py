"""The report of a search for settings: what was found, its evidence beside the first profile, and what to paste."""

from __future__ import annotations

import math
import shlex
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import tomli_w

from carom.folders import write_files
from carom.pages import wording
from carom.pages.document import Cell, Code, Column, Document, Headline, Lines, Section, Table, Text
from carom.pages.grid import mark_of_grade
from carom.pages.made import making
from carom.pages.render.markdown import markdown
from carom.registry import asked_as
from carom.runs.job import Method
from carom.studies.tune.merit import Judged
from carom.studies.tune.run import PURPOSE, Tuning
from carom.studies.tune.search import Found
from carom.trace import Setting, setting_text

__all__ = ["set_words", "tune_document", "write_tune"]

ERROR_NOTE = (
    "Error: the largest velocity or spin error over PIT's at worst over the phases of the same step: 1 is what looking "
    "once a step costs, 0 is rounding."
)
#: What the profile to paste is called.
FOUND = "found"


class _Line(NamedTuple):
    """A scene with the first profile and with the best settings."""

    scene: str
    first: Judged
    best: Judged


def tune_document(found: Tuning, asked: Sequence[str]) -> Document:
    """Return the report of a search; `asked` is how its scenes were asked for, as words of a command."""
    better = found.best is not found.first
    lines = [
        _Line(scene.name, *both)
        for scene, *both in zip(found.scenes, found.first.judged, found.best.judged, strict=True)
    ]
    own = found.options.profile
    columns = (
        Column("scene", lambda line: line.scene),
        Column(own, lambda line: _graded(line.first)),
        Column("error", lambda line: _error(line.first), number=True),
        Column(FOUND, lambda line: _graded(line.best)),
        Column("error", lambda line: _error(line.best), number=True),
    )
    shown = columns if better else columns[:3]
    left_out = tuple(f"{name} is left out: {reason}" for name, reason in found.left_out.items())
    return Document(
        f"Carom: settings of {found.engine}",
        Headline.of(_lead(found)),
        (
            *((_settings(found),) if better else ()),
            Section("Scene by scene", (Table(shown, lines), Text(ERROR_NOTE), Lines(left_out))),
            *(_paste(found, asked) if better else ()),
            *making(found.environment, found.command, found.elapsed_s),
        ),
    )


def write_tune(found: Tuning, asked: Sequence[str], folder: Path) -> Path:
    """Write ``tune.md`` into a folder and return its path; `asked` as of `tune_document`.

    Raises:
        InputError: The folder holds files of others.
        OSError: It can't be written.
    """
    return write_files(folder, PURPOSE, {"tune.md": markdown(tune_document(found, asked))})


def set_words(found: Found) -> str:
    """Return the options by which `carom run` tries some settings."""
    return shlex.join([word for name, value in found.tried for word in ("--set", f"{name}={setting_text(value)}")])


def _lead(found: Tuning) -> Iterator[str]:
    scenes = wording.count(len(found.scenes), "scene")
    early = f", {found.given_up} of them given up early" if found.given_up else ""
    tried = f"{wording.count(found.trials, 'setting', 'different settings')} tried{early}"
    if found.best is found.first:
        yield f"Nothing better than {found.options.profile} was found on {scenes}: {tried}."
        yield f"With {found.options.profile}: {_tally(found.first)}."
        return
    yield f"Found in trial {found.best.trial}: {_tally(found.best)}; {found.options.profile} has {_tally(found.first)}."
    yield f"Of {scenes}, each at {_steps(found)}; {tried}."
    if not math.isnan(found.time_ratio):
        cost = wording.number(found.time_ratio)
        yield f"Its steps take {cost} times as long as those of {found.options.profile}, the median over scenes."
    yield "Found on these scenes, at these steps: of others it says nothing."


def _tally(found: Found) -> str:
    grades = Counter(map(_word, found.judged))
    return ", ".join(f"{count} {name}" for name, count in grades.most_common())


def _steps(found: Tuning) -> str:
    dt_s = found.options.dt_s
    return "its own frame rate" if dt_s is None else wording.step(dt_s)


def _word(judged: Judged) -> str:
    return "not run" if judged.grade is None else mark_of_grade(judged.grade, judged.float_bits).word


def _graded(judged: Judged) -> Cell:
    if judged.grade is None:
        return Cell(_word(judged), judged.reason)
    return Cell(f"{_word(judged)} {wording.lost(judged.missed, judged.spurious)}".rstrip())


def _error(judged: Judged) -> str:
    return wording.ABSENT if math.isnan(judged.price) else wording.number(judged.price)


def _settings(found: Tuning) -> Section:
    columns = (
        Column("setting", lambda item: item[0]),
        Column("found", lambda item: setting_text(item[1]), number=True),
        Column(found.options.profile, lambda item: _before(found, item[0]), number=True),
        Column("tried from, to", lambda item: _range(found.space.values[item[0]])),
    )
    note = "Each was turned back, with the others as they are: without any of them it is worse."
    return Section("Settings found", (Table(columns, found.best.tried), Text(note)))


def _before(found: Tuning, name: str) -> str:
    return setting_text(found.own[name]) if name in found.own else "as shipped"


def _range(values: Sequence[Setting]) -> str:
    first, last = setting_text(values[0]), setting_text(values[-1])
    return f"{first}, {last}"


def _paste(found: Tuning, asked: Sequence[str]) -> Iterator[Section]:
    """Yield the command that tries the settings, and the profile in Python and in a manifest."""
    step = () if found.options.dt_s is None else ("--dt", repr(found.options.dt_s))
    words = ("carom", "run", *asked, "-e", asked_as(found.engine), "-p", found.options.profile, *step)
    yield Section("To run it", (Code(f"{shlex.join(words)} {set_words(found.best)}"),))
    method = Method(found.engine, found.options.profile, found.best.tried)
    said = f"Found by carom tune on {wording.count(len(found.scenes), 'scene')}: {_tally(found.best)}."
    constant = {name: value for name, value in found.settings.items() if name not in found.varying}
    varying = [f"# {name} varies with the step: as in {method.profile}" for name in sorted(found.varying)]
    python = "\n".join(
        [
            f'"{FOUND}": Profile(',
            f"    {said!r},",
            "    lambda dt_s: {",
            '        "dt_s": dt_s,',
            *(f"        {name!r}: {value!r}," for name, value in constant.items()),
            *(f"        {line}" for line in varying),
            "    },",
            "),",
        ]
    )
    toml = tomli_w.dumps({"profiles": {FOUND: {"description": said, "settings": constant}}})
    yield Section("To paste, in Python", (Code(python),))
    yield Section("To paste, in engine.toml", (Code("\n".join([toml.rstrip("\n"), *varying])),))
