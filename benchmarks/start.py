"""How long a user waits: ``--help``, the very first analysis with empty caches, the next ones.

    .venv/bin/python benchmarks/start.py [--runs 5]

Whole processes, wall time, medians; the first analysis uses a cache folder of its own.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time

COMMAND = [sys.executable, "-m", "flipflow.cli.main"]


def seconds(words: list[str], cache: str) -> float:
    """Wall time of one process."""
    with tempfile.TemporaryDirectory() as folder:
        begin = time.perf_counter()
        subprocess.run(
            [*COMMAND, *words], cwd=folder, check=True, capture_output=True,
            env={**os.environ, "FLIPFLOW_CACHE_DIR": cache},
        )  # fmt: skip
        return time.perf_counter() - begin


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=5)
    runs = parser.parse_args().runs
    with tempfile.TemporaryDirectory() as cache:
        first = seconds(["analyze", "ffs0827"], cache)
        later = [seconds(["analyze", "ffs0827"], cache) for _ in range(runs)]
        helps = [seconds(["--help"], cache) for _ in range(runs)]
    print(
        json.dumps(
            {
                "help_s": round(statistics.median(helps), 3),
                "first_analyze_s": round(first, 2),
                "later_analyze_s": round(statistics.median(later), 2),
                "targets_s": {"help": 0.3, "first_analyze": 30.0, "later_analyze": 3.0},
            },
            indent=2,
        )
    )


if __name__ == "__main__":
    main()
