#!/usr/bin/env bash
# Installs the package by pip, offline, into an empty folder and imports it from elsewhere.
# usage: python/tests/install.sh BUILD_FOLDER WORK_FOLDER PYTHON
set -euo pipefail
source=$(cd "$(dirname "$0")/../.." && pwd)
build=$1 work=$2 python=$3
"$python" -c 'import setuptools, wheel, pip' 2>/dev/null || { echo "SKIPPED: pip, setuptools or wheel is missing"; exit 77; }
rm -rf "$work"
mkdir -p "$work/source" "$work/elsewhere"
# pip builds in the source's folder: a copy without the rest of the tree leaves that as it is. CMake's build is reused.
mkdir -p "$work/source/docs" "$work/source/python"
cp "$source/setup.py" "$source/pyproject.toml" "$source/CMakeLists.txt" "$source/LICENSE" "$work/source"
cp "$source/docs/python.md" "$work/source/docs"
cp -r "$source/python/canyon" "$work/source/python"
CANYON_PYTHON_BUILD=$build "$python" -m pip install --no-build-isolation --no-deps --no-index --quiet --root-user-action=ignore --target "$work/site" "$work/source"
cd "$work/elsewhere"
PYTHONPATH=$work/site "$python" - "$work/site" "$(sed -n 's/^project(canyon VERSION \([0-9.]*\).*/\1/p' "$source/CMakeLists.txt")" <<'END'
import importlib.metadata
import sys

import canyon

site, version = sys.argv[1:]
assert canyon.__file__.startswith(site), canyon.__file__
about = importlib.metadata.metadata("canyon")
assert about["Version"] == canyon.__version__ == version, (about["Version"], canyon.__version__, version)
assert about["License"] == "Apache-2.0"
city = canyon.City(open=True, origin={"latitude_deg": 48.1, "longitude_deg": 11.6, "height_m": 520})
epoch = canyon.LiveReceiver(city, "2026-06-01T08:00:00Z").observe(0, (0, 0, 2))
assert epoch.tracked > 4, epoch.tracked
print("canyon", canyon.__version__, "from", canyon.__file__)
END
