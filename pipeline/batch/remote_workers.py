"""Workers that are not started here: of a running Dask cluster, or jobs of a queueing system."""

# distributed leaves most of its functions without types.
# mypy: disable-error-code="no-untyped-call"

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import dask
from distributed import Client

from pipeline.batch.local_workers import SETTINGS
from pipeline.errors import EngineError as EngineError
from pipeline.store import provenance

CONNECTING_SECONDS = 10
QUEUEING_SECONDS = 24 * 3600


@contextmanager
def joined(address: str, width: int) -> Iterator[Client]:
    """Join a running cluster.

    Parameters
    ----------
    address : str
        Of its scheduler, as ``tcp://host:port``.
    width : int
        Jobs there are; as many workers as the cluster has are used.

    Raises
    ------
    EngineError
        If the scheduler does not answer, has no workers, or one of them has other software.
    """
    try:
        client = Client(address, timeout=CONNECTING_SECONDS, set_as_default=False)
    except (OSError, ValueError) as error:
        raise EngineError(f"{address}: the scheduler does not answer: {error}") from error
    with client:
        if not client.nthreads():
            raise EngineError(f"{address}: the scheduler has no workers")
        check(client)
        yield client


def check(client: Client) -> None:
    """Refuse workers whose software is not that of the driver.

    Raises
    ------
    EngineError
        With a line for every difference.
    """
    try:
        found: dict[str, Any] = client.run(_environment)
    except Exception as error:
        raise EngineError(f"the workers cannot load lmls: {type(error).__name__}: {error}") from error
    here = provenance.environment()
    lines = [
        f"worker {address}: {key} is {provenance.short(there.get(key))}, here {provenance.short(here[key])}"
        for address, there in sorted(found.items())
        for key in here
        if there.get(key) != here[key]
    ]
    if lines:
        raise EngineError("\n".join(lines))


def _environment() -> dict[str, str]:
    return provenance.environment()


@contextmanager
def queued(kind: str, count: int, width: int) -> Iterator[Client]:
    """Have a queueing system start workers, one a job, by what ``jobqueue.yaml`` of Dask says of it.

    Parameters
    ----------
    kind : str
        ``slurm``.
    count : int
        Workers at most.
    width : int
        Jobs there are.

    Raises
    ------
    EngineError
        If dask-jobqueue is not installed or no worker comes.
    """
    with dask.config.set(SETTINGS), cluster(kind) as started:
        started.scale(min(count, width))
        with Client(started, set_as_default=False) as client:
            client.wait_for_workers(1, timeout=QUEUEING_SECONDS)
            check(client)
            yield client


def cluster(kind: str) -> Any:
    """Make the cluster of a queueing system, without workers yet.

    Raises
    ------
    EngineError
        If dask-jobqueue is not installed.
    """
    try:
        from dask_jobqueue.slurm import SLURMCluster
    except ImportError:
        raise EngineError("--jobqueue needs dask-jobqueue: pip install 'lmls[jobqueue]'") from None
    kinds: dict[str, Any] = {"slurm": SLURMCluster}
    given = dask.config.get(f"jobqueue.{kind}", {})
    # the port of the dashboard is whichever is free
    options = {"scheduler_options": {"dashboard_address": ":0"}}
    defaults = {"cores": 1, "processes": 1, "memory": "2GB", **options}
    asked = {name for name, value in given.items() if value}
    chosen = {k: v for k, v in defaults.items() if not {k, k.replace("_", "-")} & asked}
    return kinds[kind](**chosen)
