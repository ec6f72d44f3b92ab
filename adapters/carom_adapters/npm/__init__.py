"""Engines from npm. Each folder contains a program for Node that runs an engine and uses the engine protocol.

``docs/reference/engine-protocol.md`` describes the protocol. ``package.json`` contains the versions of the engines, and
``serve.mjs`` contains the code that the programs share. In a checkout, `make engines` installs the engines. In an
installation from a wheel, use the command that ``carom engines`` shows.
"""

from __future__ import annotations

from pathlib import Path

from carom_adapters.npm.settings_code import NpmAdapter

_HERE = Path(__file__).parent

box2d3 = NpmAdapter(_HERE / "box2d3/engine.toml")
cannon = NpmAdapter(_HERE / "cannon/engine.toml")
havok = NpmAdapter(_HERE / "havok/engine.toml")
jolt = NpmAdapter(_HERE / "jolt/engine.toml")
matter = NpmAdapter(_HERE / "matter/engine.toml")
p2 = NpmAdapter(_HERE / "p2/engine.toml")
physx = NpmAdapter(_HERE / "physx/engine.toml")
planck = NpmAdapter(_HERE / "planck/engine.toml")
rapier2d = NpmAdapter(_HERE / "rapier2d/engine.toml")
