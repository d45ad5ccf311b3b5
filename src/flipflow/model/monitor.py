"""What long work tells while it runs."""

from __future__ import annotations

from collections.abc import Callable

# Called with a sentence and the share done, 0 to 1; what it raises, as Cancelled, ends the work.
Monitor = Callable[[str, float], None]


def silent(_sentence: str, _share: float) -> None:
    """A monitor that tells nobody."""
