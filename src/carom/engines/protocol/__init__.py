"""Runs engines that are separate programs, in any language.

Carom communicates with such a program over its standard input and output.

The module `manifest` reads the description of a program, without starting it. `messages` defines the protocol.
`process` runs the program, and `adapter` makes the program usable like any other engine. For authors of such programs,
``docs/reference/engine-protocol.md`` describes the protocol.
"""
