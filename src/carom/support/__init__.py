"""Support without discs: options, checks, formatting, limits, folders, versions, and the system."""
