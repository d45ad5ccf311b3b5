"""Random plausible screens: what is told of them against event-located integration, by kind."""

import argparse
import json
import sys
import time
from collections import Counter

from one_core import stay_on_one_core
from plausible_draw import KINDS, examine, wrong


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--screens", type=int, default=600)
    parser.add_argument("--first", type=int, default=0, help="number of the first screen")
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    print(f"seed {given.seed}")
    begin, counts, bad = time.perf_counter(), Counter(), 0
    for number in range(given.first, given.first + given.screens):
        record = examine(given.seed, number)
        counts[record["kind"], record["working"]["told"]] += 1
        counts[record["kind"], "part of the region"] += "outside" in record
        for sentence in wrong(record):
            bad += 1
            print(f"screen {number}, {record['kind']}: {sentence}: {json.dumps(record)}")
    heads = ("stable", "unstable", "undetermined", "none", "part of the region")
    print("".join(f"{head:>20}" for head in ("kind", *heads)))
    for kind in KINDS:
        print(f"{kind:>20}" + "".join(f"{counts[kind, head]:>20}" for head in heads))
    print(f"{bad} contradicted or without an answer, {time.perf_counter() - begin:.0f} s")
    return 1 if bad else 0


if __name__ == "__main__":
    stay_on_one_core()
    sys.exit(main())
