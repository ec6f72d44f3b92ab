"""PIT, periodic interference test: Algorithm 1 for any number of discs."""
