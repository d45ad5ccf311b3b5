"""The entry point ``flipflow``: from its first moment on it can be stopped by a sentence."""

from __future__ import annotations

import _thread
import atexit
import codecs
import errno
import gc
import io
import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import FrameType

from flipflow.signals import SIGNALS

STOPPED_CODE = 130
OBJECTS = 50_000  # made since garbage was last looked for
ESCAPED = "flipflow-escaped"  # how letters are shown that an encoding has not
AGAIN = 0.02  # seconds until a dropped interrupt is raised again


def main() -> None:
    """Run the command line; an error is one sentence on stderr and the exit code of its class."""
    sys.stdout = sys.stdout or Closed()
    sys.stderr = sys.stderr or Closed()
    _show_what_it_can(sys.stdout)
    # At the usual pace a fourteenth of an analysis goes into looking for garbage that is not there.
    gc.set_threshold(OBJECTS, 50, 50)
    # Nor is there any at the end, where Python takes a tenth of an analysis to look once more.
    atexit.register(gc.freeze)
    with _stopped_at_once():
        # Loading the commands takes a moment, in which libraries would answer Ctrl-C themselves.
        from flipflow.cli.app import run  # noqa: PLC0415
    with _terminated_as_interrupted(), _never_lost():
        run()


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


def _say_stopped(outcome: str) -> None:
    with suppress(OSError):
        os.write(sys.stderr.fileno(), f"Stopped by the user; {outcome}.\n".encode())


@contextmanager
def _stopped_at_once() -> Iterator[None]:
    """End the process at Ctrl-C or SIGTERM as long as nothing has begun."""

    def end(_number: int, _frame: FrameType | None) -> None:
        _say_stopped("nothing is written")
        os._exit(STOPPED_CODE)

    with _answered(dict.fromkeys(SIGNALS, end)):
        yield


@contextmanager
def _terminated_as_interrupted() -> Iterator[None]:
    """Let SIGTERM do what Ctrl-C does at that moment."""

    def interrupted(number: int, frame: FrameType | None) -> None:
        answer = signal.getsignal(signal.SIGINT)
        if not callable(answer):
            raise KeyboardInterrupt
        answer(number, frame)

    with _answered({signal.SIGTERM: interrupted}):
        yield


@contextmanager
def _never_lost() -> Iterator[None]:
    """Raise an interrupt again that Python drops: it does so within a finalizer or a callback."""
    before, waiting, dropped = sys.unraisablehook, list[threading.Timer](), threading.Event()

    def interrupt() -> None:
        dropped.clear()
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
                raise KeyboardInterrupt
    except KeyboardInterrupt:
        _say_stopped("it had come to its end")
        sys.exit(STOPPED_CODE)
    finally:
        sys.unraisablehook = before
        # An interrupt that passed through code made from text, as dataclasses are, has "python -m"
        # end itself by SIGINT in place of the exit code; running such code forgets it.
        exec("")  # noqa: S102


@contextmanager
def _answered(answers: dict[signal.Signals, object]) -> Iterator[None]:
    """Answer signals in the block; what is ignored, as in a shell's background, stays so."""
    before = {}
    if threading.current_thread() is threading.main_thread():
        for one, answer in answers.items():
            if signal.getsignal(one) is not signal.SIG_IGN:
                before[one] = signal.signal(one, answer)  # type: ignore[arg-type]
    try:
        yield
    finally:
        for one, answer in before.items():
            signal.signal(one, answer)


if __name__ == "__main__":
    main()
