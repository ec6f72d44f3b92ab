"""What the adapters cost: benchmarks that import engines, which the core may not."""
