"""Estimates, tests and summaries of the rows of a run."""
