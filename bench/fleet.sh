#!/bin/sh
# The fleet: found of what is planted, cost, page. BUILD: build folder, with the environment that `make fleet` makes.
# SEED.
set -u
BUILD=${BUILD:-build}
seed=${SEED:-1001}
python=$BUILD/fleet/env/bin/python

# PySpark from the Python package index, in an environment of its own beside the same package; a JRE from the
# distribution.
spark() {
    command -v java >/dev/null || { echo "skipped: Spark (no java: openjdk-17-jre-headless)"; return; }
    env=$BUILD/fleet/spark
    if ! "$env/bin/python" -c 'import pyspark, dqwatch' 2>/dev/null; then
        python3 -m venv "$env" >/dev/null 2>&1 &&
            "$env/bin/pip" install -q --disable-pip-version-check './python[spark]' >"$BUILD/fleet/pip.log" 2>&1 ||
            { echo "skipped: Spark (pip cannot install it; see $BUILD/fleet/pip.log)"; return; }
    fi
    SPARK_PYTHON=$(cd "$env/bin" && pwd)/python
    export SPARK_PYTHON
}

"$python" bench/fleet.py page || exit 1
echo
spark
"$python" bench/fleet.py cost || exit 1
echo
"$python" bench/fleet.py scale || exit 1
echo
"$python" bench/fleet.py score --seeds "$seed" || exit 1
