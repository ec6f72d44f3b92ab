"""The scenes of the catalogue: a module is a group, or a part of one. The first word of its name is the group."""
