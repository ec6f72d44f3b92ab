"""`make history`: releases of engines, run and compared; writes the page `docs/results/history.md`.

It needs the registries, or what an earlier run has kept of them, and minutes. A journal an engine, in `reports/history`,
lets it go on where it was ended.
"""

from __future__ import annotations

import re
import sys
from dataclasses import dataclass
from pathlib import Path

from carom.catalogue import find_scenes
from carom.execution.job import UnavailableError
from carom.report.document import Document, Section
from carom.report.render.markdown import markdown
from carom.studies.history.compare_cells import history_journal
from carom.studies.history.document import history_document
from carom.studies.history.options import HistoryOptions
from carom.studies.history.release_cache import open_release_cache
from carom.studies.history.result import History
from carom.studies.history.run import history

ROOT = Path(__file__).resolve().parents[2]
PAGE, JOURNALS = ROOT / "docs" / "results" / "history.md", ROOT / "reports" / "history"

#: Short, and of each kind: two discs, a box, many at once, impacts in quick succession, coefficients from 0 to 1.
SCENES = (
    "paper",
    *(
        f"classics/{name}"
        for name in ("head-on", "oblique-3-4-5", "perfectly-inelastic", "box", "bank-shot", "sorting")
    ),
    *(f"classics/{name}" for name in ("restitution-ladder", "cradle-gaps")),
)

#: As many as of figures over starts: what holds at nine phases alone may not hold at the next.
PHASES = 32

#: Twice the releases of the page are kept, and no engine's is above 300 MB.
KEPT_BYTES = 4e9

#: Names of settings and their values: code, between words.
_SETTINGS = re.compile(r"^(- Different settings: [^:]*: )(.*)$", re.MULTILINE)


@dataclass(frozen=True)
class Entry:
    """An engine of the page.

    Attributes:
        engine: Name of the adapter.
        versions: Releases to run.
        sentence: Hand-written summary.
    """

    engine: str
    versions: str
    sentence: str = ""


ENTRIES = (
    Entry(
        "pymunk",
        "5.7.0,6.3.0,6.6.0,6.9.0,6.11.1,7.0.0,7.2.0,7.3.1",
        "Version 7 changed the interface and not one bit of the physics: from 6.3.0 on every cell is equal, and from 5.7.0 to "
        "6.3.0 what differs is rounding. Bare, as shipped, at 32 phases, the discs of all scenes end with the same bits in 6.3.0 and 7.3.1, and within 1e-14 of "
        "them in 5.7.0 (`tests/engines/test_engine_releases.py`). Release 5.4.1 bounces right, but reports no contact "
        "to the "
        "adapter: it is not run.",
    ),
    Entry(
        "planck",
        "1.0.5..1.5",
        "Not one bit has moved. Bare, as shipped, at 32 phases, the discs of all scenes end with the same bits in 1.0.5 and 1.5.0 "
        "(`tests/engines/test_engine_releases.py`).",
    ),
    Entry(
        "mujoco",
        "3.0.0,3.1.0,3.2.0,3.3.0,3.5.0,3.10.0,3.17.0,4.0.0",
        "Nothing here is worse or better by MuJoCo's own doing: what differs beyond rounding are settings, shipped "
        "limits of its collision detection and, from 4.0.0 on, the speculative contacts that `tuned` asks for. Bare, with the contacts of `default`, at 32 "
        "phases, the discs of all scenes end with the same bits in 3.0.0 and 3.3.0, and within 1e-13 of them in 4.0.0 (`tests/engines/test_engine_releases.py`).",
    ),
    Entry(
        "rapier2d",
        ">=0.18",
        "0.20.0 changed nearly every cell, and ships with a prediction distance of 20 mm instead of 2 mm, so `default` is called neither better nor "
        "worse. Bare, as each ships, over 32 phases: slow bounces that 0.12 and 0.13 had lost are whole again. Discs "
        "in a row exchange velocities at each phase; before, up to .19 of the fastest was wrong, and up to .11 in "
        "`cradle-gaps`. In `perfectly-inelastic` the discs end .50 mm from their places at each phase in 0.19.3, and "
        ".03 mm at most since (`tests/engines/test_engine_releases.py`). With the settings of "
        "`tuned`, by which nothing is looked for ahead, discs overlapped before they turned; since 0.20.0, at each "
        "phase, some turn .9 to 1.2 steps before they meet. It also reports each contact again in the next step, with "
        "half the impulse, until 0.21.0, whose motion is bit-identical. So a reader of contacts sees impacts twice; "
        "Carom's adapter leaves out contacts of bodies that separate. "
        "Before 0.18 its contacts are gone when an adapter can read them.",
    ),
    Entry("rapier", ">=0.36", "The registry serves two releases, which are equal to the bit."),
    Entry(
        "dart",
        "6.16.2,6.17.1,6.18.0,6.19.0,6.19.5,6.20.0",
        "6.20.0 makes spheres spheres. Until 6.19 the shipped detector took spheres and planes for meshes, so "
        "contacts lean out of the plane. Up to 1.2 of the fastest speed is wrong at the end of `sorting` (4.6e-5 "
        "since). In `box` a disc turns 22 to 30 times where 13 are right; in 6.16.2 it leaves the box without one. In "
        "`cradle-gaps` velocities end .2 to .38 off (4e-5 since), in `head-on` 7.3e-6 at most (1.7e-5 since). In "
        "`restitution-ladder` a disc turns 8 to 10 times where 8 are right (8 since), in 6.16.2 once. In `bank-shot` "
        "velocities turn 1 or 2 times there, 3 since. Bare, over 32 phases (`tests/engines/test_engine_releases.py`). "
        "Discs that meet off centre end on the other side of their "
        "right places. `tuned` asks for split impulses, which "
        "came with 6.20.",
    ),
    Entry(
        "drake",
        "1.31.0,1.35.0,1.37.0,1.40.0,1.48.0,1.51.1",
        "Not one bit has moved, but that a body is given a stiffness of its own, 1e6 N/m, from 1.37 on at the latest, which is `default`; `tuned` "
        "asks for one. Releases before 1.31 end the process with NumPy 2, and are not run.",
    ),
    Entry("pybullet", ">=3.2.6", "3.2.6 was built for NumPy 1 and fails with NumPy 2, so that there is no history."),
    Entry(
        "matter",
        "0.10.0,0.12.0,0.14.2,0.16.1,0.17.1,0.18.0,0.19.0,0.20.0",
        "Two changes. Until 0.12 `Body.setMass` left a body the moment of inertia that it was made with; from 0.14.0 on inertia follows the mass, "
        "and discs, which are polygons that turn, bounce otherwise. Bare, over 32 phases, with the same threshold set "
        "(`tests/engines/test_engine_releases.py`): velocities end nearer to the right ones in `sorting` (.109 of the "
        "fastest off, .206 before) and `cradle-gaps` (.074, .094 before). In `restitution-ladder` a disc turns 7 "
        "times, 6 before, where 8 are right, though it ends .31 of its speed off, .038 before. Velocities end farther "
        "off in `oblique-3-4-5` (.083 to .087, .082 to .083 before) and `paper/late` (.019 to .021, .012 before). In "
        "`box` a disc ends 1.1 to 1.5 m from its place, .60 to .80 m before. In `perfectly-inelastic` the discs begin "
        "to touch once at each phase in both. Until 0.12 they were then pushed up to .13 m apart, and since they stay "
        "together. What the table calls worse is an error of 4.1e-11 m/s in 2 m/s; before it was rounding. "
        "Release 0.19.0 takes part of a slow bounce away: in `sorting` the last of five discs end .238 of the fastest "
        "speed off at each phase. 0.13.0 needs a "
        "page and does not run.",
    ),
    Entry(
        "jolt",
        "0.29.0,0.31.0,0.33.0,0.34.0,0.36.0,0.38.1,1.0.0,1.1.0",
        "Not one bit has moved, though each release is another build.",
    ),
    Entry(
        "havok",
        "1.3.5..1.3.14",
        "Not one bit has moved. Releases before 1.3.3 do not tell their limit of speed, and are not run.",
    ),
    Entry(
        "cannon",
        "0.9.1,0.10.0,0.12.0,0.15.1,0.16.0,0.17.1,0.19.0,0.20.0",
        "Not one bit has moved. Releases before 0.9.1 need a package that they do not name, and do not load.",
    ),
)

# ruff: noqa: E501 - lines of the page are as long as they are
HEAD = """# Engines over their releases

`make history` runs releases from the engines' registries with today's adapters. The scenes are {scenes}, each at its own frame rate, with the profiles `default` and `tuned`.
[A change counts](../reference/diff.md#releases-of-an-engine) as the engine's if the settings read back are equal and the motion differs over {phases} phases of the step.
`phase only`, `other settings`, `other contacts` and `not judged` are counted only. [Regressions](../how-to/regressions.md) does the same for your engine.
"""

THREADS = """## Threads that name a release

| thread | what it says | tried |
| --- | --- | --- |
| [rapier #973](https://github.com/dimforge/rapier/pull/973) | continuous detection reworked, a day before #974 | no: of the same line of releases; npm's newest, 0.21.0, moves as 0.20.0 does, to the bit |
| [rapier #974](https://github.com/dimforge/rapier/issues/974) | restitution has almost no effect in 0.35.0-beta.0 | no: npm and PyPI list no release of 0.35; the crate was not built |
| [box2d #1094](https://github.com/erincatto/box2d/pull/1094) | restitution is deferred into the solver and behaves otherwise | no: npm lists one release of `box2d3-wasm`, 5.2.0, so there is nothing to compare it with |
| [newton #4103](https://github.com/newton-physics/newton/pull/4103) | a new solution of its XPBD solver's restitution, still off by default | yes: bare, with a `gap` of 0 and restitution on, over 32 phases (`tests/engines/bare_releases.py`). 1.5.2 has the old kernel, 1.6.1 the new. In both, `head-on` ends with the right velocities to 6e-8 of the fastest, and `oblique-3-4-5` ends alike to 3e-6. As the thread says, two discs that meet with restitution 0 (`issues/newton-4103`) rebound in 1.5.2, with .039 to .076 of the speed of closing, and go on together in 1.6.1, to 4e-7 m/s. One disc into two that touch gains .75 to .91 of the energy in 1.5.2, .95 to .97 since. A cradle that touches loses .42 to .66, .20 to .54 since (`tests/engines/test_engine_releases.py`). Both leave restitution off by default |
"""


def section(found: History, sentence: str) -> str:
    """Return an engine's part of the page: its sentence and its tables, without the machine."""
    whole = history_document(found)
    parts = tuple(one for one in whole.sections if one.heading in {"Releases", "Changed cells"})
    body = markdown(Document("x", whole.answer, tuple(Section(one.heading, one.blocks, 3) for one in parts)))
    body = _SETTINGS.sub(lambda line: f"{line[1]}`{line[2].replace(chr(92), '')}`", body)
    return f"## {found.origin.engine}\n\n{sentence}\n\n{body.partition(chr(10))[2].strip()}\n"


def main(names: list[str]) -> None:
    """Run what is asked for, all by default, and write the page of all that came of it."""
    scenes = [entry.scene for entry in find_scenes(SCENES)]
    parts, lacking = [], []
    for entry in ENTRIES:
        if names and entry.engine not in names:
            continue
        folder = JOURNALS / entry.engine
        folder.mkdir(parents=True, exist_ok=True)
        options = HistoryOptions(versions=[entry.versions], most=8, jobs=1, phases=PHASES)
        try:
            with (
                open_release_cache(KEPT_BYTES) as kept,
                history_journal(folder / "journal.jsonl", resume=True) as notes,
            ):
                found = history(entry.engine, scenes, kept, options, notes=notes)
        except UnavailableError as error:
            lacking.append(f"- {entry.engine}: {error}")
            continue
        parts.append(section(found, entry.sentence))
        sys.stdout.write("\n".join(history_document(found).lead) + f"\n{found.elapsed_s:.0f} s\n")
    missing = "## Not run here\n\n" + "\n".join(lacking) + "\n" if lacking else ""
    if names:  # the others' parts stay as they are
        there = [part for part in PAGE.read_text().split("\n## ")[1:] if not part.startswith(("Threads", "Not run"))]
        named = {part.partition("\n")[0]: f"## {part}" for part in there}
        parts = [*(named | {part.partition("\n")[0].removeprefix("## "): part for part in parts}).values()]
    head = HEAD.format(phases=PHASES, scenes=", ".join(f"`{name}`" for name in SCENES))
    PAGE.write_text("\n".join([head, *(f"{part.rstrip()}\n" for part in parts), THREADS, missing]).rstrip() + "\n")


if __name__ == "__main__":
    main(sys.argv[1:])
