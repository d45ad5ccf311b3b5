"""A seeded fuzz of machine files, result files and calls of the public face; what goes wrong."""

import argparse
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from fuzz import findings

COUNTS = {"machine files": 3000, "result files": 2500, "calls": 20_000}


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--share", type=float, default=1.0, help="of the usual numbers of cases")
    parser.add_argument("kinds", nargs="*", help=f"of {', '.join(COUNTS)}; all if left out")
    given = parser.parse_args()
    print(f"seed {given.seed}")
    bad = 0
    for kind in given.kinds or COUNTS:
        begin, count = time.perf_counter(), round(given.share * COUNTS[kind])
        found = 0
        with tempfile.TemporaryDirectory() as folder:
            for finding in findings(kind, given.seed, range(count), Path(folder)):
                print(finding, flush=True)
                found += 1
        print(f"{count} {kind}: {found} findings, {time.perf_counter() - begin:.0f} s", flush=True)
        bad += found
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
