"""Adapters of the bundled engines, one folder per engine. An adapter imports its engine only when it prepares a world.

In each folder, `adapter.py` declares engine and profiles, and `limits.py` the settings and the range of scenes.
`world.py` runs a scene, and `settings_code.py` writes it as a program of the engine. `shared` contains what several
engines need. Carom's own methods are single modules, since they have no limits and write no code.
"""
