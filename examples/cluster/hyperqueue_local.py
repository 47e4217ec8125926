# SPDX-License-Identifier: Apache-2.0
"""Makes an animation, or a hologram in tiles, by workers of HyperQueue (pip install hyperqueue), each with its own core.

usage: hyperqueue_local.py [--workers N] [--each TIME] SCENE OUT [options of animate or render ...]

A server that runs already, with workers on many machines, takes the same job: put
`hyperqueue.Client(server_dir)` in the place of LocalCluster.
"""

import argparse
import json
import subprocess
from pathlib import Path

from hyperqueue import Job, LocalCluster
from hyperqueue.cluster import WorkerConfig


def job_of(scene, out, each, options):
    """A task for each part, and one that puts them together and makes the videos."""
    call = ["raywave", "units", scene, "--each", each, "--quiet", "--json", "-", *options]
    units = json.loads(subprocess.run(call, check=True, stdout=subprocess.PIPE).stdout)
    command = [*units["command"], "--quiet", "-o", str(Path(out).resolve())]
    job = Job(max_fails=0)
    where = {"cwd": str(Path.cwd()), "stdout": None, "stderr": None}
    parts = [job.program([*command, units["part"], unit["part"]], **where)
             for unit in units["units"]]
    job.program([*command, units["part"], "all"], deps=parts, **where)
    return job


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--each", default="10s")
    parser.add_argument("scene")
    parser.add_argument("out")
    arguments, options = parser.parse_known_args()
    job = job_of(arguments.scene, arguments.out, arguments.each, options)
    with LocalCluster() as cluster:
        for _ in range(arguments.workers):
            cluster.start_worker(WorkerConfig(cores=1))
        client = cluster.client()
        client.wait_for_jobs([client.submit(job)])
