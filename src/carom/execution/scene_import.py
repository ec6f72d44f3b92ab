"""Imports files of engines as scenes. The engine's adapter reads the file, in a worker process."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from carom.engines.api import Imported, ReadingAdapter
from carom.engines.importers.planck_dump import parse_dump
from carom.engines.registry import explain_unavailable_adapter, load_adapter
from carom.errors import AdapterError, InputError, SceneError
from carom.execution.job import AdapterTask, Status, UnavailableError
from carom.execution.pool import LocalPool
from carom.execution.validate_adapter import to_plain_text
from carom.model.scene import Scene
from carom.model.units import convert_units
from carom.support.checks import check_number

#: Name of the adapter that reads a file, by the file's ending.
READERS = {".pkl": "pymunk", ".pickle": "pymunk", ".xml": "mujoco"}

#: Ending of a Planck dump. A dump is plain data, so no engine is needed to read a dump.
DUMP = ".json"

#: Size limit of a file. A pymunk space of 100,000 discs takes about 30 MB.
MOST_BYTES = 64 * 2**20


@dataclass(frozen=True)
class _ReadTask(AdapterTask):
    """Reads a file of an engine with the engine's adapter."""

    content: bytes
    name: str
    duration_s: float

    def carry_out(self) -> Imported:
        """Return the scene, and a list of the file's parts that scenes do not support.

        Raises:
            UnavailableError: The engine is not installed.
            AdapterError: The adapter reads no files, or refuses this file.
            SceneError: The supported part of the file is not a valid scene.
        """
        adapter = load_adapter(self.engine)
        if reason := explain_unavailable_adapter(adapter):
            raise UnavailableError(reason)
        if not isinstance(adapter, ReadingAdapter):
            raise AdapterError("its adapter cannot read files")
        imported = adapter.read(self.content, self.name, self.duration_s)
        return Imported(imported.scene, tuple(to_plain_text(part, "what was dropped") for part in imported.dropped))


def import_scene(
    path: str | Path, *, name: str = "", duration_s: float = 10.0, pixels_per_metre: float = 1.0
) -> Imported:
    """Return the scene in an engine's file, in metres, and a list of the file's parts that scenes do not support.

    Args:
        path: The file: a pickled `pymunk.Space` (``.pkl``, ``.pickle``), an MJCF model (``.xml``), or a world written
            by Planck's ``Serializer.toJson`` (``.json``). The first two formats are read in a separate process, which
            creates only objects of the engine's types; see ``docs/reference/security.md``.
        name: Name of the scene; by default the name of the file.
        duration_s: Duration of the scene, in seconds.
        pixels_per_metre: Length of one metre in the file's unit of length.

    Raises:
        InputError: The ending is not supported, the file can't be read, or a number is out of range.
        AdapterError: The engine is not installed, or its adapter refuses the file; the message contains the reason.
    """
    path = Path(path)
    if (engine := READERS.get(path.suffix)) is None and path.suffix != DUMP:
        raise InputError(f"{path} has an unknown extension; known: {', '.join((*READERS, DUMP))}")
    check_number("duration_s", duration_s, positive=True)
    check_number("pixels_per_metre", pixels_per_metre, positive=True)
    try:
        with path.open("rb") as file:
            content = file.read(MOST_BYTES + 1)
    except OSError as error:
        raise InputError(f"{path} can't be read: {error.strerror or error}") from None
    if len(content) > MOST_BYTES:
        raise InputError(f"{path} has more than {MOST_BYTES} bytes")
    if engine is None:
        try:
            imported = parse_dump(content, name or path.stem, duration_s)
        except InputError as error:
            raise InputError(f"{path}: {error}") from None
        except SceneError as error:
            raise SceneError(error.problems, source=str(path), more=error.more) from None
        return Imported(_convert_to_metres(imported.scene, pixels_per_metre), imported.dropped)
    with LocalPool(1) as pool:
        answer = pool.run(_ReadTask(engine, content, name or path.stem, duration_s))
    if answer.value is None:
        why = answer.reason if answer.status is Status.FAILED else answer.problem
        raise AdapterError(f"{path}: {why}")
    return Imported(_convert_to_metres(answer.value.scene, pixels_per_metre), answer.value.dropped)


def _convert_to_metres(scene: Scene, unit: float) -> Scene:
    """Convert a scene to metres. `unit` is the length of one metre in the scene's unit of length."""
    return scene if unit == 1.0 else Scene(**convert_units(scene.model_dump(), unit))  # the scene is checked again
