"""Study: changes between releases of an engine.

Releases are installed from the engine's registry, and run with the installed adapter.
"""
