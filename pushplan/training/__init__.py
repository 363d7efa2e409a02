"""Making data sets from simulators, training networks, export: not needed to plan or evaluate."""
