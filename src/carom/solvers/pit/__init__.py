"""PIT, the periodic interference test (discrete detection), for any number of discs."""
