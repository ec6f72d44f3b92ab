"""Finding where a method gives way to an attack: up the ladder to the first break, then bisection."""

from __future__ import annotations

import math
from pathlib import Path

from carom.errors import InputError
from carom.runs.job import Job, Method, Status
from carom.runs.plan import trace_of
from carom.runs.pool import Asker
from carom.scene import save_scene
from carom.stress.attack import Attack, Judgement, Trial
from carom.stress.results import Spot, SpotEnding

__all__ = ["breaking_point"]

#: The breaking point is bisected until the value that stands and the one that does not are this near, as a ratio.
RESOLUTION, QUICK_RESOLUTION = 1.1, 3.2


class NotRunError(Exception):
    """The method can't be attacked at all: it is unavailable, or does not support the scene."""


class _Tried:
    """What came of one value: the worst judgement of its trials and the scene that shows it."""

    def __init__(self, value: float, trial: Trial, judgement: Judgement, runs: int) -> None:
        self.value, self.trial, self.judgement, self.runs = value, trial, judgement, runs

    @property
    def stands(self) -> bool:
        return not self.judgement.broken


def breaking_point(attack: Attack, method: Method, asker: Asker, scenes: Path, *, quick: bool) -> Spot:
    """Return the cell of an attack and a method; the scene that shows its number is saved into `scenes`."""
    ladder = attack.ladder(quick)
    runs = 0
    stood: _Tried | None = None
    fell: _Tried | None = None
    try:
        for value in ladder:
            tried = _try(attack, value, method, asker, quick=quick)
            runs += tried.runs
            if not tried.stands:
                fell = tried
                break
            stood = tried
        resolution = QUICK_RESOLUTION if quick else RESOLUTION
        while stood and fell and (middle := attack.between(stood.value, fell.value, resolution)) is not None:
            tried = _try(attack, middle, method, asker, quick=quick)
            runs += tried.runs
            stood, fell = (tried, fell) if tried.stands else (stood, tried)
    except NotRunError as error:
        return Spot("attack", attack.name, method.name, SpotEnding.NOT_RUN, reason=str(error), runs=runs)
    shown = fell or stood
    assert shown is not None  # noqa: S101 - a ladder has a first rung
    file = _saved(shown.trial, attack.name, method, scenes, "gives way" if fell else "stands")
    broke = SpotEnding.GIVES_WAY if stood else SpotEnding.NEVER_STOOD
    return Spot(
        "attack",
        attack.name,
        method.name,
        SpotEnding.STANDS if fell is None else broke,
        value=shown.value,
        stands_at=stood.value if stood else None,
        error=_number(stood.judgement.error) if stood else None,
        reason=shown.judgement.broken or shown.judgement.note,
        scenes=(file,),
        runs=runs,
    )


def _judged(method: Method, trial: Trial, asker: Asker) -> Judgement:
    """Run one trial and judge it; whatever an engine does instead of answering is a reason.

    Raises:
        NotRunError: The engine is unavailable.
    """
    answer = trace_of(Job(trial.scene, method, trial.dt_s), asker)
    if answer.status is Status.UNAVAILABLE:
        raise NotRunError(answer.said)
    return Judgement(math.nan, answer.said) if answer.value is None else trial.judge(answer.value)


def _try(attack: Attack, value: float, method: Method, asker: Asker, *, quick: bool) -> _Tried:
    worst: _Tried | None = None
    try:
        trials = attack.trials(value)
    except InputError as error:
        message = f"attack {attack.name} makes no scene at {value:g}: {error}"
        raise InputError(message) from error
    for runs, trial in enumerate(trials[::2] if quick else trials, 1):
        judgement = _judged(method, trial, asker)
        if judgement.broken:
            return _Tried(value, trial, judgement, runs)
        if worst is None or judgement.error > worst.judgement.error:
            worst = _Tried(value, trial, judgement, runs)
        worst.runs = runs
    assert worst is not None  # noqa: S101 - an attack has at least one trial
    return worst


def _saved(trial: Trial, attack: str, method: Method, scenes: Path, ending: str) -> str:
    """Save the scene of a number under a name of its own, so that all of them can be run together."""
    scenes.mkdir(parents=True, exist_ok=True)
    name = f"{attack}-{method.engine}-{method.profile}"
    shows = f"{trial.scene.description} Here {method.name} {ending}."
    save_scene(trial.scene.model_copy(update={"name": f"stress/{name}", "description": shows}), scenes / f"{name}.toml")
    return f"{scenes.name}/{name}.toml"


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None
