"""Keep what became of jobs: rows, the run directory, what a result depends on."""
