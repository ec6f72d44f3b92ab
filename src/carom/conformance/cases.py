"""Lists the cases of the suite for one adapter. A case is a check with parameters. The name of a case never changes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
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
from carom.conformance.known_answers import CATALOGUE_SCENES, LOCATED_SCENES


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

_OF_ADAPTER = {
    "declares-capabilities": declaration.declares_capabilities,
    "declares-profiles": declaration.declares_profiles,
    "imports-no-engine": declaration.imports_no_engine,
    "refuses-unknown-setting": settings.refuses_unknown_setting,
    "edges": walls.edges_as_declared,
    "circles": walls.circles_as_declared,
    "posts": walls.posts_as_declared,
    "wall-materials": walls.materials_as_declared,
    "driven-walls": walls.paddles_as_declared,
    "driven-discs": walls.mallets_as_declared,
    "legs": walls.legs_as_declared,
    "belts": walls.belts_as_declared,
    "edge-belts": walls.edge_belts_as_declared,
    "immovable-discs-alone": capability.posts_stand_still,
    "gravity": capability.falls_as_declared,
    "damping": capability.slows_as_declared,
    "rolling-resistance": capability.rolls_as_declared,
    "table-friction": capability.slows_on_a_table_as_declared,
    "greatest-speed": capability.fast_as_declared,
    "greatest-coordinate": capability.far_as_declared,
    "greatest-move": capability.moves_as_declared,
    "least-radius": capability.small_as_declared,
    "greatest-radius": capability.large_as_declared,
    "slowest-bounce": capability.slow_as_declared,
    "greatest-spin": turning.spins_as_declared,
    "continuous-detection": capability.detects_continuously,
    "silent-and-tidy": conduct.is_silent_and_tidy,
    "closes-after-errors": conduct.closes_after_errors,
    "lets-go-of-worlds": conduct.lets_go_of_worlds,
}

_OF_PROFILE = {
    "settings": settings.settings_are_read_back,
    "start": settings.starts_as_written,
    "momentum": invariants.momentum_is_kept,
    "energy": invariants.energy_is_kept,
    "contacts": contacts.contacts_are_well_formed,
    "contact-times": contacts.contacts_are_stamped,
    "impulses": contacts.contacts_account_for_velocities,
    "rubbing": turning.friction_is_limited,
    "determinism": conduct.repeats_to_the_bit,
    "observing": conduct.looking_changes_nothing,
    "steps-together": conduct.steps_singly_or_together,
    "observations-stay": conduct.keeps_what_it_showed,
}

#: Additional checks of the profile `located`, in which steps are shortened. In all other checks, steps have their full
#: length.
_OF_LOCATED = {
    "settings": settings.settings_are_read_back,
    "start": settings.starts_as_written,
    "cutting": conduct.cutting_leaves_no_trace,
}

_OF_SCENE = {
    "hits": accuracy.finds_impacts,
    "times": accuracy.times_are_right,
    "velocities": accuracy.velocities_are_right,
}

#: Additional checks of a scene with turning discs.
_OF_TURNING_SCENE = {**_OF_SCENE, "spins": accuracy.spins_are_right}


def list_cases(subject: Subject) -> Iterator[Case]:
    """Yield all cases for an adapter in the order of execution. Checks of declarations come first."""

    def build_case(name: str, check: Callable[..., None], /, *, skip: str = "", **parameters: Any) -> Case:
        meaning = (check.__doc__ or "").strip().splitlines()[0]
        return Case(name, partial(check, **parameters), meaning, skip, parameters.get("profile", ""))

    for name, check in _OF_ADAPTER.items():
        yield build_case(name, check)
    for refusal in capability.REFUSALS:
        yield build_case(f"refuses[{refusal.replace(' ', '-')}]", capability.refuses, refusal=refusal)
    for order in ("first", "second"):
        yield build_case(f"immovable-disc[{order}]", capability.immovable_stays, order=order)
    for (share, e), (wall_share, wall_e) in product(RESTITUTION_SHARES.items(), repeat=2):
        name = f"restitution[{share}-{wall_share}]"
        yield build_case(name, capability.restitution_as_declared, share=e, wall_share=wall_e)
    for share, wall_share in product(turning.FRICTIONS, repeat=2):
        name = f"friction[{share}-{wall_share}]"
        yield build_case(name, turning.friction_as_declared, share=share, wall_share=wall_share)
    for inertia in turning.INERTIAS:
        yield build_case(f"inertia[{inertia}]", turning.inertia_as_declared, inertia=inertia)
    for profile, described in subject.adapter.profiles.items():
        for name, of_profile in (_OF_LOCATED if described.located else _OF_PROFILE).items():
            yield build_case(f"{name}[{profile}]", of_profile, profile=profile)
        for scene in LOCATED_SCENES if described.located else CATALOGUE_SCENES:
            skip = subject.find_unsupported_reason(build_catalogue_setup(scene, profile))
            turns = all_scenes()[scene].scene.arrays.turns
            for name, of_scene in (_OF_TURNING_SCENE if turns else _OF_SCENE).items():
                yield build_case(f"{name}[{profile}-{scene}]", of_scene, skip=skip, profile=profile, name=scene)
