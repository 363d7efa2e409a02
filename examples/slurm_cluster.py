"""A study on a SLURM cluster, through Dask.

    pip install -e ".[sim,plots,cluster]"
    python slurm_cluster.py study.yaml runs/study

Run it on a login node, or in a small job of its own. It starts workers as SLURM jobs, hands them
episodes, and stores results as they come. Killed, it goes on when it is started again. Folder,
experiment file and the files that it names have to be on a disk that all nodes see.
"""

from __future__ import annotations

import sys

from dask_jobqueue import SLURMCluster

from pushplan.evaluation import Experiment


def cluster() -> SLURMCluster:
    """Workers of one node each: change these to what your cluster has."""
    return SLURMCluster(
        cores=16,  # of a node
        processes=16,  # an episode uses one core
        memory="64GB",
        walltime="04:00:00",
        queue="normal",
        job_extra_directives=["--exclusive"],
    )


if __name__ == "__main__":
    study, out = sys.argv[1:]
    with cluster() as nodes:
        nodes.scale(jobs=4)
        print(Experiment.load(study).run(out, dask=nodes.scheduler_address).table())
