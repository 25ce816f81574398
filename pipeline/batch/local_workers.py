"""Worker processes of this machine: started, replaced when they die, ended."""

# distributed leaves most of its functions without types.
# mypy: disable-error-code="no-untyped-call"

from __future__ import annotations

import logging
import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import partial

import dask
from distributed import Client, LocalCluster
from distributed.core import Status
from tornado.ioloop import PeriodicCallback

from pipeline.batch.interrupts import deaf

RENEWAL_SECONDS = 0.5
# how often the cluster and its scheduler, in the same process, tell each other what they know
SYNC_SECONDS = 30

# allowed-failures counts deaths of a worker, retries would count exceptions; saturation 1 gives a worker no
# task beside the one it runs, which could be taken for the cause of its death. A cluster closes a worker it
# has not seen for the lost-worker time-out, also one that is just starting again; `_renew` knows better.
SETTINGS = {
    "distributed.scheduler.allowed-failures": 1,
    "distributed.scheduler.worker-saturation": 1.0,
    "distributed.deploy.lost-worker-timeout": "1 day",
    # paused, a worker would wait for ever for room that only a run beside it could free, and there is none
    "distributed.worker.memory.target": False,
    "distributed.worker.memory.spill": False,
    "distributed.worker.memory.pause": False,
    "distributed.worker.preload": ["pipeline.batch.task"],
    "distributed.nanny.pre-spawn-environ.NUMBA_NUM_THREADS": 1,
    # looking at itself ten to a hundred times a second takes a tenth of the time of short runs
    "distributed.worker.profile.enabled": False,
    "distributed.worker.memory.monitor-interval": "2s",
    "distributed.admin.tick.interval": "5s",
    "distributed.admin.tick.cycle": "5s",
    "distributed.admin.system-monitor.interval": "5s",
    # no result is kept, so that none has copies
    "distributed.scheduler.active-memory-manager.start": False,
    # the last messages are kept, and with them the jobs that they carry
    "distributed.admin.low-level-log-length": 10,
    # a worker has no task beside the one it runs
    "distributed.scheduler.work-stealing": False,
}


@contextmanager
def workers(count: int) -> Iterator[Client]:
    """Start worker processes of one thread each, and end them; killed at once on a KeyboardInterrupt.

    A process that dies is started again by its nanny, or with a new one where the nanny gives up.

    Raises
    ------
    OSError
        If they do not start.
    """
    # for good: what is told of processes killed at once may come after the cluster is gone
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    with dask.config.set(SETTINGS):
        cluster = _cluster(count)
        keeper = PeriodicCallback(partial(_renew, cluster, count), 1000 * RENEWAL_SECONDS)
        loop, client = cluster.loop, None
        assert loop is not None
        try:
            client = Client(cluster)
            loop.add_callback(keeper.start)
            yield client
        except KeyboardInterrupt:
            # what is killed now is not to be renewed
            loop.add_callback(keeper.stop)
            _kill(cluster)
            raise
        finally:
            loop.add_callback(keeper.stop)
            _end(client, cluster)


def _end(client: Client | None, cluster: LocalCluster) -> None:
    """End client and workers; these by force where they do not end in the time they are given.

    On a machine under load they may not, which says nothing of the batch: all it did is written.
    """
    try:
        if client is not None:
            client.close()
        cluster.close()
    except (TimeoutError, AssertionError, OSError):
        _kill(cluster)


def _kill(cluster: LocalCluster) -> None:
    for nanny in list(cluster.workers.values()):
        nanny.auto_restart = False
        if nanny.pid is not None:
            with suppress(ProcessLookupError):
                os.kill(nanny.pid, signal.SIGKILL)


def _renew(cluster: LocalCluster, count: int) -> None:
    """Replace nannies that have given up, as they do when a new process dies of a task at once."""
    for name, nanny in list(cluster.workers.items()):
        if nanny.status in (Status.failed, Status.closed):
            del cluster.workers[name]
    if len(cluster.workers) < count:
        cluster.scale(count)


def _cluster(count: int) -> LocalCluster:
    try:
        with deaf():
            return LocalCluster(
                n_workers=count,
                threads_per_worker=1,
                dashboard_address="127.0.0.1:0",
                scheduler_sync_interval=SYNC_SECONDS,
                silence_logs=logging.CRITICAL,
            )
    except RuntimeError as error:
        raise OSError(f"the worker processes do not start: {error.__cause__ or error}") from error
