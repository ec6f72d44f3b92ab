"""Lists the cases of the suite for one adapter. A case is a check with parameters. The name of a case never changes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from inspect import signature
from itertools import product
from typing import Any

from carom.catalogue import all_scenes
from carom.conformance.adapter_under_test import Subject, build_catalogue_setup
from carom.conformance.checks import (
    accuracy,
    capability,
    conduct,
    contacts,
    declaration,
    invariants,
    settings,
    turning,
    walls,
)
from carom.conformance.suite_scenes import CATALOGUE_SCENES, LOCATED_SCENES


@dataclass(frozen=True)
class Case:
    """One case of the suite.

    Attributes:
        name: ``check[parameters]``. The full name in a file of known failures is ``engine::check[parameters]``.
        run: The check. The check raises an error if the adapter does not conform.
        meaning: The requirement in one sentence: the first line of the check's docstring.
        skip: Why the adapter can't run the case, according to its declared capabilities; empty if the case is run.
        profile: The profile that the case checks; empty if the case checks the adapter as a whole.
    """

    name: str
    run: Callable[[Subject], None]
    meaning: str
    skip: str = ""
    profile: str = ""


#: Tested restitutions, as positions within the declared range: 0 is the lower end of the range, and 1 is the upper end.
RESTITUTION_SHARES = {"least": 0.0, "middle": 0.5, "greatest": 1.0}

#: Modules of checks, in the order of execution. The function ``check_x_y`` is the check with the name ``x-y``.
_MODULES = (declaration, settings, invariants, contacts, walls, capability, turning, accuracy, conduct)

#: Checks of a profile whose steps are shortened (`located`). In addition to these checks, such a profile runs only the
#: checks of scenes.
_OF_LOCATED = {"settings", "start", "cutting"}


def _list_checks(*parameters: str) -> dict[str, Callable[..., None]]:
    """Return the checks by name: all functions whose parameters are ``subject`` and the given names."""
    return {
        name.removeprefix("check_").replace("_", "-"): check
        for module in _MODULES
        for name, check in vars(module).items()
        if name.startswith("check_") and list(signature(check).parameters) == ["subject", *parameters]
    }


def list_cases(subject: Subject) -> Iterator[Case]:
    """Yield all cases for an adapter in the order of execution. Checks of declarations come first."""

    def build_case(name: str, check: Callable[..., None], /, *, skip: str = "", **parameters: Any) -> Case:
        meaning = (check.__doc__ or "").strip().splitlines()[0]
        return Case(name, partial(check, **parameters), meaning, skip, parameters.get("profile", ""))

    for name, check in _list_checks().items():
        yield build_case(name, check)
    for refusal in capability.REFUSALS:
        yield build_case(f"refuses[{refusal.replace(' ', '-')}]", capability.check_refuses, refusal=refusal)
    for order in ("first", "second"):
        yield build_case(f"immovable-disc[{order}]", capability.check_immovable_disc, order=order)
    for (share, e), (wall_share, wall_e) in product(RESTITUTION_SHARES.items(), repeat=2):
        name = f"restitution[{share}-{wall_share}]"
        yield build_case(name, capability.check_restitution, share=e, wall_share=wall_e)
    for share, wall_share in product(turning.FRICTIONS, repeat=2):
        name = f"friction[{share}-{wall_share}]"
        yield build_case(name, turning.check_friction, share=share, wall_share=wall_share)
    for inertia in turning.INERTIAS:
        yield build_case(f"inertia[{inertia}]", turning.check_inertia, inertia=inertia)
    of_profile, of_scene = _list_checks("profile"), _list_checks("profile", "name")
    for profile, described in subject.adapter.profiles.items():
        chosen = _OF_LOCATED if described.located else of_profile.keys() - {"cutting"}
        for name, check in of_profile.items():
            if name in chosen:
                yield build_case(f"{name}[{profile}]", check, profile=profile)
        for scene in LOCATED_SCENES if described.located else CATALOGUE_SCENES:
            skip = subject.find_unsupported_reason(build_catalogue_setup(scene, profile))
            turns = all_scenes()[scene].scene.arrays.turns
            for name, check in of_scene.items():
                if turns or name != "spins":
                    yield build_case(f"{name}[{profile}-{scene}]", check, skip=skip, profile=profile, name=scene)
