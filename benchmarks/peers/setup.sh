#!/bin/sh
# Two virtual environments for the peers of the benchmark, apart from each other
# and from the project's own: FOLDER/pyharm and FOLDER/mousai.
#   sh benchmarks/peers/setup.sh [FOLDER]        (default: benchmarks/.envs)
#   PYTHON=/path/to/python3.11 sh benchmarks/peers/setup.sh
set -eu

here=$(CDPATH='' cd -- "$(dirname -- "$0")" && pwd)
folder=${1:-$here/../.envs}
python=${PYTHON:-python3.11}

mkdir -p "$folder"

make_env() {
    name=$1
    shift
    "$python" -m venv "$folder/$name"
    "$folder/$name/bin/python" -m pip install --quiet --disable-pip-version-check "$@"
    printf '%s: ready in %s\n' "$name" "$folder/$name"
}

# The package called `pyharm` on PyPI is something else.
make_env pyharm "pyHarm-os==1.2.2" "numpy==2.4.6" "scipy==1.17.1"
make_env mousai "mousai==0.3.1" "numpy==2.4.6" "scipy==1.17.1"
