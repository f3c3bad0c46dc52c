"""A data set on a Dask cluster: python launch_dask.py plan.toml OUT SHARDS"""
import sys

import wakescope
from dask.distributed import Client, LocalCluster


def run_shard(number):
    return wakescope.dataset(plan, out=out, shard=f"{number}/{shards}", resume=True, threads=1)


plan, out, shards = sys.argv[1], sys.argv[2], int(sys.argv[3])
if __name__ == "__main__":
    with LocalCluster(threads_per_worker=1) as cluster, Client(cluster) as client:  # or dask_jobqueue.SLURMCluster
        # The shard of a worker that dies is run again by another one, and keeps its chunks.
        client.gather(client.map(run_shard, range(1, shards + 1), pure=False))
