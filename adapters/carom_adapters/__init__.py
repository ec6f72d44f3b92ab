"""Adapters of the bundled engines, a folder per engine. No adapter imports its engine before it prepares a world.

In each folder, `adapter.py` declares engine and profiles, `limits.py` the settings and the range of scenes, `world.py`
runs a scene, and `settings_code.py` writes it as a program of the engine. `shared` has what several engines need.
Carom's own methods are single modules, since they have neither limits nor code of their own.
"""
