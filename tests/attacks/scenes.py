"""Scene files, mutated: each is loaded or refused in sentences, in bounds; what is loaded is saved and loads equal."""

import re
from collections.abc import Iterator
from functools import partial
from hashlib import sha256
from pathlib import Path
from random import Random

from tests.attacks.guard import HangError, limit_time, shrink

from carom.catalogue import all_scenes
from carom.errors import SceneError
from carom.model.scene_file import load_scene, save_scene
from carom.support.escaping import escape_controls

#: Values and pieces that break readers.
PIECES = [
    *b'0 -0.0 1e308 1e-320 nan -inf "inf" true [] {} [[ ]] " \' """ \\ = . , # 1979-05-27 07:32:00'.split(),
    *(b"\n", b"\r", b"\0", b"\x1b[31m", b"\xff", b"\xe2\x80\xae", b"\xef\xbb\xbf"),
    *(b"9" * 400, b"0x" + b"f" * 60, b"a." * 40, b"[" * 200, b"{a=" * 200),
    *(b"[[discs]]\n", b"[[walls]]\n", b"[discs]\n", b"mass_kg = inf\n", b"position_m = [0, 0]\n"),
    *(b"normal = [0, 0]\n", b"friction = 1e9\n", b'name = ""\n'),
]
#: Draws from a corpus that grows by each input that is refused, or loaded, in a new way.
MOST_KEPT = 2000
MOST_BYTES = 20_000


def attack(rng: Random, folder: Path) -> Iterator[str]:
    """Scene files with random changes.

    A file is loaded, and saved without a difference, or refused with a message within 10 s.
    """
    corpus, seen = _build_corpus(folder), set[str]()
    while True:
        suffix, data = rng.choice(corpus)
        data = mutate(rng, data)
        path = folder / f"scene{suffix}"
        lost, kind = _try_scene(path, data)
        if kind not in seen and len(corpus) < MOST_KEPT and len(data) < MOST_BYTES:
            seen.add(kind)
            corpus.append((suffix, data))
        if lost:
            least = shrink(data, partial(_fails, path))
            found = folder / f"found-{sha256(least).hexdigest()[:16]}{suffix}"
            found.write_bytes(least)
            lost = f"{lost}; see {found.name}: {least[:200]!r}"
        yield lost


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
        data = data[: 4 * MOST_BYTES]
    return data


def _fails(path: Path, data: bytes) -> bool:
    return bool(_try_scene(path, data)[0])


def _build_corpus(folder: Path) -> list[tuple[str, bytes]]:
    """Return the files of all scenes with few discs."""
    corpus = []
    for entry in all_scenes().values():
        for suffix in (".toml", ".json") if len(entry.scene.discs) < 8 else ():
            save_scene(entry.scene, path := folder / f"scene{suffix}")
            corpus.append((suffix, path.read_bytes()))
    return corpus


def _try_scene(path: Path, data: bytes) -> tuple[str, str]:
    """Return what was lost, "" where nothing was, and what kind of answer it was, for the corpus."""
    path.write_bytes(data)
    try:
        with limit_time():
            scene = load_scene(path)
            again = path.with_name(f"again{path.suffix}")
            save_scene(scene, again)
            return "" if load_scene(again) == scene else "what was saved does not load equal", "loaded"
    except SceneError as error:
        text = str(error)
        kind = re.sub(r"[0-9.e+-]+|'[^']*'|got .*", "", text.replace(str(path), ""))[:300]
        if escape_controls(text) != text:
            return f"control characters in a message: {text[:200]!r}", kind
        return "" if len(text) < 20_000 and text else f"a message of {len(text)} characters", kind
    except HangError:
        return "loading takes more than 10 s", "hang"
    except Exception as error:  # noqa: BLE001 - this is what is looked for
        return f"{type(error).__name__}: {str(error)[:200]!r}", type(error).__name__
