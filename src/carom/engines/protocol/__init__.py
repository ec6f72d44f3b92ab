"""An engine that is a program of its own, in any language: it reads requests from standard input, and answers.

`manifest` says what the program is without starting it, `messages` is the protocol, `process` the program while it
runs, and `adapter` puts it behind the seam. ``docs/reference/engine-protocol.md`` tells the protocol to who writes a
program.
"""
