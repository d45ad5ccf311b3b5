"""Compile kernels ahead, in processes side by side: numba compiles under one lock in a process.

A module that names parts to compile asks for them with :func:`compile_parts`, and as a program
of its own, ``python -m``, it is the worker: it hands them to :func:`work`.
"""

from __future__ import annotations

import logging
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

from flipflow.compiled.compile import OWN_CACHE, compiled_by
from flipflow.compiled.digest import module_digest
from flipflow.compiled.folders import FOLDERS
from flipflow.signals import undisturbed

logger = logging.getLogger("flipflow")
POLL_SECONDS = 0.2  # between two looks at whether the workers have ended


def compile_parts(module: str, parts: Iterable[str], tell: Callable[[float], None]) -> None:
    """Compile the parts of a module that have not been, a worker each.

    Parameters
    ----------
    module
        Full name of the module that is run as a worker.
    parts
        Names of its parts.
    tell
        Called every fraction of a second with the seconds passed.
    """
    digest = module_digest(module, compiled_by())
    if digest is None or not _can_start_workers():
        return
    missing = [part for part in parts if FOLDERS.read(digest, _mark(part)) is None]
    if not missing:
        return
    # Workers write to it where no other folder takes what they compile.
    lent = FOLDERS.lend_temporary() if OWN_CACHE else None
    if lent is None and FOLDERS.writable(digest) is None:
        return
    done = _run(module, missing, lent, tell)
    borrowed = FOLDERS.take_back_temporary()
    if not done:
        logger.warning("compiling ahead failed; kernels are compiled as they are needed")
    elif not borrowed:
        for part in missing:
            FOLDERS.write(digest, _mark(part), b"")


def work(parts: Mapping[str, Iterable[Callable[[], None]]]) -> None:
    """Be a worker: compile the part that the command line names."""
    part, lent = sys.argv[1:]
    FOLDERS.borrow_temporary(Path(lent) if lent else None)
    for compile_part in parts[part]:
        compile_part()


def _mark(part: str) -> str:
    """Name of the file that says that a part is compiled."""
    return f"{part}-compiled"


def _can_start_workers() -> bool:
    """In a frozen program the interpreter is the program itself."""
    return bool(sys.executable) and not getattr(sys, "frozen", False)


def _worker(
    module: str, part: str, lent: Path | None, environment: Mapping[str, str]
) -> subprocess.Popen[bytes]:
    """Start a worker, which never sees Ctrl-C: its parent answers that, and ends its workers."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        return subprocess.Popen(  # noqa: S603  a module of our own
            [sys.executable, "-P", "-m", module, part, str(lent or "")],
            stdout=subprocess.DEVNULL,
            env=environment,
        )
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _run(module: str, parts: list[str], lent: Path | None, tell: Callable[[float], None]) -> bool:
    """Run a worker for each part to its end; whether all were done."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    workers: list[subprocess.Popen[bytes]] = []
    begin = time.monotonic()
    try:
        for part in parts:
            with undisturbed():
                workers.append(_worker(module, part, lent, environment))
        while any(worker.poll() is None for worker in workers):
            tell(time.monotonic() - begin)
            time.sleep(POLL_SECONDS)
    finally:
        with undisturbed():
            for worker in workers:
                worker.kill()
                worker.wait()
    return all(worker.returncode == 0 for worker in workers)
