"""The entry point ``flipflow``: from its first moment on it can be stopped by a sentence."""

from __future__ import annotations

import _thread
import atexit
import codecs
import errno
import gc
import io
import math
import os
import signal
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import FrameType

from flipflow.cli.outcome import NOTHING, OUTCOME, STOPPED
from flipflow.errors import Cancelled, FlipflowError

OBJECTS = 50_000  # made since garbage was last looked for
ESCAPED = "flipflow-escaped"  # how letters are shown that an encoding has not
AGAIN = 0.02  # seconds until a dropped interrupt is raised again
MOMENT = 0.5  # seconds after an interrupt in which another signal is the same wish


def main() -> None:
    """Run the command line; an error is one sentence on stderr and the exit code of its class.

    Once that is said, Ctrl-C and SIGTERM change nothing: the process is about to end.
    """
    sys.stdout = sys.stdout or Closed()
    sys.stderr = sys.stderr or Closed()
    _show_what_it_can(sys.stdout)
    # At the usual pace a fourteenth of an analysis goes into looking for garbage that is not there.
    gc.set_threshold(OBJECTS, 50, 50)
    # Nor is there any at the end, where Python takes a tenth of an analysis to look once more.
    atexit.register(gc.freeze)
    OUTCOME.clear()
    answers = _Answers()
    with answers.in_force():
        # Loading the commands takes a moment, in which libraries would answer Ctrl-C themselves.
        from flipflow.cli.app import run, said  # noqa: PLC0415

        try:
            try:
                answers.loaded = True
                with _never_lost(answers):
                    run()
            finally:
                answers.ended = True
        except (KeyboardInterrupt, FlipflowError, OSError) as error:
            code = said(error)
        else:
            return
        sys.exit(code)


class _Answers:
    """What Ctrl-C and SIGTERM do: end the process, interrupt a command, or nothing.

    The handlers stay the same, and plain flags say which: between two handlers a signal would find
    that of Python.
    """

    def __init__(self) -> None:
        self.loaded = self.ended = False
        self.raised = -math.inf

    @contextmanager
    def in_force(self) -> Iterator[None]:
        """Answer signals in the block, and none after it.

        What is ignored, as in a shell's background, stays so.
        """
        answers = {signal.SIGINT: self._interrupted, signal.SIGTERM: self._terminated}
        if threading.current_thread() is not threading.main_thread():
            answers = {}
        for one, answer in answers.items():
            if signal.getsignal(one) is not signal.SIG_IGN:
                signal.signal(one, answer)
        try:
            yield
        finally:
            self.ended = True
            for one in answers:
                signal.signal(one, signal.SIG_IGN)
            # An interrupt that passed through code made from text, as dataclasses are, has
            # "python -m" end itself by SIGINT in place of the exit code; running such code forgets
            # it.
            exec("")  # noqa: S102

    def _interrupted(self, _number: int, _frame: FrameType | None) -> None:
        if self.ended:
            return
        if self.loaded:
            # Whoever sends two at once would else interrupt what the first has cleared away.
            now = time.monotonic()
            if now - self.raised < MOMENT:
                return
            self.raised = now
            raise KeyboardInterrupt
        self.ended = True
        with suppress(OSError):
            os.write(sys.stderr.fileno(), f"{STOPPED}; {NOTHING}.\n".encode())
        os._exit(Cancelled.exit_code)

    def _terminated(self, number: int, frame: FrameType | None) -> None:
        """Do what Ctrl-C does at that moment."""
        answer = signal.getsignal(signal.SIGINT)
        (answer if callable(answer) else self._interrupted)(number, frame)


class Closed(io.TextIOBase):
    """A terminal that the caller has closed: nothing can be shown on it."""

    encoding, errors = "utf-8", "backslashreplace"

    def write(self, _text: str) -> int:
        """Say that it is closed."""
        raise OSError(errno.EBADF, os.strerror(errno.EBADF))

    def fileno(self) -> int:
        """Say that it is closed."""
        raise OSError(errno.EBADF, os.strerror(errno.EBADF))


def _show_what_it_can(stream: object) -> None:
    """Escape letters that the encoding of a terminal or a pipe has not, in place of an error."""
    if isinstance(stream, io.TextIOWrapper) and codecs.lookup(stream.encoding).name != "utf-8":
        codecs.register_error(ESCAPED, _escaped)
        stream.reconfigure(errors=ESCAPED)


def _escaped(error: UnicodeError) -> tuple[str, int]:
    r"""Letters as \uXXXX: so a JSON document on the terminal stays one."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    digits = error.object[error.start : error.end].encode("utf-16-be", "surrogatepass").hex()
    return "".join(f"\\u{digits[k : k + 4]}" for k in range(0, len(digits), 4)), error.end


@contextmanager
def _never_lost(answers: _Answers) -> Iterator[None]:
    """Raise an interrupt again that Python drops: it does so within a finalizer or a callback."""
    before, waiting, dropped = sys.unraisablehook, list[threading.Timer](), threading.Event()

    def interrupt() -> None:
        dropped.clear()
        answers.raised = -math.inf
        _thread.interrupt_main()

    def again(one: sys.UnraisableHookArgs) -> None:
        if not issubclass(one.exc_type, KeyboardInterrupt):
            before(one)
            return
        dropped.set()
        # From another thread, after a moment: here it would be dropped once more.
        later = threading.Timer(AGAIN, interrupt)
        later.daemon = True
        waiting.append(later)
        later.start()

    sys.unraisablehook = again
    code: object = None
    try:
        try:
            yield
        except SystemExit as ended:
            code = ended.code
            raise
        finally:
            for later in waiting:
                later.cancel()
            for later in waiting:
                later.join()
            # An error has its own code, and keeps it.
            if dropped.is_set() and not code:
                raise Cancelled(f"{STOPPED}; it had come to its end.")
    finally:
        sys.unraisablehook = before


if __name__ == "__main__":
    main()
