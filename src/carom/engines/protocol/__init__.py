"""Engines that are separate programs in any language.

Carom communicates with such a program over its standard input and output.

`manifest` reads the description of a program without starting it. `messages` defines the protocol. `process` runs the
program, and `adapter` contains the program's adapter. For authors of such programs,
``docs/reference/engine-protocol.md`` describes the protocol.
"""
