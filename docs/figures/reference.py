"""Reference pages that the site generates: commands from their declarations, the scene file from its schema."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import typer

import carom
from carom.cli import app

SCHEMA = Path(carom.__file__).with_name("scene.schema.json")


def cell(text: str) -> str:
    """Return a text as one cell of a table."""
    return " ".join(text.replace("|", "\\|").split())


def commands_page() -> str:
    """Return a page with the help of each command and a table of its options."""
    commands: dict[str, Any] = vars(typer.main.get_command(app))["commands"]
    parts = [
        "# Commands\n\nThis page shows the help texts of all commands. `carom COMMAND --help` prints one of them.\n"
    ]
    for name, command in commands.items():
        with typer.Context(command, info_name=name) as context:
            records = [record for one in command.get_params(context) if (record := one.get_help_record(context))]
        rows = [f"| `{cell(option)}` | {cell(text)} |" for option, text in records]
        parts += [f"## carom {name}\n\n{command.help}\n", "| option | meaning |\n| --- | --- |", *rows, ""]
    return "\n".join(parts)


def _attributes(description: str) -> tuple[str, dict[str, str]]:
    """Return the summary of a docstring, and its description of each attribute."""
    summary, _, listed = description.partition("\n\nAttributes:\n")
    found = re.findall(r"^    (\w+): (.*(?:\n        .*)*)", listed, re.MULTILINE)
    return summary, dict(found)


def _kind(schema: dict[str, Any]) -> str:
    """Return the type of a value in words."""
    if "$ref" in schema:
        return str(schema["$ref"]).rpartition("/")[2]
    if "enum" in schema:
        return " or ".join(map(str, schema["enum"]))
    if "anyOf" in schema:
        return " or ".join(dict.fromkeys(_kind(one) for one in schema["anyOf"]))
    if schema.get("type") == "array":
        inner = _kind(schema["items"]) if isinstance(schema.get("items"), dict) else "numbers"
        return f"list of {inner}"
    return str(schema.get("type", "value"))


def scene_page() -> str:
    """Return a page with the fields of a scene file, object by object."""
    schema = json.loads(SCHEMA.read_text(encoding="utf-8"))
    parts = [
        "# Scene file\n\nA scene is a TOML or JSON file. This page is generated from the JSON Schema, which\n"
        "`carom scenes --schema` prints.\n"
    ]
    for name, one in {"Scene": schema, **schema["$defs"]}.items():
        summary, said = _attributes(one["description"])
        parts += [f"## {name}\n\n{cell(summary)}\n", "| field | type | default | meaning |\n| --- | --- | --- | --- |"]
        for field, what in one["properties"].items():
            default = (
                json.dumps(what["default"]) if "default" in what else "required" if field in one["required"] else "none"
            )
            meaning = cell(said.get(field, what.get("description", "")))
            parts.append(f"| `{field}` | {_kind(what)} | `{default}` | {meaning} |")
        parts.append("")
    return "\n".join(parts)
