"""Runs engines that are separate programs, in any language.

Carom communicates with a program over the program's standard input and output.

The module `manifest` reads the description of a program, without starting it. `messages` defines the protocol.
`process` runs the program, and `adapter` makes the program usable like any other engine. For authors of programs,
``docs/reference/engine-protocol.md`` describes the protocol.
"""
