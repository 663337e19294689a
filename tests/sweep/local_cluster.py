"""A local dask cluster for tests that kill its workers: prints its address and ends with its input.

Usage: python local_cluster.py WORKERS [PRELOAD]; the file PRELOAD is run by each worker when it starts.
"""

import json
import os
import sys


def main() -> None:
    import dask
    from distributed import Client, LocalCluster

    # Otherwise a cluster of this kind closes the nanny of a worker that happens to be on its way back.
    dask.config.set({"distributed.deploy.lost-worker-timeout": "1 hour"})
    preload = sys.argv[2:]
    with (
        LocalCluster(
            n_workers=int(sys.argv[1]),
            threads_per_worker=1,
            processes=True,
            host="127.0.0.1",
            dashboard_address=None,
            preload=preload,
            silence_logs=50,
        ) as cluster,
        Client(cluster) as client,
    ):
        told = {
            "address": cluster.scheduler_address,
            "workers": list(client.run(os.getpid).values()),
            "scheduler": os.getpid(),
        }
        sys.stdout.write(json.dumps(told) + "\n")
        sys.stdout.flush()
        sys.stdin.read()


if __name__ == "__main__":
    main()
