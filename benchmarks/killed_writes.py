"""Commands killed while they write: the files they leave are the old ones or the new ones.

Each command runs again and again in two cases, so that every run replaces what the one before has
written, and is killed by SIGKILL at a random moment after it begins to write.
"""

import argparse
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

LINEAR = ("ffs0827-linear", "--speeds", "800 rpm", "900 rpm", "-o")
# Words of a command in two cases; what it writes stands in the folder that is added last.
CASES = {
    "analyze": (
        ("analyze", *LINEAR),
        ("analyze", "--overwrite", "--harmonics", "3", *LINEAR),
    ),
    "simulate": (
        ("simulate", "ffs0827", "--periods", "20", "-o"),
        ("simulate", "ffs0827", "--periods", "30", "-o"),
    ),
    "simulate --json": (
        ("simulate", "ffs0827", "--periods", "20", "--json"),
        ("simulate", "ffs0827", "--periods", "30", "--json"),
    ),
    "reproduce": (
        ("reproduce", "6", "-o"),
        ("reproduce", "6", "--machine", "ffs0827-linear", "-o"),
    ),
}
# Loads and warms up once; for each line it reads a process of its own runs the two cases in turn.
CHILD = """
import json, os, sys
from flipflow.cli.main import main
from flipflow.results import stage

def telling(function):
    def told(*given, **options):
        print("writing", file=sys.stderr, flush=True)
        return function(*given, **options)
    return told

def run(k):
    sys.argv = ["flipflow", *cases[k % 2], out]
    if "analyze" in sys.argv and "--overwrite" not in sys.argv:
        sys.argv.insert(2, "--overwrite")
    try:
        main()
    except SystemExit as ended:
        assert ended.code in (0, None, 3), ended.code

stage.Stage.commit = telling(stage.Stage.commit)
cases, out = json.loads(sys.argv[1]), sys.argv[2]
run(0), run(1)
for line in sys.stdin:
    child = os.fork()
    if child:
        print("process", child, file=sys.stderr, flush=True)
        os.waitpid(child, 0)
        print("ended", file=sys.stderr, flush=True)
        continue
    for k in range(1_000_000):
        run(k)
"""


def content(out):
    """Files by name; what is aside is none of the set."""
    if out.is_file():
        return {out.name: out.read_bytes()}
    if not out.exists():
        return {}
    return {
        path.name: path.read_bytes()
        for path in sorted(out.rglob("*"))
        if path.is_file() and ".part" not in str(path)
    }


def attempt(writer, rng):
    """Kill a process at one of its first writings, up to 30 ms after that began."""
    writer.stdin.write("go\n")
    writer.stdin.flush()
    number = int(line_with(writer, "process").split()[1])
    for _ in range(rng.randrange(1, 4)):
        line_with(writer, "writing")
    time.sleep(rng.uniform(0.0, 0.03))
    os.kill(number, signal.SIGKILL)
    line_with(writer, "ended")


def line_with(writer, word):
    """The next line with a word on a process's stderr."""
    while word not in (line := writer.stderr.readline()):
        assert line, "the process that runs the command has ended"
    return line


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kills", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("names", nargs="*", help="of analyze, simulate, ...; all if left out")
    given = parser.parse_args()
    print(f"seed {given.seed}")
    bad, rng = 0, random.Random(given.seed)  # noqa: S311
    for name in given.names or CASES:
        with tempfile.TemporaryDirectory() as folder:
            bad += tried(name, Path(folder), rng, given.kills)
    return 1 if bad else 0


def tried(name, folder, rng, kills):
    """Number of attempts that left neither the one set nor the other."""
    cases, file = CASES[name], "motion.json" if "--json" in CASES[name][0] else ""
    sets = []
    for k, words in enumerate(cases):
        out = folder / f"case-{k}" / file
        out.parent.mkdir(exist_ok=True)
        run = [sys.executable, "-m", "flipflow", *words, str(out)]
        assert subprocess.run(run, check=False, capture_output=True).returncode in (0, 3)
        sets.append(content(out))
    assert sets[0] != sets[1]
    counts, out = Counter(), folder / "out" / file
    out.parent.mkdir(exist_ok=True)
    words = [sys.executable, "-c", CHILD, json.dumps(cases), str(out)]
    with subprocess.Popen(
        words, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    ) as writer:
        for _ in range(kills):
            attempt(writer, rng)
            left = content(out)
            counts["neither" if left not in sets else ("first", "second")[sets.index(left)]] += 1
        writer.stdin.close()
    print(f"{name:20s} {dict(counts)}", flush=True)
    return counts["neither"]


if __name__ == "__main__":
    sys.exit(main())
