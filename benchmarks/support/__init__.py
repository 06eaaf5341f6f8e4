"""What benchmarks share, and scripts that compare two states of the code."""
