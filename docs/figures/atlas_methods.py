"""Methods (engines with profiles) of the tables, the cells of a method's row, and needs of users."""

from __future__ import annotations

import json
import math
import statistics
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from carom.catalogue import all_scenes
from carom.model.trace import format_profile
from carom.report.formatting import format_number, format_percent

#: Grades from best to worst.
GRADES = ("exact", "close", "sampled", "inaccurate", "diverged", "diverged inaccurate", "wrong")
#: Carom's own methods. Engines are compared with these methods, and users do not choose them.
OWN = ("pic", "pit")
#: Profiles that a program cannot copy, because Carom cuts their steps.
CUT = ("located",)
#: Profiles that give a disc another shape. Their results do not apply to programs with spheres.
RESHAPED = ("cylinder", "cylinder-plain")
#: Stress tests that the atlas shows, with the headings of their columns.
ATTACKS = {
    "tunnelling": "speed x dt / radius from which discs are missed",
    "slow": "slow impacts do not bounce below, m/s",
    "mass-ratio": "mass ratio",
    "grazing": "grazes are missed from 1 - offset / contact distance",
    "duration": "number of impacts before errors grow too large",
}
RIGHT_ANGLE = math.degrees(1.0)
#: A scene that is chaotic within the run. Each phase gives another figure, so tables show the range over many phases.
CHAOTIC = "engines/gas-of-25"

Row = dict[str, Any]


@dataclass(frozen=True)
class Method:
    """An engine with a profile, and its rows.

    Attributes:
        engine: Name of the adapter.
        profile: Name of the profile.
        rows: All rows of the method.
        ratio: Run time divided by PIT's at the same step, median over the timed scenes; None without timed scenes.
        gas: Figures over many phases of the scene `CHAOTIC`; None if not measured.
    """

    engine: str
    profile: str
    rows: tuple[Row, ...]
    ratio: float | None
    gas: Row | None = None

    @property
    def name(self) -> str:
        """The displayed name."""
        return f"{self.engine} {format_profile(self.engine, self.profile, {})}".rstrip()

    @property
    def coarse(self) -> list[Row]:
        """Rows at each scene's own frame rate."""
        return [row for row in self.rows if row["refinement"] == 0]


@dataclass(frozen=True)
class Need:
    """A need of a user.

    Attributes:
        what: The need, in the user's words.
        scenes: Function that returns whether the scene with a given name tests the need.
        met: Function that returns whether a row meets the need.
    """

    what: str
    scenes: Callable[[str], bool]
    met: Callable[[Row], bool]


def _of(*names: str) -> Callable[[str], bool]:
    return lambda scene: scene.startswith(names)


def _fast(scene: str) -> bool:
    return "fast" in all_scenes()[scene].tags and "no-impact" not in all_scenes()[scene].tags


def _whole(row: Row) -> bool:
    return not row["missed"] and not row["spurious"]


def _within(kind: str, limit: float) -> Callable[[Row], bool]:
    return lambda row: _whole(row) and row["total"][kind] is not None and abs(row["total"][kind]) <= limit


NEEDS = (
    Need(
        "times and velocities correct except for rounding",
        _of("paper", "classics"),
        lambda row: row["grade"] == "exact",
    ),
    Need(
        "direction errors of at most one degree", _of("paper", "classics"), _within("direction_rad", math.radians(1.0))
    ),
    Need("no fast disc passes through another", _fast, _whole),
    Need(
        "slow impacts bounce, with errors of at most 1 % of the speed",
        _of("engines/slow", "engines/crawl"),
        _within("velocity", 0.01),
    ),
    Need("no impact is invented", _of("classics/miss", "engines/near-miss"), _whole),
    Need(
        "energy error of many discs at most one in a million",
        _of("classics/gas", "engines/gas-of-25"),
        lambda row: _kept(row, 1e-6),
    ),
    Need("balls that fall and bounce", _of("gravity"), lambda row: row["grade"] in {"exact", "close", "sampled"}),
)


def _kept(row: Row, limit: float) -> bool:
    return row["total"] is not None and row["total"]["energy"] is not None and abs(row["total"]["energy"]) <= limit


def methods_of(rows: Sequence[Row], timed: Sequence[Row], hazards: Sequence[Row] = ()) -> list[Method]:
    """Return all methods, including Carom's own methods, in the order of the rows."""
    gas = {(row["engine"], row["profile"]): row for row in hazards if row["table"] == "gas" and "refused" not in row}
    own: dict[tuple[str, str], list[Row]] = {}
    ratios: dict[tuple[str, str], list[float]] = {}
    for row in rows:
        own.setdefault((row["engine"], row["profile"]), []).append(row)
    for row in timed:
        if row["time_ratio"] is not None:
            ratios.setdefault((row["engine"], row["profile"]), []).append(row["time_ratio"])
    return [
        Method(*name, tuple(of), statistics.median(ratios[name]) if name in ratios else None, gas.get(name))
        for name, of in own.items()
    ]


def numbers(rows: Sequence[Row], value: Callable[[Row], float | None]) -> list[float]:
    """Return a number of each row in which every impact was found.

    Nulls (infinite or undefined numbers) are left out.
    """
    said = (value(row) for row in rows if row["total"] is not None)
    return [one for one in said if one is not None]


def spread(values: Sequence[float], say: Callable[[float], str] = format_number) -> str:
    """Return the median and the largest value."""
    return f"{say(statistics.median(values))}, at most {say(max(values))}" if values else "-"


def grades(method: Method) -> str:
    """Return the number of scenes with each grade, at each scene's own frame rate."""
    tally = Counter(row["grade"] if row["status"] == "ran" else row["status"] for row in method.coarse)
    named = {grade: grade.replace(" ", "_") for grade in GRADES}
    known = [f"{tally.pop(name)} {grade}" for grade, name in named.items() if tally[name]]
    return ", ".join(known + [f"{n} {word.replace('_', ' ')}" for word, n in tally.items() if n])


def total(kind: str, over: Callable[[Row], float] = lambda _: 1.0) -> Callable[[Row], float | None]:
    """Return the function from a row to the magnitude of one of its largest errors."""

    def value(row: Row) -> float | None:
        said = row["total"][kind]
        return None if said is None else abs(said) / over(row)

    return value


def _conserves(row: Row) -> bool:
    scene = all_scenes()[row["scene"]].scene
    return not any(scene.gravity_m_s2) and scene.restitution == 1.0 == scene.wall_restitution


def energy(method: Method) -> str:
    """Return the largest energy loss and gain, as fractions, in scenes that conserve energy and are not chaotic."""
    kept = [row for row in method.coarse if _conserves(row) and row["scene"] != CHAOTIC]
    change = numbers(kept, lambda row: row["total"]["energy"])
    lost, gained = -min(change, default=0.0), max(change, default=0.0)
    return f"{format_percent(max(lost, 0.0))} lost, {format_percent(max(gained, 0.0))} made" if change else "-"


def gas(method: Method) -> str:
    """Return the range of the relative energy change of a gas over many phases."""
    if method.gas is None:
        return "-"
    return (
        f"{format_percent(method.gas['least'])} to {format_percent(method.gas['most'])} at {method.gas['starts']} "
        "phases"
    )


def impacts(method: Method) -> str:
    """Return the numbers of missed and invented impacts."""
    scored = [row for row in method.coarse if row["missed"] is not None]
    return f"{sum(len(row['missed']) for row in scored)} / {sum(len(row['spurious']) for row in scored)}"


def speed(method: Method) -> str:
    """Return the run time divided by PIT's."""
    return "-" if method.ratio is None else f"{format_number(method.ratio)} x"


def breaking(stress: dict[str, Any], attack: str, method: Method) -> str:
    """Return the size at which a method fails a stress test of the campaign."""
    lines = {line["name"]: line for line in stress["lines"]}
    columns = [(one["engine"], one["profile"]) for one in stress["methods"]]
    if attack not in lines or (method.engine, method.profile) not in columns:
        return "-"
    cell = lines[attack]["cells"][columns.index((method.engine, method.profile))]
    value = "" if cell["value"] is None else format_number(cell["value"])
    said = {"fails_at_size": value, "passes": f"passes to {value}", "fails_at_start": f"from {value}"}
    return said.get(cell["ending"]) or str(cell["reason"]).partition(":")[0]


def choices(need: Need, methods: Sequence[Method]) -> list[str]:
    """Return, for each engine, a text with the profile and step that meet a need in most scenes.

    The best engine is first. Among equally good results, larger steps come first, then smaller run times.
    """
    found: dict[str, tuple[tuple[float, ...], str]] = {}
    for method in methods:
        for refinement in sorted({row["refinement"] for row in method.rows}):
            rows = [row for row in method.rows if row["refinement"] == refinement and need.scenes(row["scene"])]
            if not rows:
                continue
            met = sum(row["status"] == "ran" and row["total"] is not None and need.met(row) for row in rows)
            rank = (-met, refinement, math.inf if method.ratio is None else method.ratio)
            part = f"1/{4**refinement} frame" if refinement else "1 frame"
            said = f"{method.name}, {part}: {met} of {len(rows)}, {speed(method)}"
            if met and (method.engine not in found or rank < found[method.engine][0]):
                found[method.engine] = (rank, said)
    return [said for _, said in sorted(found.values())]


def best(methods: Sequence[Method]) -> Method | None:
    """Return the profile to copy: the fewest scenes are graded wrong, then most are graded exact, close and sampled.

    Among equally good profiles, tuned profiles come before `default`. None if a program can't copy any profile.
    """

    def rank(method: Method) -> tuple[int | bool, ...]:
        tally = Counter(row["grade"] for row in method.coarse)
        return (tally["wrong"], *(-tally[grade] for grade in GRADES[:3]), method.profile == "default")

    pasted = [method for method in methods if method.profile not in (*CUT, *RESHAPED)]
    return min(pasted, key=rank) if pasted else None


def settings(method: Method) -> str:
    """Return the settings that a profile used everywhere, and those that depend on the scene, as a table of TOML."""
    used = [row["settings"] for row in method.coarse if row["settings"]]
    names = dict.fromkeys(name for one in used for name in one if name != "dt_s")
    values = {name: {json.dumps(one[name]) for one in used if name in one} for name in names}
    return "\n".join(
        f"{name} = {next(iter(said))}" if len(said) == 1 else f"# {name} depends on the scene and the step"
        for name, said in values.items()
    )
