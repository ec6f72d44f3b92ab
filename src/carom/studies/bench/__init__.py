"""Study: measures error against run time, and run time against the number of discs."""
