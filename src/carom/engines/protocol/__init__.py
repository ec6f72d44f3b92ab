"""Engines that are separate programs in any language.

Carom communicates with such a program over its standard input and output.

`manifest` describes a program without starting it. `messages` defines the protocol. `process` is the running program,
and `adapter` makes an adapter of it. ``docs/reference/engine-protocol.md`` describes the protocol for authors of
programs.
"""
