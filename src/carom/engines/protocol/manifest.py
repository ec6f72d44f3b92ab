"""Reads ``engine.toml``, the manifest of an engine that is a program, without starting the program."""

from __future__ import annotations

import json
import math
import shutil
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, model_validator

from carom.engines.api import Accuracy, Capabilities, ContactTimes, Knob, Stamp
from carom.engines.protocol.messages import PROTOCOL
from carom.errors import AdapterError, InputError
from carom.model.trace import Setting
from carom.support.data_files import read_data
from carom.support.escaping import format_value, is_older
from carom.support.fields import describe_error

#: Name of a manifest file.
MANIFEST = "engine.toml"
#: Hint in error messages: the document that explains the fields.
PAGE = "see docs/reference/engine-protocol.md#the-manifest"
#: If a setting has a wrong type, Pydantic appends one of these names to the location of the error. Carom's messages
#: leave the name out.
_KINDS = (["float"], ["int"], ["bool"], ["str"])


def _check_known_fields(kind: type[Any]) -> Any:
    """Return a validator that refuses fields that the dataclass `kind` does not have."""

    def check(table: object) -> object:
        if isinstance(table, Mapping) and (unknown := sorted(table.keys() - {field.name for field in fields(kind)})):
            raise ValueError(f"there is no {', '.join(map(repr, unknown))}")
        return table

    return BeforeValidator(check)


def _read_enums(table: object) -> object:
    """Replace the texts of ``contact_times`` and ``stamp`` by members of their enumerations.

    A manifest contains the lower-case names of the enum members, because the members' values are sentences.
    """
    if not isinstance(table, Mapping):
        return table
    found = dict(table)
    for field, kind in (("contact_times", ContactTimes), ("stamp", Stamp)):
        if field in found:
            names = [member.name.lower() for member in kind]
            if found[field] not in names:
                raise ValueError(f"{field} must be one of {', '.join(names)}, got {found[field]!r}")
            found[field] = kind[found[field].upper()]
    return found


def _check_finite(setting: Setting) -> Setting:
    """Refuse infinity and NaN. JSON has neither infinity nor NaN, so the program would get a string."""
    if isinstance(setting, float) and not math.isfinite(setting):
        raise ValueError(f"must be finite, as JSON requires, got {setting}")
    return setting


_Capabilities = Annotated[Capabilities, BeforeValidator(_read_enums), _check_known_fields(Capabilities)]
_Accuracy = Annotated[Accuracy, _check_known_fields(Accuracy)]
_Knob = Annotated[Knob, _check_known_fields(Knob)]


class _Table(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class ProgramProfile(_Table):
    """A profile in a manifest, with the fields of `carom.engines.api.Profile`.

    The settings do not contain the step size ``dt_s``, which Carom adds. In the file, `capabilities` contains only
    values that differ from the engine's capabilities.
    """

    description: str
    settings: dict[str, Annotated[Setting, AfterValidator(_check_finite)]] = {}
    accuracy: _Accuracy = Accuracy()
    located: bool = False
    capabilities: _Capabilities | None = None
    changed: dict[str, str] = {}


class Manifest(_Table):
    """Description of an engine that is a program. Carom reads the description without starting the program.

    Attributes:
        protocol: Version of the protocol that the program uses.
        name: Name for ``--engine``.
        engine: Name of the engine for display; by default `name`.
        version: The engine's version; empty if only the running program reports the version.
        oldest: Oldest supported release. An older release counts as unavailable.
        newest_tried: Newest tested release.
        package: Path of the ``package.json`` of the npm package that the program needs, relative to the manifest.
            Without this file the engine is unavailable. If `version` is empty, the package's version is the engine's
            version.
        command: Command that starts the program. The program runs in an empty folder. A word that begins with ``./`` or
            ``../`` is the path of a file, relative to the manifest's folder.
        install: Command that installs the program's requirements, shown if a requirement is missing. Paths are resolved
            like paths in `command`.
        capabilities: Capabilities of the engine.
        profiles: Profiles by name: at least ``default`` and ``tuned``.
        knobs: Settings that ``carom tune`` may change, with their ranges, by name. Profiles may omit these settings.
    """

    protocol: int = PROTOCOL
    name: str = Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,63}$")
    engine: str = ""
    version: str = ""
    oldest: str = Field("", pattern=r"^([0-9]+(\.[0-9]+)*)?$")
    newest_tried: str = Field("", pattern=r"^([0-9]+(\.[0-9]+)*)?$")
    package: str = ""
    command: tuple[str, ...] = Field(min_length=1)
    install: str = ""
    capabilities: _Capabilities = Capabilities()
    profiles: dict[str, ProgramProfile] = Field(min_length=1)
    knobs: dict[str, _Knob] = {}

    @model_validator(mode="before")
    @classmethod
    def _complete_capabilities(cls, data: Any) -> Any:
        """Add the engine's capabilities to the capabilities of each profile."""
        match data:
            case {"capabilities": dict(shared), "profiles": dict(profiles)}:
                completed = {
                    name: {**profile, "capabilities": {**shared, **own_capabilities}}
                    for name, profile in profiles.items()
                    if isinstance(profile, dict) and isinstance(own_capabilities := profile.get("capabilities"), dict)
                }
                return {**data, "profiles": {**profiles, **completed}}
        return data

    def resolve_command(self, folder: Path) -> tuple[str, ...]:
        """Return the command, with full paths for files that are given relative to the manifest."""
        return tuple(_resolve_argument(folder, argument) for argument in self.command)

    def find_version(self, folder: Path) -> str:
        """Return the engine's version from the manifest or the package; empty if neither contains it."""
        if self.version or not self.package or not (file := folder / self.package).is_file():
            return self.version
        try:
            return str(json.loads(file.read_bytes())["version"])
        except (ValueError, KeyError, TypeError, RecursionError):
            return ""

    def explain_unavailable(self, folder: Path) -> str:
        """Return why the program can't be started on this machine; empty if it can be started.

        The method does not start the program.
        """
        program = self.resolve_command(folder)[0]
        if not shutil.which(program):
            reason = f"{program} is not on the PATH" if program == self.command[0] else f"there is no program {program}"
        elif self.package and not (file := folder / self.package).is_file():
            reason = f"{file.parent.name} is not installed"
        elif self.oldest and is_older(version := self.find_version(folder), self.oldest):
            name = self.engine or self.name
            reason = f"{name} {version} is older than {self.oldest}, the oldest release that its adapter supports"
        else:
            return ""
        install = " ".join(_resolve_argument(folder, argument) for argument in self.install.split(" "))
        return f"{reason}; {install}" if install else reason


def _resolve_argument(folder: Path, argument: str) -> str:
    """Return an argument of a command. A path relative to the manifest is replaced by the full path."""
    return str((folder / argument).resolve()) if argument.startswith(("./", "../")) else argument


def load_manifest(path: Path) -> Manifest:
    """Return the content of a manifest.

    Raises:
        AdapterError: There is no such file, or it is not a valid manifest; the message names the field and the value.
    """
    try:
        manifest = Manifest.model_validate(read_data(path, ".toml"))
    except InputError as error:
        raise AdapterError(f"{path}: {error}") from error
    except ValidationError as error:
        wrong = error.errors(include_url=False)[0]
        place, problem = list(map(str, wrong["loc"])), describe_error(wrong)
        if place[-1:] in _KINDS:
            place, problem = place[:-1], f"must be a number, true, false or a text, got {format_value(wrong['input'])}"
        raise AdapterError(f"{path}: {'.'.join(place) or 'the manifest'}: {problem}", hints=[PAGE]) from error
    if manifest.protocol != PROTOCOL:
        raise AdapterError(
            f"{path}: protocol: this Carom uses version {PROTOCOL}, got {manifest.protocol}", hints=[PAGE]
        )
    return manifest
