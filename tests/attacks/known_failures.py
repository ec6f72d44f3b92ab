"""Lists of known failures, mutated: each is read, or refused in a sentence that names the file."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from random import Random

from tests.attacks.guard import HangError, within
from tests.attacks.scenes import mutated

from carom.conformance.known_failures import load_known_failures
from carom.errors import InputError
from carom.text import visible

SOUND = b"""
[[known_failure]]
reason = "the engine shrinks a contact by its margin; example.org/issues/12"
cases = ["penalty::velocities[default-classics/graze]", "penalty::energy[tuned]"]

[[known_failure]]
reason = "another"
versions = ">=7,<8"
platform = "linux-aarch64"
cases = ["a::b[c]"]
"""


def attack(rng: Random, folder: Path) -> Iterator[str]:
    """Read a list of which pieces are cut, doubled, moved, flipped or put in."""
    path = folder / "known.toml"
    while True:
        data = mutated(rng, SOUND)
        path.write_bytes(data)
        lost = ""
        try:
            with within():
                entries = load_known_failures(path)
            if not all(isinstance(name, str) and one.reason.strip() for one in entries for name in one.cases):
                lost = "a case without a reason"
        except InputError as error:
            text = str(error)
            if visible(text) != text or "known.toml" not in text or len(text) > 5000:
                lost = f"no sentence that names the file: {text[:200]!r}"
        except HangError:
            lost = "reading takes more than 10 s"
        except Exception as error:  # noqa: BLE001 - this is what is looked for
            lost = f"{type(error).__name__}: {str(error)[:200]!r}"
        yield lost and f"{lost}; {data!r}"
