"""Worker processes: how they are started, fed with tasks, watched and ended."""
