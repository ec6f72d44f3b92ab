"""What got better and worse between two cross-checks."""
