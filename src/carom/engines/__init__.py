"""Engines: the interface of adapters, engines that are programs in any language, importers, and the registry."""
