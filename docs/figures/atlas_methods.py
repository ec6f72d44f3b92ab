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
from carom.support.formatting import format_number, format_percent

#: Grades from best to worst.
GRADES = ("exact", "close", "sampled", "inaccurate", "diverged", "diverged inaccurate", "wrong")
#: Carom's own methods. Engines are compared with these methods, and users do not choose them.
OWN = ("pic", "pit")
#: Profiles that a program cannot copy, because Carom shortens the steps during a run.
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
#: A scene that becomes chaotic during the run. Results differ from phase to phase, so tables show the range over many
#: phases.
CHAOTIC = "engines/gas-of-25"

Row = dict[str, Any]


@dataclass(frozen=True)
class Method:
    """An engine with a profile, and its rows.

    Attributes:
        engine: Name of the adapter.
        profile: Name of the profile.
        rows: All rows of the method.
        ratio: Run time divided by PIT's run time with the same step size, median of the timed scenes; None without
            timed scenes.
        gas: Results of the scene `CHAOTIC` over many phases; None if the scene was not measured.
    """

    engine: str
    profile: str
    rows: tuple[Row, ...]
    ratio: float | None
    gas: Row | None = None

    @property
    def name(self) -> str:
        """The displayed name of the method."""
        return f"{self.engine} {format_profile(self.engine, self.profile, {})}".rstrip()

    @property
    def coarse(self) -> list[Row]:
        """The method's rows at each scene's own frame rate."""
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
    entry = all_scenes()[scene]
    frame_s = 1.0 / entry.scene.frame_rate_hz
    moves_far = any(math.hypot(*disc.velocity_m_s) * frame_s > 2 * disc.radius_m for disc in entry.scene.discs)
    return moves_far and entry.known.count != 0


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
    """Return the values that a function returns for the rows in which every impact was found.

    Values of None (infinite or undefined numbers) are left out.
    """
    said = (value(row) for row in rows if row["total"] is not None)
    return [one for one in said if one is not None]


def spread(values: Sequence[float], say: Callable[[float], str] = format_number) -> str:
    """Return a text with the median and the largest value."""
    return f"{say(statistics.median(values))}, at most {say(max(values))}" if values else "-"


def grades(method: Method) -> str:
    """Return the number of scenes with each grade, at each scene's own frame rate."""
    tally = Counter(row["grade"] if row["status"] == "ran" else row["status"] for row in method.coarse)
    named = {grade: grade.replace(" ", "_") for grade in GRADES}
    known = [f"{tally.pop(name)} {grade}" for grade, name in named.items() if tally[name]]
    return ", ".join(known + [f"{n} {word.replace('_', ' ')}" for word, n in tally.items() if n])


def total(kind: str, over: Callable[[Row], float] = lambda _: 1.0) -> Callable[[Row], float | None]:
    """Return a function that returns the magnitude of one kind of largest error of a row."""

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
    """Return the numbers of impacts that a method misses and invents."""
    scored = [row for row in method.coarse if row["missed"] is not None]
    return f"{sum(len(row['missed']) for row in scored)} / {sum(len(row['spurious']) for row in scored)}"


def speed(method: Method) -> str:
    """Return a method's run time divided by PIT's run time."""
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
    """Return the best profile of an engine: it has the fewest scenes with the grade *wrong*.

    Among profiles with the same number, the best profile has the most scenes with the grades exact, close and sampled.

    Among equally good profiles, tuned profiles come before `default`. Profiles that a program can't copy are ignored.
    """

    def rank(method: Method) -> tuple[int | bool, ...]:
        tally = Counter(row["grade"] for row in method.coarse)
        return (tally["wrong"], *(-tally[grade] for grade in GRADES[:3]), method.profile == "default")

    pasted = [method for method in methods if method.profile not in (*CUT, *RESHAPED)]
    return min(pasted, key=rank) if pasted else None


def settings(method: Method) -> str:
    """Return as TOML the settings of a profile, and the names of settings that depend on the scene."""
    used = [row["settings"] for row in method.coarse if row["settings"]]
    names = dict.fromkeys(name for one in used for name in one if name != "dt_s")
    values = {name: {json.dumps(one[name]) for one in used if name in one} for name in names}
    return "\n".join(
        f"{name} = {next(iter(said))}" if len(said) == 1 else f"# {name} depends on the scene and the step"
        for name, said in values.items()
    )
