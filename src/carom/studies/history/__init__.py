"""Study: changes between releases of an engine. Releases come from its registry and run with the present adapter."""
