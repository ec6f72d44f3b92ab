"""The scenes of the catalogue. Each module is a group or a part of a group. The first word of its name is the group."""
