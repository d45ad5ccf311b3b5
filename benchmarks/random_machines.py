"""A thousand random machines by both methods; the summary is JSON on stdout."""

import argparse
import json
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path

from machine_checks import examine, failures, summarise
from one_core import stay_on_one_core


def attempt(number, seed):
    """One machine; an exception is a failed row."""
    try:
        return examine(seed, number)
    except Exception as error:  # noqa: BLE001  whatever it is, it is listed
        return {"seed": seed, "machine": number, "failed": f"{type(error).__name__}: {error}"}


def run(numbers, seed, jobs):
    """Records of all machines, with progress on stderr."""
    work = partial(attempt, seed=seed)
    if jobs == 1:
        yield from map(work, numbers)
        return
    with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
        yield from pool.map(work, numbers)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--machines", type=int, default=1000)
    parser.add_argument("--first", type=int, default=0, help="number of the first machine")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--records", type=Path, help="also write every machine's record here")
    options = parser.parse_args()
    start, records = time.perf_counter(), []
    numbers = range(options.first, options.first + options.machines)
    for record in run(numbers, options.seed, options.jobs):
        records.append(record)
        for failure in failures(record):
            print(json.dumps(failure), file=sys.stderr)
        if len(records) % 10 == 0:
            seconds = time.perf_counter() - start
            print(f"{len(records)} machines, {seconds:.0f} s", file=sys.stderr, flush=True)
    summary = summarise(records) | {"seconds": round(time.perf_counter() - start, 1)}
    print(json.dumps(summary, indent=1))
    if options.records:
        options.records.write_text("".join(json.dumps(one) + "\n" for one in records))


if __name__ == "__main__":
    stay_on_one_core()
    main()
