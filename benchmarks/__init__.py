"""Benchmarks of pushplan; README.md lists them."""
