"""Chunks of work on any executor: threads, processes, or a cluster of dask.distributed.

An executor is what the standard library calls one; ``dask.distributed.Client.get_executor()`` is
one, too. How many workers there are shapes neither the chunks nor what they return.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future, ThreadPoolExecutor
from contextlib import contextmanager, suppress
from itertools import islice
from queue import Empty, SimpleQueue
from typing import Any

from flipflow.errors import IncompleteError, InputError
from flipflow.signals import undisturbed

WINDOW = 256  # chunks handed out at once: enough for a cluster, few to hold
MOST_LOST = 10  # times that the worker of one chunk may be lost
LOOK = 5.0  # s without a finished chunk, after which workers are counted
MOST_LOOKS = 12  # in a row at which all may be gone: one that is started anew takes seconds


@contextmanager
def executor_or_threads(executor: object, threads: int) -> Iterator[Executor]:
    """The executor that was given, left as it is; else threads, which end with the block.

    Raises
    ------
    InputError
        For what is no executor.
    """
    if executor is None:
        own = ThreadPoolExecutor(threads)
        try:
            yield own
        finally:
            with undisturbed():
                own.shutdown(wait=False, cancel_futures=True)
            own.shutdown()
        return
    yield checked_executor(executor)


def checked_executor(executor: object) -> Executor:
    """An executor.

    Raises
    ------
    InputError
        For what is none.
    """
    if not isinstance(executor, Executor):
        remedy = "give an executor of concurrent.futures, as client.get_executor() of dask is one"
        raise InputError("executor", executor, remedy)
    return executor


def run_chunks(
    executor: Executor,
    work: Callable[..., Any],
    tasks: Iterable[tuple[int, tuple[Any, ...]]],
) -> Iterator[tuple[int, Any]]:
    """Yield (index, ``work(*arguments)``) of each task, in the order in which they end.

    Tasks are drawn as there is room for them, while those before are worked on.
    A chunk whose worker is lost is handed out again. When the caller stops, what has not begun is
    not begun.

    Raises
    ------
    IncompleteError
        When a chunk loses its worker again and again, when the executor is gone, and when a
        cluster has lost all its workers for some time.
    """
    waiting: dict[Future[Any], tuple[int, tuple[Any, ...]]] = {}
    # In place of concurrent.futures.wait, within which an interrupt leaves futures locked.
    done: SimpleQueue[Future[Any]] = SimpleQueue()
    lost: dict[int, int] = {}
    todo, cluster = iter(tasks), _Cluster(executor)

    def hand_out(task: tuple[int, tuple[Any, ...]]) -> None:
        with undisturbed():
            future = _submitted(executor, work, task, lost.get(task[0], 0))
            waiting[future] = task
            future.add_done_callback(done.put)

    try:
        while True:
            for task in islice(todo, WINDOW - len(waiting)):
                hand_out(task)
            if not waiting:
                return
            future = cluster.next_of(done)
            index, arguments = waiting.pop(future)
            if _is_lost(future, index, lost):
                hand_out((index, arguments))
            else:
                yield index, future.result()
    finally:
        with undisturbed():
            for future in waiting:
                future.cancel()


class _Cluster:
    """Looks after the workers of an executor of dask; other executors tell of theirs."""

    def __init__(self, executor: Executor) -> None:
        of_dask = isinstance(executor, _loaded("distributed.cfexecutor", "ClientExecutor"))
        self._client = executor._client if of_dask else None  # type: ignore[attr-defined]  # noqa: SLF001  it has no other way to its client
        self._seen, self._looks = False, 0

    def next_of(self, done: SimpleQueue[Future[Any]]) -> Future[Any]:
        """The next chunk that has ended.

        Raises
        ------
        IncompleteError
            When the workers that were there have been gone for a while.
        """
        while True:
            with suppress(Empty):
                future = done.get(timeout=LOOK)
                self._seen, self._looks = True, 0
                return future
            there = self._client is None or self._has_workers(self._client)
            self._seen = self._seen or there
            self._looks = 0 if there else self._looks + 1
            if self._seen and self._looks >= MOST_LOOKS:
                told = f"The cluster has lost all workers, {LOOK * MOST_LOOKS:.0f} s ago"
                raise IncompleteError(f"{told}; start one, and go on.")

    @staticmethod
    def _has_workers(client: Any) -> bool:
        try:
            return bool(client.nthreads())
        except (OSError, ValueError):  # the scheduler is gone, and its futures are about to tell
            return True


def _submitted(
    executor: Executor, work: Callable[..., Any], task: tuple[int, tuple[Any, ...]], lost: int
) -> Future[Any]:
    try:
        return executor.submit(_attempt, lost, work, *task[1])
    except _closed() as error:
        raise IncompleteError(f"The workers are gone ({error}).") from None


def _attempt(_lost: int, work: Callable[..., Any], *arguments: Any) -> Any:
    """The work; to dask, which knows tasks by their arguments, every attempt is one of its own."""
    return work(*arguments)


def _is_lost(future: Future[Any], index: int, lost: dict[int, int]) -> bool:
    """Whether a chunk has to be handed out again, because its worker ended before it did."""
    try:
        error = future.exception()
    except CancelledError:
        raise IncompleteError("The scheduler is gone, and with it the chunks on the way.") from None
    if isinstance(error, BrokenExecutor):
        raise IncompleteError(f"The workers are gone ({error}).")
    if not isinstance(error, _killed()):
        return False
    lost[index] = lost.get(index, 0) + 1
    if lost[index] > MOST_LOST:
        told = f"Chunk {index} ended its worker {MOST_LOST} times: has it memory enough?"
        raise IncompleteError(told)
    return True


def _killed() -> tuple[type[BaseException], ...]:
    """What dask raises of a task whose workers ended; none where dask is not loaded."""
    return _loaded("distributed", "KilledWorker")


def _closed() -> tuple[type[BaseException], ...]:
    """What an executor raises that takes no more work: a broken pool, a closed client of dask."""
    return (RuntimeError, *_loaded("distributed.client", "ClosedClientError"))


def _loaded(module: str, name: str) -> tuple[type[Any], ...]:
    known: Mapping[str, Any] = vars(sys.modules[module]) if module in sys.modules else {}
    return (known[name],) if name in known else ()
