"""What has nothing to do with discs: options, checks, formatting, limits, folders, versions, and the system."""
