"""The documents of `carom engines`, `carom scenes`, `carom certify` and `carom advise`."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import tomli_w

from carom.adapter import Capabilities
from carom.bench.adviser import RESOLUTION, Advice, Advised, Cause, HardImpact, StepTrial
from carom.registry import EngineInfo
from carom.report import wording
from carom.report.document import DETAIL, EVERYWHERE, TERMINAL, Cell, Column, Document, Section, Table, Text
from carom.scenes import CatalogueScene, Complaint
from carom.trace import body_name, pair_name

if TYPE_CHECKING:
    from carom.solvers.certified.result import CertifiedTrace

__all__ = ["advice_document", "certified_document", "engine_document", "scene_document", "scene_text"]


def engine_document(infos: Sequence[EngineInfo]) -> Document:
    """Return a table of engines: version, or why unavailable, profiles and capabilities."""
    table = Table(
        (
            Column("name", lambda info: info.name),
            Column("engine", lambda info: info.engine),
            Column("version, or why it is unavailable", _version),
            Column("profiles", lambda info: ", ".join(info.profiles)),
            Column("capabilities", lambda info: _capabilities(info.capabilities) if info.capabilities else ""),
        ),
        infos,
    )
    return Document("Carom: engines", (), (Section("Engines", (table,)),))


def _version(info: EngineInfo) -> Cell | str:
    return info.version if info.available else Cell(f"unavailable: {info.unavailable}", style="red")


def _capabilities(able: Capabilities) -> str:
    low, high = able.restitution
    parts = [
        "walls" if able.walls else "no walls",
        "immovable discs" if able.immovable_discs else "no immovable discs",
        "gravity" if able.gravity else "no gravity yet",
        f"restitution {low:g}" if low == high else f"restitution {low:g} to {high:g}",
        *(["continuous detection"] if able.continuous_detection else []),
        f"contact times {able.contact_times.value}",
        f"float{able.float_bits}",
    ]
    return ", ".join(parts)


def scene_document(entries: Sequence[CatalogueScene]) -> Document:
    """Return a table of scenes: name, size, and what each shows."""
    table = Table(
        (
            Column("name", lambda entry: entry.name),
            Column("what it shows", lambda entry: entry.shows),
            Column("discs", lambda entry: str(len(entry.scene.discs)), number=True),
            Column("walls", lambda entry: str(len(entry.scene.walls)), number=True),
            Column("impacts", lambda entry: "" if entry.known.count is None else str(entry.known.count), number=True),
        ),
        entries,
    )
    return Document("Carom: scenes", (), (Section("Scenes", (table,)),))


def scene_text(entry: CatalogueScene) -> str:
    """Return a scene as a TOML file that can be loaded again, its known answer told in comments at the top."""
    lines = [entry.shows, f"Known answer: {entry.known.source}"]
    if entry.known.count is not None:
        lines.append(f"Impacts: {entry.known.count}")
    if entry.known.convention:
        lines.append(f"No unique answer: {entry.known.convention}")
    if isinstance(entry, Complaint):
        lines += [f"Reported of {entry.about}: {entry.reported}", f"Thread: {entry.thread}", entry.made]
    comments = "".join(f"# {line}\n" for line in lines)
    return comments + tomli_w.dumps(entry.scene.model_dump(mode="python"))


def certified_document(certified: CertifiedTrace, most: int) -> Document:
    """Return the first impacts, every digit of them right to one unit in the last, and how far the run reached."""
    left_out = len(certified) - most
    table = Table(
        (
            Column("#", str, number=True),
            Column("time, s", lambda k: _decimals(certified, k)[0]),
            Column("bodies", lambda k: pair_name(certified.trace.impacts[k])),
            Column("velocities after, m/s", lambda k: _velocities(certified, k)),
            *(
                [Column("spins after, rad/s", lambda k: _spins(certified, k))]
                if certified.trace.spins is not None
                else []
            ),
        ),
        range(min(most, len(certified))),
        title=f"{certified.trace.scene.name}: every digit proven",
        note=f"and {left_out} more" if left_out > 0 else "",
    )
    blocks = (table,) if most and len(certified) else ()
    return Document("Carom: certified", tuple(_reach(certified)), (Section(table.title, blocks),))


def _decimals(certified: CertifiedTrace, k: int) -> Sequence[str]:
    """Return the proven digits of an impact: its time, the parts of both velocities after it, and its discs' spins."""
    if certified.decimals:
        return certified.decimals[k]
    from carom.solvers.certified.result import proven_decimal

    impact, radius = certified.trace.impacts[k], certified.radii[k]
    sides = [(side, c) for side in ("velocity_first_after", "velocity_second_after") for c in (0, 1)]
    numbers = [(impact["time_s"], radius["time_s"]), *((impact[side][c], radius[side][c]) for side, c in sides)]
    if certified.trace.spins is not None and certified.spin_radii is not None:
        turned = ["first_after"] if impact["second"] < 0 else ["first_after", "second_after"]
        numbers += [(certified.trace.spins[k][side], certified.spin_radii[k][side]) for side in turned]
    return [proven_decimal(float(value), float(bound)) for value, bound in numbers]


def _velocities(certified: CertifiedTrace, k: int) -> str:
    _, *velocity = _decimals(certified, k)
    after = f"({velocity[0]}, {velocity[1]})"
    return after if certified.trace.impacts[k]["second"] < 0 else f"{after}  ({velocity[2]}, {velocity[3]})"


def _spins(certified: CertifiedTrace, k: int) -> str:
    return "  ".join(_decimals(certified, k)[5:])


def _reach(certified: CertifiedTrace) -> Iterator[str]:
    """Say how far the run is certified, and why it ended."""
    impacts, end_s = wording.count(len(certified), "impact"), certified.trace.end_time_s
    reach = f"certified to {certified.digits} digits for {impacts}, to {end_s:.6g} s"
    cost = f"{certified.precision_bits} bits, {certified.bits_lost:.0f} lost, {certified.elapsed_s:.2f} s"
    yield f"{certified.trace.scene.name}: {reach} of {certified.trace.scene.duration_s:g} s ({cost})."
    yield f"{wording.capitalised(certified.ending.value)}."
    if certified.degeneracy is not None:
        yield f"{certified.degeneracy}."
    if certified.commuted:
        yield f"The order of {len(certified.commuted)} simultaneous impacts makes no difference, and is not certified."


def advice_document(advice: Advice) -> Document:
    """Return the answer, with what was tried for it: who may take the longest step comes first."""
    lost = Column("lost,", lambda answer: _found(answer.passes), "direction", only=DETAIL)
    table = Table(
        (
            Column("method", lambda answer: f"{answer.method.engine} {answer.method.profile}"),
            Column("steps a", lambda answer: _rate(answer.passes), "second", number=True),
            Column("passes at", lambda answer: _step(answer.passes), "step, s", number=True),
            lost,
            Column("fails at", lambda answer: _step(answer.fails), "step, s", number=True),
            replace(lost, say=lambda answer: _found(answer.fails), only=EVERYWHERE),
            Column("search", _ended, only=TERMINAL),
            Column("remark", _remark, only=DETAIL),
        ),
        sorted(advice.answers, key=lambda answer: -answer.passes.dt_s if answer.passes else 0.0),
        title=f"{advice.scene.name}: the largest step that meets the demand",
    )
    short = "lost: share of starts with an impact missed or invented (+: an unlucky one)"
    note = (
        f"Each step was run at {wording.count(advice.phases, 'start')} spread evenly over it and at those that "
        f"look just before the hardest impacts; the two steps are no more than {wording.percent(RESOLUTION - 1.0)} "
        "apart. Lost: share of the even starts with an impact missed or invented (+: only at an aimed one). Found by "
        "trying: between the steps tried there is no proof."
    )
    section = Section(table.title, (table, Text(short, TERMINAL), Text(note, DETAIL)))
    return Document("Carom: advice", tuple(_sentences(advice)), (section,))


def _sentences(advice: Advice) -> Iterator[str]:
    """Return the answer, then which impact is the hardest and why."""
    degrees = wording.number(math.degrees(advice.demand.direction_error_rad), 3)
    lost = advice.demand.miss_probability
    missing = "no impact missed" if lost == 0 else f"an impact missed at no more than {wording.percent(lost)} of starts"
    yield f"Asked of {advice.scene.name}: directions right to {degrees}°, and {missing}."
    if advice.closed_form_s is not None:
        yield (
            f"PIT needs {_at_least(advice.closed_form_s)}: by closed form, at any start."
            if math.isfinite(advice.closed_form_s)
            else "PIT does so at any frame rate at which it looks before the scene ends."
        )
    engines = [answer for answer in advice.answers if answer.method.engine not in {"pic", "pit"}]
    ended = [(answer.passes.dt_s, answer.method) for answer in engines if answer.passes and not answer.reason]
    if ended:
        dt_s, method = max(ended, key=lambda one: one[0])
        yield f"Take {method.engine} ({method.profile}), which needs the fewest steps: {_at_least(dt_s)}."
    elif engines:
        yield f"No engine's search ended in a step to take: {engines[0].reason}."
    yield _hardest(advice.hardest[0], advice.impacts, rough=advice.scene.arrays.rubs_discs)


def _at_least(dt_s: float) -> str:
    return f"at least {wording.number(1.0 / dt_s, 4)} steps a second (a step of at most {wording.number(dt_s, 4)} s)"


def _rate(trial: StepTrial | None) -> str:
    return "none" if trial is None else wording.number(1.0 / trial.dt_s, 4)


def _hardest(impact: HardImpact, impacts: int, *, rough: bool) -> str:
    where = f"{body_name(impact.first)} and {body_name(impact.second)} at {wording.number(impact.time_s, 4)} s"
    which = "Its one impact" if impacts == 1 else f"The hardest of its {impacts} impacts"
    window = impact.limit.window
    if window is None:
        return f"{which} is that of {where}: {impact.cause.value}."
    size = f"{wording.number(window.speed_m_s)} m/s and {wording.number(window.reach_m)} m from centre to centre"
    why = {
        Cause.GRAZE: f"a graze, at {wording.number(window.share, 4)} of the contact distance off centre",
        Cause.FAST: f"fast for their size, {size}",
        Cause.TURN: f"their line of centres turns fast, at {size}",
        Cause.WALL: impact.cause.value,
    }[impact.cause]
    late = impact.limit.direction_dt_s
    direction = (
        "and however late they are found, the directions stay right to what was asked"
        if math.isinf(late)
        else f"and found more than {wording.number(late, 3)} s late, a direction is wrong by more than asked"
    )
    if rough:  # how friction turns with the line of centres has no closed form
        direction += ", were there no friction"
    return (
        f"{which} is that of {where}: {why}. They overlap and approach for {wording.number(window.length_s, 3)} s, "
        f"{direction}."
    )


def _ended(answer: Advised) -> str:
    if answer.reason:
        return "unfinished" if answer.passes else "none found"
    return "ended" if answer.closed_form_s is None else "closed form"


def _remark(answer: Advised) -> str:
    if answer.reason:
        return answer.reason
    if answer.closed_form_s is not None:
        return f"closed form: {wording.number(answer.closed_form_s, 4)} s, confirmed by running it"
    return "no step that was tried fails" if answer.fails is None else answer.fails.reason


def _step(trial: StepTrial | None) -> str:
    return wording.ABSENT if trial is None else wording.number(trial.dt_s, 4)


def _found(trial: StepTrial | None) -> str:
    if trial is None or trial.reason:
        return wording.ABSENT
    lost = wording.percent(trial.lost_share) + ("+" if trial.lost_anywhere and not trial.lost_share else "")
    return f"{lost}, {wording.number(math.degrees(trial.direction_error_rad), 3)}°"
