"""The commands of `carom`, one module each. A command parses its options and arguments, calls a study, and prints."""
