#!/bin/sh
# tests/packages/python.sh install|test|types: the Python package from this clone by pip, into an environment of its own
# under build/python/test. 77: what it needs from PyPI cannot be had, or Python is too old.
set -eu
cd "$(dirname "$0")/../.."
top=${BUILD:-build}/python
python=${PYTHON:-python3}
absent() { echo "skip: $*"; exit 77; }
case $1 in
install)
    "$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null || absent "no Python 3.11 or newer here"
    # Without ensurepip venv fails, and leaves half of one.
    [ -x "$top/test/bin/pip" ] || "$python" -m venv "$top/test" >/dev/null 2>&1 || absent "no venv for $python (python3-venv)"
    "$top/test/bin/python" -m pip install -q scikit-build-core nanobind numpy pytest >"$top/test.log" 2>&1 ||
        absent "scikit-build-core, nanobind, numpy or pytest cannot be had from PyPI"
    # Not needed by the package: what is not there is skipped by name. Compiled is what the tests import.
    "$top/test/bin/python" -m pip install -q --no-compile cmake ninja pandas polars pyarrow mypy ruff scipy duckdb statsmodels matplotlib \
        pyserial python-can cantools "paho-mqtt>=2" prometheus_client starlette uvicorn >>"$top/test.log" 2>&1 || :
    "$top/test/bin/python" -m pip install -q --no-compile asammdf mcap mcap-ros2-support rosbags h5py websocket-client >>"$top/test.log" 2>&1 || :
    # make's archives are the same code; `make python` compiles anew.
    build=$(cd "${BUILD:-build}" && pwd)
    [ -f "$build/libapp.a" ] && export CMAKE_ARGS="-DDQWATCH_BUILD=$build"
    "$top/test/bin/python" -m pip install -q --no-build-isolation --no-deps --force-reinstall ./python >>"$top/test.log" 2>&1 ||
        { tail -n 30 "$top/test.log"; exit 1; }
    "$top/test/bin/python" -c 'import dqwatch; print(dqwatch.__version__)'
    ;;
test)
    "$top/test/bin/python" -c 'import dqwatch, pytest' 2>/dev/null || absent "the package was not installed"
    "$top/test/bin/python" -m pytest -q -p no:cacheprovider python/tests
    ;;
types)
    [ -x "$top/test/bin/mypy" ] && [ -x "$top/test/bin/ruff" ] || absent "no mypy or no ruff"
    top=$(cd "$top" && pwd)
    cd python
    "$top/test/bin/mypy" --strict src
    "$top/test/bin/ruff" check .
    "$top/test/bin/ruff" format --check .
    ;;
esac
