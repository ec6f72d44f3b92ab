"""Adapters of the bundled engines, one folder per engine. An adapter imports its engine only when it prepares a world.

In each folder, `adapter.py` declares the engine and its profiles, and `limits.py` declares the engine's settings and
the supported scenes. `world.py` runs a scene, and `settings_code.py` writes a scene as a program of the engine.
`shared` contains code for several adapters. The adapters of PIC and PIT are single modules.
"""
