"""Scene files, mutated: each is loaded or refused in sentences, in bounds; what is loaded is saved and loads equal."""

import re
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from random import Random

from tests.attacks.guard import save_input, try_act

from carom.catalogue import all_scenes
from carom.model.scene_file import load_scene, save_scene

#: Values and pieces that break readers.
PIECES = [
    *b'0 -0.0 1e308 1e-320 nan -inf "inf" true [] {} [[ ]] " \' """ \\ = . , # 1979-05-27 07:32:00'.split(),
    *(b"\n", b"\r", b"\0", b"\x1b[31m", b"\xff", b"\xe2\x80\xae", b"\xef\xbb\xbf"),
    *(b"9" * 400, b"0x" + b"f" * 60, b"a." * 40, b"[" * 200, b"{a=" * 200),
    *(b"[[discs]]\n", b"[[walls]]\n", b"[discs]\n", b"mass_kg = inf\n", b"position_m = [0, 0]\n"),
    *(b"normal = [0, 0]\n", b"friction = 1e9\n", b'name = ""\n'),
]
#: Bytes of a changed file.
MOST_BYTES = 80_000
#: Changed files that are changed again later.
MOST_KEPT = 2000


def attack(rng: Random, folder: Path) -> Iterator[str]:
    """Scene files with random changes.

    A file is loaded, and saved without a difference, or refused with a message within 10 s.
    """
    corpus = _build_corpus(folder)
    while True:
        suffix, data = rng.choice(corpus)
        data = mutate(rng, data)
        if rng.random() < 0.02 and len(corpus) < MOST_KEPT:
            corpus.append((suffix, data))
        path = folder / f"scene{suffix}"
        path.write_bytes(data)
        lost = try_act(partial(_load_and_save, path), path.name, most=20_000)
        yield lost and f"{lost}; {save_input(folder, suffix, data)}: {data[:200]!r}"


def _load_and_save(path: Path) -> str:
    scene, again = load_scene(path), path.with_name(f"again{path.suffix}")
    save_scene(scene, again)
    return "" if load_scene(again) == scene else "what was saved does not load equal"


def mutate(rng: Random, data: bytes) -> bytes:
    """Return the data with a few pieces cut, doubled, moved, flipped or put in."""
    for _ in range(rng.choice((1, 1, 2, 3, 8))):
        at, to = sorted(rng.randrange(len(data) + 1) for _ in range(2))
        match rng.randrange(6):
            case 0:
                data = data[:at] + data[min(to, at + 40) :]
            case 1:
                data = data[:to] + data[at:to] * rng.choice((1, 2, 50)) + data[to:]
            case 2:
                data = data[:at] + rng.choice(PIECES) + data[at:]
            case 3:
                data = data[:at] + bytes([rng.randrange(256)]) + data[at + 1 :]
            case 4:  # another value in the place of a number
                numbers = [*re.finditer(rb"-?[0-9][0-9.e+-]*", data)]
                if numbers:
                    one = rng.choice(numbers)
                    data = data[: one.start()] + rng.choice(PIECES[:12]) + data[one.end() :]
            case 5:  # lines in another order
                lines = data.splitlines(keepends=True)
                if lines:
                    lines.insert(rng.randrange(len(lines)), lines.pop(rng.randrange(len(lines))))
                data = b"".join(lines)
        data = data[:MOST_BYTES]
    return data


def _build_corpus(folder: Path) -> list[tuple[str, bytes]]:
    """Return the files of all scenes with few discs."""
    corpus = []
    for entry in all_scenes().values():
        for suffix in (".toml", ".json") if len(entry.scene.discs) < 8 else ():
            save_scene(entry.scene, path := folder / f"scene{suffix}")
            corpus.append((suffix, path.read_bytes()))
    return corpus
