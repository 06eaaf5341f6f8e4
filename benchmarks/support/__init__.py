"""What benchmarks share, and scripts that compare one state of the code with another."""
