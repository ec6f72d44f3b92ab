"""Mutation tests: faults in the numerics that the tests of their package should notice (`make mutants`)."""
