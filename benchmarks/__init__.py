"""Figures, not timed tests: ``python -m benchmarks NAME`` prints one JSON object, last line."""
