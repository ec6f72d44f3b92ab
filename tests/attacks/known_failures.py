"""Lists of known failures, mutated: each is read, or refused in a sentence that names the file."""

from collections.abc import Iterator
from pathlib import Path
from random import Random

from tests.attacks.guard import try_act
from tests.attacks.scenes import mutate

from carom.conformance.known_failures import load_known_failures

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
    """Lists of known failures with random changes.

    The file is read, or refused with a message.
    """
    path = folder / "known.toml"
    while True:
        data = mutate(rng, SOUND)
        path.write_bytes(data)

        def read() -> str:
            entries = load_known_failures(path)
            sound = all(isinstance(name, str) and one.reason.strip() for one in entries for name in one.cases)
            return "" if sound else "a case without a reason"

        lost = try_act(read, "known.toml", most=5000)
        yield lost and f"{lost}; {data!r}"
