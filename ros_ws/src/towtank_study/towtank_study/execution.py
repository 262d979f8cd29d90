# SPDX-License-Identifier: Apache-2.0
"""Evaluating a function over many samples: on all cores, or on a Dask cluster.

The function must be picklable, and the same sample must always give the same outcome: then it does
not matter where, and beside which others, it is evaluated.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import multiprocessing.connection
import os
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from typing import TypeVar

from towtank_study.errors import StudyError

Argument = TypeVar("Argument")
Outcome = TypeVar("Outcome")

_CHUNK_LIMIT = 16  # samples that may have to be done again after a kill, for each worker
_ONE_THREAD = {name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")}


def evaluate_all(
    function: Callable[[int, Argument], Outcome],
    samples: Sequence[tuple[int, Argument]],
    executor: Executor,
    workers: int,
) -> Iterator[list[Outcome]]:
    """Yield the outcomes of `function(number, argument)` chunk by chunk, as they get ready.

    samples: number and argument of each. workers: how many work at a time. Closing the iterator
    early cancels what has not begun.
    """
    size = max(1, min(_CHUNK_LIMIT, len(samples) // (4 * workers)))
    chunks = [samples[start : start + size] for start in range(0, len(samples), size)]
    futures = [executor.submit(_evaluate_chunk, function, chunk) for chunk in chunks]
    try:
        for future in as_completed(futures):
            yield future.result()
    except BrokenProcessPool:
        raise StudyError(
            "a worker process died (out of memory?); start the same command again to go on, "
            "with fewer --workers"
        ) from None
    finally:
        for future in futures:
            future.cancel()


def _evaluate_chunk(
    function: Callable[[int, Argument], Outcome], chunk: Sequence[tuple[int, Argument]]
) -> list[Outcome]:
    return [function(number, argument) for number, argument in chunk]


@contextlib.contextmanager
def local_pool(workers: int) -> Iterator[Executor]:
    """Processes on this machine, with one BLAS thread each. They end with the process that made
    them, whatever ends it."""
    context = multiprocessing.get_context("spawn")
    with _environment(_ONE_THREAD):  # read when a new process loads its libraries
        pool = ProcessPoolExecutor(workers, mp_context=context, initializer=_prepare_worker)
        try:
            yield pool
        finally:
            pool.shutdown(cancel_futures=True)


@contextlib.contextmanager
def dask_cluster(address: str) -> Iterator[tuple[Executor, int]]:
    """The workers of the Dask scheduler at an address, and how many threads they have in all.

    towtank must be installed there. StudyError if nobody answers or no worker is there.
    """
    from distributed import Client  # half a second that a local study need not spend

    try:
        client = Client(address, timeout=10, set_as_default=False)
    except (OSError, ValueError) as error:
        raise StudyError(
            f"no Dask scheduler at {address} ({error}); check the address and that it runs"
        ) from None
    with client:
        threads = sum(client.nthreads().values())
        if threads == 0:
            raise StudyError(f"the Dask scheduler at {address} has no workers; start some")
        yield client.get_executor(pure=False), threads


def _prepare_worker() -> None:
    # Ctrl-C reaches every process of a terminal; the parent decides.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None
    multiprocessing.connection.wait([parent.sentinel])
    os._exit(1)  # a parent that was killed could not stop its workers


@contextlib.contextmanager
def _environment(changes: dict[str, str]) -> Iterator[None]:
    before = {name: os.environ.get(name) for name in changes}
    os.environ.update(changes)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
