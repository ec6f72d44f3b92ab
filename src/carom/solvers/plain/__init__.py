"""All pairs on plain floats: Algorithm 2, the oracle of the kernel, and what runs without a compiler."""
