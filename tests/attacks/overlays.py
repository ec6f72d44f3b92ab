"""The folder of releases of `carom history`: installs that are killed, damaged files, and two users at once."""

import os
from collections.abc import Iterator
from pathlib import Path
from random import Random
from shutil import rmtree

from tests.attacks.guard import try_act
from tests.attacks.reports import end_at

from carom.studies.history.registry_clients import ClientError
from carom.studies.history.release_cache import open_release_cache

#: What a file in the place of a release's list, or of a folder, may hold.
PIECES = (b"", b"{", b"null", b"\xff", b"[" * 10**5, b'["toy==1.0"]', b"9" * 5000)


class _Client:
    """A registry's client that writes some files, or fails."""

    def __init__(self, rng: Random) -> None:
        self._files = {f"module{k}.py": rng.randbytes(rng.choice((0, 10, 10**4))) for k in range(rng.randrange(1, 5))}
        self.fails = rng.random() < 0.2

    def list_versions(self, package: str) -> tuple[str, ...]:
        del package
        return ()

    def install(self, package: str, version: str, folder: Path) -> tuple[str, ...]:
        for name, content in self._files.items():
            with (folder / name).open("wb") as file:  # a call at which the process may be killed
                file.write(content)
        if self.fails:
            raise ClientError("no network")
        return (f"{package}=={version}",)

    def is_whole(self, folder: Path) -> bool:
        """Whether a folder has all files of a release."""
        files = ((folder / name, content) for name, content in self._files.items())
        return all(file.exists() and file.read_bytes() == content for file, content in files)


def attack(rng: Random, folder: Path) -> Iterator[str]:
    """Releases of `carom history` that are killed, damaged, or installed twice at once.

    Every release that is used is complete, and nothing unfinished remains.
    """
    while True:
        rmtree(folder / "root", ignore_errors=True)
        rmtree(folder / "outside", ignore_errors=True)
        (folder / "outside").mkdir()
        (folder / "outside" / "mine").write_text("mine")
        yield rng.choice((_kill_installs, _kill_installs, _spoil_cache))(rng, folder / "root")
        if (folder / "outside" / "mine").read_text() != "mine":
            yield "a file outside of the folder is changed"


def _kill_installs(rng: Random, root: Path) -> str:
    """Install a release in one or two processes that end at a call drawn by lot, then in one that is left alone."""
    client, number, children = _Client(rng), rng.randrange(20), rng.choice((1, 2))

    def install() -> None:
        with open_release_cache(rng.choice((0.0, 1e9)), root) as kept:
            kept.install(client, "pip", "toy", "1.0")

    for _ in range(children):
        end_at(number, install)
    for _ in range(children):
        os.wait()
    with open_release_cache(1e9, root) as kept:
        found = kept.find("pip", "toy", "1.0")
        if found is not None and not client.is_whole(found):
            return f"killed at call {number}: a release that is found is not whole"
        if not client.fails and not client.is_whole(kept.install(client, "pip", "toy", "1.0")):
            return f"killed at call {number}: a release installed again is not whole"
    left = [path.name for path in root.glob("*/*/.new-*")]
    return f"killed at call {number}: {left} stay" if left else ""


def _spoil_cache(rng: Random, root: Path) -> str:
    """Put something else in the place of a list, a release or its folder, or a link to what is not Carom's."""
    client = _Client(rng)
    client.fails = False
    with open_release_cache(1e9, root) as kept:
        place = kept.install(client, "pip", "toy", "1.0")
    outside = root.parent / "outside"
    target = rng.choice((place / "carom-release.json", place, place.parent))
    rmtree(target) if target.is_dir() else target.unlink()
    match rng.randrange(3):
        case 0:
            target.write_bytes(rng.choice(PIECES))
        case 1:
            target.symlink_to(outside)
        case 2:
            target.symlink_to(root / "nowhere")

    def again() -> str:
        with open_release_cache(rng.choice((0.0, 1e9)), root) as kept:
            kept.versions("pip", "toy")
            kept.find("pip", "toy", "1.0")
            if rng.random() < 0.3:
                return ""
            try:
                place = kept.install(client, "pip", "toy", "1.0")
            except OSError:  # the command shows it as a sentence
                return ""
            return "" if client.is_whole(place) else "a release installed again is not whole"

    lost = try_act(again, "")
    return lost and f"{target.name} spoilt: {lost}"
