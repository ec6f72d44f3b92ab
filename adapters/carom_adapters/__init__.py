"""The adapters that come with Carom, one module an engine. None imports its engine before a world is prepared."""
