"""Engines from npm, each a program of node behind the protocol of ``docs/engine-protocol.md``: a folder for each.

``package.json`` has their versions, ``serve.mjs`` what their programs share. `make engines` installs them; from a wheel
the command that ``carom engines`` shows does.
"""

from __future__ import annotations

from pathlib import Path

from carom.program.adapter import program_adapter

__all__ = ["planck"]

_HERE = Path(__file__).parent

planck = program_adapter(_HERE / "planck/engine.toml")
