"""The scenes of the catalogue.

Each module is a group or a part of a group. The first word of the module's name is the name of the group.
"""
