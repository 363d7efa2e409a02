"""Run jobs: one episode, or a batch of them in processes with limits."""
