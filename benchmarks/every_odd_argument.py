"""Every odd argument in every place of the public face; what goes wrong, and what takes long."""

import argparse
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from odd_arguments import classes, findings, functions, methods


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--draws", type=int, help="odd arguments in each place; all if left out")
    parser.add_argument("names", nargs="*", help="calls to make, all if left out")
    given = parser.parse_args()
    print(f"seed {given.seed}")
    bad = 0
    for call in (*classes(), *methods(), *functions()):
        if given.names and call.name not in given.names:
            continue
        begin = time.perf_counter()
        found = findings(call, given.seed, given.draws)
        bad += len(found)
        print(f"{call.name:45s} {time.perf_counter() - begin:7.2f} s  {len(found)} findings")
        for finding in found:
            print(f"    {finding}")
    print(f"{bad} findings")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
