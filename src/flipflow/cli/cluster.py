"""Where a study is computed: threads of this process, worker processes, or a cluster of dask."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, Any

from flipflow.errors import InputError, required
from flipflow.signals import undisturbed

if TYPE_CHECKING:
    from concurrent.futures import Executor

SCHEDULER, WORKERS = "--scheduler", "--workers"
PATIENCE = 20.0  # s to wait for a scheduler
QUIET = 51  # above all levels of logging: what fails in dask is raised


@contextmanager
def executor_of(workers: int | None, scheduler: str | None) -> Iterator[Executor | None]:
    """The executor that options ask for; None: threads.

    Raises
    ------
    InputError
        For both options together, and where no scheduler answers.
    MissingExtra
        When dask.distributed is not installed.
    """
    if workers is None and scheduler is None:
        yield None
        return
    if workers is not None and scheduler is not None:
        remedy = f"{SCHEDULER} has workers of its own, leave one of the two out"
        raise InputError(WORKERS, workers, remedy)
    distributed = required("distributed", "Worker processes need dask.distributed", "study")
    if scheduler is not None:
        with _client(distributed, scheduler) as client:
            yield client.get_executor()
        return
    # What dask is interrupted in while it starts or closes, it waits for in vain.
    own = ExitStack()
    try:
        with undisturbed():
            with _deaf_to_ctrl_c():
                cluster = distributed.LocalCluster(
                    n_workers=workers, threads_per_worker=1, processes=True,
                    dashboard_address=":0", silence_logs=QUIET,
                )  # fmt: skip
            own.enter_context(cluster)
            client = own.enter_context(distributed.Client(cluster))
        yield client.get_executor()
    finally:
        with undisturbed():
            own.close()


@contextmanager
def _deaf_to_ctrl_c() -> Iterator[None]:
    """Have processes that are started in the block leave Ctrl-C to this one, which ends them.

    A terminal sends it to all of them. Here it waits for the end of the block.
    """
    from multiprocessing import resource_tracker  # noqa: PLC0415  keeps --help quick

    resource_tracker.ensure_running()  # which, started later, would let the signal through
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _client(distributed: Any, scheduler: str) -> Any:
    try:
        return distributed.Client(scheduler, timeout=PATIENCE)
    except (OSError, ValueError, TimeoutError) as error:
        reason = " ".join(str(error).split())[:80] or type(error).__name__
        remedy = f"no scheduler answers there ({reason}), give the address that dask shows"
        raise InputError(SCHEDULER, scheduler, remedy) from None
