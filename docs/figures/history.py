"""`make history`: runs and compares releases of engines, and writes the page `docs/results/history.md`.

A run takes minutes, and needs the network or the releases that an earlier run downloaded. A journal per engine in
`reports/history` lets an interrupted run continue.
"""

from __future__ import annotations

import re
import sys
from dataclasses import dataclass
from pathlib import Path

from carom.catalogue import find_scenes
from carom.execution.job import UnavailableError
from carom.report.document import Document, Section
from carom.report.render.markdown import render_markdown
from carom.studies.history.compare_cells import history_journal
from carom.studies.history.document import build_history_document
from carom.studies.history.options import HistoryOptions
from carom.studies.history.release_cache import open_release_cache
from carom.studies.history.result import History
from carom.studies.history.run import run_history

ROOT = Path(__file__).resolve().parents[2]
PAGE, JOURNALS = ROOT / "docs" / "results" / "history.md", ROOT / "reports" / "history"

#: Short scenes: two discs, a box, many discs, impacts in quick succession, restitutions from 0 to 1.
SCENES = (
    "paper",
    *(
        f"classics/{name}"
        for name in ("head-on", "oblique-3-4-5", "perfectly-inelastic", "box", "bank-shot", "sorting")
    ),
    *(f"classics/{name}" for name in ("restitution-ladder", "cradle-gaps")),
)

#: The number of phases is the same as for hazards, because results at a few phases may not hold at other phases.
PHASES = 32

#: Limit of the cache in bytes: twice the total size of the releases on the page. No release is larger than 300 MB.
KEPT_BYTES = 4e9

#: A line with names and values of settings, which the page shows as code.
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
        "Version 7 changed the interface, but no result. All results are bit-identical since 6.3.0, and the results "
        "of 5.7.0 differ only by rounding. A test runs the engine without Carom's adapter, at 32 phases of a step "
        "(`tests/engines/test_engine_releases.py`). The final states of all scenes are bit-identical in 6.3.0 and "
        "7.3.1. The final states in 5.7.0 differ from the final states in 7.3.1 by at most 1e-14. Release 5.4.1 "
        "computes bounces correctly, but is not run, because it reports no contact to the adapter.",
    ),
    Entry(
        "planck",
        "1.0.5..1.5",
        "All results are bit-identical. A test runs the engine without Carom's adapter, at 32 phases of "
        "a step (`tests/engines/test_engine_releases.py`). The final states of all scenes are bit-identical "
        "in 1.0.5 and 1.5.0.",
    ),
    Entry(
        "mujoco",
        "3.0.0,3.1.0,3.2.0,3.3.0,3.5.0,3.10.0,3.17.0,4.0.0",
        "No release made the computation of MuJoCo itself worse or better. All differences beyond rounding "
        "are caused by settings. Some releases have other default limits of collision detection. Release "
        "4.0.0 added speculative contacts, which `tuned` switches on. A test runs the engine without Carom's "
        "adapter, at 32 phases of a step, with the contacts of `default` "
        "(`tests/engines/test_engine_releases.py`). The final states of all scenes are bit-identical in 3.0.0 "
        "and 3.3.0, and differ by at most 1e-13 in 4.0.0.",
    ),
    Entry(
        "rapier2d",
        ">=0.18",
        "Release 0.20.0 changed nearly all results. The default prediction distance grew from 2 mm to 20 mm, so Carom "
        "calls `default` neither better nor worse. A test runs the engine without Carom's adapter, at 32 phases of a "
        "step, with the default settings of each release (`tests/engines/test_engine_releases.py`). Before 0.20.0 "
        "slow bodies could lose a part of their speed in a bounce, and in 0.12 and 0.13 slow bodies lost even more. "
        "Since 0.20.0 slow bodies bounce correctly. Since 0.20.0 equal discs in a row exchange their velocities at "
        "each phase. Before 0.20.0, the velocities of such discs were wrong by up to 0.19 times the greatest speed, "
        "and in `cradle-gaps` by up to 0.11 times this speed. In `perfectly-inelastic` the final positions are wrong "
        "by 0.50 mm in 0.19.3, and by at most 0.03 mm since 0.20.0. In the profile `tuned` the prediction distance is "
        "0. Before 0.20.0, with `tuned` discs overlapped before their velocities changed. Since 0.20.0 some "
        "velocities change 0.9 to 1.2 steps before the discs meet, at each phase. Release 0.20.0 also reports each "
        "contact a second time in the next step, with half the impulse. Release 0.21.0 reports each contact only "
        "once, and its motion is bit-identical to the motion of 0.20.0. Carom's adapter ignores contacts of bodies "
        "that separate, so the adapter does not count an impact that the engine reports twice. Releases before 0.18 "
        "are not run, because they remove contacts before an adapter can read them.",
    ),
    Entry(
        "rapier",
        ">=0.36",
        "npm and PyPI offer two releases, whose results are bit-identical.",
    ),
    Entry(
        "dart",
        "6.16.2,6.17.1,6.18.0,6.19.0,6.19.5,6.20.0",
        "Until 6.19 the default detector replaced spheres and planes by meshes, so the normals of contacts pointed "
        "out of the plane. Since 6.20.0 the default detector uses exact spheres. A test runs the engine without "
        "Carom's adapter, at 32 phases of a step (`tests/engines/test_engine_releases.py`). The following errors are "
        "errors of final velocities, divided by the greatest speed. In `sorting` the largest error fell in 6.20.0 "
        "from 1.2 to 4.6e-5. In `cradle-gaps` the error fell in 6.20.0 from between 0.2 and 0.38 to 4e-5. In `head-on` the "
        "error grew in 6.20.0 from at most 7.3e-6 to 1.7e-5. In `box` a disc must change its velocity 13 times. In "
        "6.16.2 the disc leaves the box without a bounce, from 6.17 to 6.19 its velocity changes 22 to 30 times, and "
        "since 6.20.0 it changes 13 times. In `restitution-ladder` the velocity must change 8 times, but changes once "
        "in 6.16.2 and 8 to 10 times from 6.17 to 6.19; it changes 8 times in 6.20.0. In `bank-shot` the velocity "
        "must change 3 times, but changes only once or twice in 6.16.2; it changes 3 times in all later releases. If "
        "discs meet off centre, the sign of their position errors is different since 6.20.0. The profile `tuned` uses "
        "split impulses, which exist since 6.20.",
    ),
    Entry(
        "drake",
        "1.31.0,1.35.0,1.37.0,1.40.0,1.48.0,1.51.1",
        "With equal settings all results are bit-identical. Since 1.37 (1.36 was not run) the default contact "
        "stiffness of a body is 1e6 N/m, which changes the results of `default`. The profile `tuned` sets another "
        "stiffness. Releases before 1.31 are not run, because they crash with NumPy 2.",
    ),
    Entry(
        "pybullet",
        ">=3.2.6",
        "There is only one release to run, because release 3.2.6 was built for NumPy 1 and fails with NumPy 2.",
    ),
    Entry(
        "matter",
        "0.10.0,0.12.0,0.14.2,0.16.1,0.17.1,0.18.0,0.19.0,0.20.0",
        "The releases 0.14 and 0.19 changed results. Until 0.12 a body kept its moment of inertia when `Body.setMass` "
        "changed its mass. Since 0.14.0 the moment of inertia changes with the mass. The moment of inertia has an "
        "effect on bounces, because discs are polygons that turn. A test runs the engine without Carom's adapter, at "
        "32 phases of a step, and with the same threshold for slow bounces (`tests/engines/test_engine_releases.py`). "
        "Errors of velocities are divided by the greatest speed. From 0.12 to 0.14 the error of the final velocities "
        "falls from 0.206 to 0.109 in `sorting` and from 0.094 to 0.074 in `cradle-gaps`. The error of the final "
        "velocities grows from at most 0.083 to 0.087 in `oblique-3-4-5`, from 0.012 to at most 0.021 in "
        "`paper/late`, and from 0.038 to 0.31 in `restitution-ladder`. In `restitution-ladder` a disc must change its "
        "velocity 8 times, but changes it 6 times in 0.12, and 7 times in 0.14. In `box` the final position of a disc "
        "is wrong by 0.60 to 0.80 m until 0.12, and by 1.1 to 1.5 m since 0.14. In `perfectly-inelastic` the releases 0.12 and 0.14 find the impact at each phase. Until 0.12 the engine pushed the discs up to 0.13 m apart after the impact; "
        "since 0.14 the discs stay together. The table calls `perfectly-inelastic` worse, because its error at a "
        "speed of 2 m/s grew from rounding to 4.1e-11 m/s. Release 0.19.0 reduces the speed after a slow bounce. So "
        "in `sorting` the error of the final velocities grows in 0.19.0 to 0.238 at each phase. Release 0.13.0 is not "
        "run, because it needs a web page.",
    ),
    Entry(
        "jolt",
        "0.29.0,0.31.0,0.33.0,0.34.0,0.36.0,0.38.1,1.0.0,1.1.0",
        "All results are bit-identical, although each release is a separate build.",
    ),
    Entry(
        "havok",
        "1.3.5..1.3.14",
        "All results are bit-identical. Releases before 1.3.3 are not run, because they do not report their "
        "speed limit.",
    ),
    Entry(
        "cannon",
        "0.9.1,0.10.0,0.12.0,0.15.1,0.16.0,0.17.1,0.19.0,0.20.0",
        "All results are bit-identical. Releases before 0.9.1 are not run, because they need a package that they do "
        "not declare as a requirement.",
    ),
)

# ruff: noqa: E501 - lines of the page are as long as they are
HEAD = """# Engines over their releases

`make history` runs older releases of each engine with today's adapters. The scenes are {scenes}, each at its own frame rate, with the profiles `default` and `tuned`. A *cell* is a run of one scene with one profile.
Carom [attributes a change to the engine](../reference/diff.md#releases-of-an-engine) if both releases used equal settings and the motion differs. The motion differs if the ranges of an error over {phases} phases of a step do not overlap.
Carom only counts other changes, in the columns `phase only`, `other settings`, `other contacts` and `unobserved contacts`. The page [Regressions](../how-to/regressions.md) explains how to compare releases of your engine.
"""

THREADS = """## Bug reports that name a release

| report | content | tested? |
| --- | --- | --- |
| [rapier #973](https://github.com/dimforge/rapier/pull/973) | continuous detection was rewritten, a day before #974 | No, because no release contains this change. The results of npm's newest release, 0.21.0, are bit-identical to those of 0.20.0 |
| [rapier #974](https://github.com/dimforge/rapier/issues/974) | restitution has almost no effect in 0.35.0-beta.0 | No, because npm and PyPI list no release 0.35. The package for Rust was not tested |
| [box2d #1094](https://github.com/erincatto/box2d/pull/1094) | the solver applies restitution later, so results differ | No, because npm lists only one release of `box2d3-wasm`, 5.2.0 |
| [newton #4103](https://github.com/newton-physics/newton/pull/4103) | the solver XPBD computes restitution in a new way. Restitution is still off by default | Yes, without Carom's adapter, with a `gap` of 0 and restitution on, at 32 phases of a step (`tests/engines/bare_releases.py`). Release 1.5.2 has the old method, and 1.6.1 has the new method. In both releases the final velocities of `head-on` are right to 6e-8 of the greatest speed, and those of `oblique-3-4-5` differ between the releases by at most 3e-6. In 1.5.2 two discs with restitution 0 (`issues/newton-4103`) separate with 0.039 to 0.076 times the closing speed, as the report states. In 1.6.1 the discs stay together, with a relative speed of at most 4e-7 m/s. If one disc hits two discs that touch, the energy grows by 75 to 91 % in 1.5.2 and by 95 to 97 % in 1.6.1. A cradle of touching discs loses 42 to 66 % of its energy in 1.5.2, and 20 to 54 % in 1.6.1 (`tests/engines/test_engine_releases.py`) |
"""


def section(found: History, sentence: str) -> str:
    """Return an engine's part of the page: its summary and its tables, without the description of the machine."""
    whole = build_history_document(found)
    parts = tuple(one for one in whole.sections if one.heading in {"Releases", "Changed cells"})
    body = render_markdown(Document("x", whole.lead, tuple(Section(one.heading, one.blocks, 3) for one in parts)))
    body = _SETTINGS.sub(lambda line: f"{line[1]}`{line[2].replace(chr(92), '')}`", body)
    return f"## {found.origin.engine}\n\n{sentence}\n\n{body.partition(chr(10))[2].strip()}\n"


def main(names: list[str]) -> None:
    """Run the named engines (default: all), and write the page with their results."""
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
                found = run_history(entry.engine, scenes, kept, options, notes=notes)
        except UnavailableError as error:
            lacking.append(f"- {entry.engine}: {error}")
            continue
        parts.append(section(found, entry.sentence))
        sys.stdout.write("\n".join(build_history_document(found).lead) + f"\n{found.elapsed_s:.0f} s\n")
    missing = "## Not run here\n\n" + "\n".join(lacking) + "\n" if lacking else ""
    if names:  # The parts of engines that are not named do not change.
        there = [
            part for part in PAGE.read_text().split("\n## ")[1:] if not part.startswith(("Bug reports", "Not run"))
        ]
        named = {part.partition("\n")[0]: f"## {part}" for part in there}
        parts = [*(named | {part.partition("\n")[0].removeprefix("## "): part for part in parts}).values()]
    head = HEAD.format(phases=PHASES, scenes=", ".join(f"`{name}`" for name in SCENES))
    PAGE.write_text("\n".join([head, *(f"{part.rstrip()}\n" for part in parts), THREADS, missing]).rstrip() + "\n")


if __name__ == "__main__":
    main(sys.argv[1:])
