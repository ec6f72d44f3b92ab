"""The impact: what it does, what is recorded of it, and which impacts have no unique answer. Compiled once, for all."""
