"""General helpers: options, checks, formatting, limits, folders, versions, and the system."""
