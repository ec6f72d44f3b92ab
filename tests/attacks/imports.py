"""Files of engines, mutated: each becomes a scene that is saved and loads equal, or is refused in a sentence.

A pickle and an MJCF are read by their engines in a worker process, as `carom import` does. No file runs a program.
"""

import importlib.util
import json
import pickle
from collections.abc import Iterator
from contextlib import nullcontext
from pathlib import Path
from random import Random
from typing import Any
from unittest.mock import patch

from tests.attacks.guard import save_input, spoil, try_act
from tests.attacks.scenes import mutate

from carom.catalogue import all_scenes
from carom.engines.registry import load_adapter
from carom.execution import scene_import
from carom.execution.pool import LocalPool
from carom.model.scene_file import load_scene, save_scene

DUMP = Path(__file__).parents[1] / "unit/engines/importers/data/planck-1.5.0.json"
MODELS = ("classics/bank-shot", "spin/grip")
#: A reader that is given this long has been given a bomb: it must end, by its time limit at worst.
LIMIT_S = 30.0
#: Parts of MJCF that name files, nest, or ask for much memory, as parts of a model and instead of one.
PARTS = (
    *(b"<include file='/etc/passwd'/>", b"<asset><mesh name='m' file='/dev/zero'/></asset>", b"<body>" * 2000),
    *(b"<size memory='1000G'/>", b"<compiler meshdir='/'/>", b"<option timestep='0'/>", b"<option gravity='nan 0 0'/>"),
    b"<worldbody><geom type='sphere' size='1e300'/></worldbody>",
    b"<custom><text name='a' data='\x1b[31m'/></custom>",
    *(b"<extension><plugin plugin='mujoco.pid'/></extension>", b"<keyframe><key qpos='1'/></keyframe>"),
    b"<worldbody><replicate count='1000000000' offset='1 0 0'><geom size='.1'/></replicate></worldbody>",
    b"<worldbody><frame><include file='x.xml'/></frame></worldbody>",
    b"<worldbody><composite type='cable' count='100000 1 1' offset='0 0 1'/></worldbody>",
)
#: Entities, each twenty times the one before.
BOMB = b"<!DOCTYPE m [<!ENTITY a 'aaaaaaaaaa'>" + b"".join(
    b"<!ENTITY %c '%s'>" % (98 + k, b"&%c;" % (97 + k) * 20) for k in range(9)
)


def attack(rng: Random, folder: Path) -> Iterator[str]:
    """Engine files with random changes: pickles, MJCF, dumps.

    The result is a scene that loads without a difference, or a message; no program is started.
    """
    sound = _build_sound_files()
    canary = folder / "canary"
    pool = LocalPool(1, LIMIT_S, memory_limit_mb=1500)

    # An import would start a process, and close it: all tries share one.
    with pool, patch.object(scene_import, "LocalPool", lambda *_: nullcontext(pool)):
        while True:
            suffix = rng.choice([*sound])
            data = _spoil(rng, suffix, rng.choice(sound[suffix]), canary)
            path, again = folder / f"world{suffix}", folder / "again.json"
            path.write_bytes(data)

            def imported(path: Path = path, again: Path = again) -> str:
                found = scene_import.import_scene(path)
                save_scene(found.scene, again)
                return "" if load_scene(again) == found.scene else "what was imported and saved does not load equal"

            lost = try_act(imported, path.name, most=20_000, limit_s=20.0)
            again.unlink(missing_ok=True)
            if canary.exists():
                lost = "a file ran a program"
                canary.unlink()
            yield lost and f"{lost}; {save_input(folder, suffix, data)}"


def _build_sound_files() -> dict[str, list[bytes]]:
    """Return files of each kind whose reader is installed, by their ending."""
    found = {".json": [DUMP.read_bytes()]}
    scenes = [all_scenes()[name].scene for name in MODELS]
    if importlib.util.find_spec("pymunk"):
        adapter: Any = load_adapter("pymunk")
        found[".pkl"] = []
        for scene in scenes:
            names: dict[str, Any] = {}
            code = adapter.code(scene, adapter.profiles["tuned"].settings(1 / 60), "")
            exec(code.partition("for _ in range(steps)")[0], names)  # noqa: S102 - the printed settings of an adapter
            found[".pkl"] += [pickle.dumps(names["space"], protocol) for protocol in (0, 2, 5)]
    if importlib.util.find_spec("mujoco"):
        adapter = load_adapter("mujoco")
        settings = adapter.profiles["tuned"].settings(0.002)
        found[".xml"] = [adapter.code(scene, settings, "A model.").encode() for scene in scenes]
    return found


class _Runs:
    """What would run a program when it is read."""

    def __init__(self, call: tuple[Any, ...]) -> None:
        self._call = call

    def __reduce__(self) -> tuple[Any, ...]:
        return self._call


def _spoil(rng: Random, suffix: str, data: bytes, canary: Path) -> bytes:
    """Return the file with pieces changed, or another one that its reader must not follow."""
    kind = rng.random()
    if suffix == ".pkl" and kind < 0.2:
        call = rng.choice(((exec, (f"open({str(canary)!r}, 'w')",)), (open, (str(canary), "w"))))
        bomb = pickle.dumps(_Runs(call), rng.choice((0, 2, 5)))
        return rng.choice((bomb, bomb[:-1] + b"0" + data, data[: rng.randrange(len(data))] + bomb))
    if suffix == ".pkl" and kind < 0.3:  # memory and depth
        return rng.choice((b"(" * 10**6 + b".", b"]" + b"\x94h\x00a" * 10**5 + b".", b"\x80\x05\x96" + b"\xff" * 8))
    if suffix == ".xml" and kind < 0.3:
        at = data.find(b">", rng.randrange(len(data))) + 1
        return data[:at] + rng.choice(PARTS) + data[at:]
    if suffix == ".xml" and kind < 0.35:
        return BOMB + b"]><mujoco model='&j;'/>"
    if suffix == ".json" and kind < 0.5:
        return json.dumps(spoil(rng, json.loads(data))).encode()
    return mutate(rng, data)
