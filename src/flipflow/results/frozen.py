"""What goes along when a result is copied or sent to another process."""

from __future__ import annotations

import dataclasses
from typing import Any


class Frozen:
    """A frozen dataclass whose copies hold its fields alone.

    What was worked out when it was asked for stays behind: another thread may be adding to it.
    """

    def __getstate__(self) -> dict[str, object]:
        """The fields."""
        own: Any = self
        return {field.name: getattr(own, field.name) for field in dataclasses.fields(own)}
