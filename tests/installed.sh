#!/usr/bin/env bash
# Installs the package by pip, offline, into an empty folder and imports it from another folder.
# usage: tests/installed.sh BUILD_FOLDER WORK_FOLDER PYTHON
set -euo pipefail
source=$(cd "$(dirname "$0")/.." && pwd)
build=$1 work=$2 python=$3
"$python" -c 'import setuptools, wheel, pip' 2>/dev/null || { echo "SKIPPED: pip, setuptools or wheel is missing"; exit 77; }
rm -rf "$work"
mkdir -p "$work/source" "$work/elsewhere"
# pip builds in the source's folder: a copy without the rest of the tree leaves the tree unchanged. CMake's build is reused.
mkdir -p "$work/source/docs" "$work/source/python"
cp "$source/setup.py" "$source/pyproject.toml" "$source/CMakeLists.txt" "$source/LICENSE" "$work/source"
cp "$source/docs/python.md" "$work/source/docs"
cp -r "$source/python/canyon" "$work/source/python"
CANYON_PYTHON_BUILD=$build "$python" -m pip wheel --no-build-isolation --no-deps --no-index --quiet -w "$work" "$work/source"
"$python" -m pip install --no-deps --no-index --quiet --root-user-action=ignore --target "$work/site" "$work"/canyon_gnss-*-linux_*.whl
cd "$work/elsewhere"
PYTHONPATH=$work/site "$python" - "$work/site" "$(sed -n 's/^project(canyon VERSION \([0-9.]*\).*/\1/p' "$source/CMakeLists.txt")" <<'END'
import importlib.metadata
import sys

import canyon

site, version = sys.argv[1:]
assert canyon.__file__.startswith(site), canyon.__file__
about = importlib.metadata.metadata("canyon-gnss")
assert about["Version"] == canyon.__version__ == version, (about["Version"], canyon.__version__, version)
assert about["License"] == "Apache-2.0"
city = canyon.City(open=True, origin={"latitude_deg": 48.1, "longitude_deg": 11.6, "height_m": 520})
epoch = canyon.LiveReceiver(city, "2026-06-01T08:00:00Z").observe(0, (0, 0, 2))
assert epoch.tracked > 4, epoch.tracked
print("canyon", canyon.__version__, "from", canyon.__file__)
END
# The wheel with the command: loads only its own libraries or those of every Linux, and both run without environment variables.
command -v patchelf >/dev/null && [ -e "$source/viewer/dist/viewer.html" ] || { echo "SKIPPED the bundled wheel: patchelf or the viewer's page is missing"; exit 0; }
"$python" "$source/packaging/bundle.py" "$work"/canyon_gnss-*-linux_*.whl "$build" "$work/bundled"
size=$(stat -c %s "$work"/bundled/canyon_gnss-*.whl)
[ "$size" -le 60000000 ] || { echo "FAILED: the wheel has $size bytes, and may have 60 MB"; exit 1; }
"$python" -m venv --system-site-packages "$work/venv"
"$work/venv/bin/pip" install --quiet --no-deps --no-index "$work"/bundled/canyon_gnss-*.whl
cd "$work/elsewhere"
site=$(echo "$work"/venv/lib/python3*/site-packages)
for file in "$site"/canyon/bundle/bin/canyon "$site"/canyon/_canyon*.so "$site"/canyon.libs/*.so*; do
  others=$(ldd "$file" | grep "=> /" | grep -vE "=> $site|/(lib(c|m|dl|pthread|rt|util|resolv|stdc\+\+|gcc_s)\.so)" || true)
  [ -z "$others" ] || { echo "FAILED: $file loads $others"; exit 1; }
done
env -i HOME="$work" "$work/venv/bin/canyon" demo -o demo >/dev/null 2>&1
[ -s demo/track.png ] && [ -s demo/heatmap/hdop.tif ] && [ -s demo/demo.html ] || { echo "FAILED: the demo's files are missing"; exit 1; }
# GDAL and PROJ's database are from the wheel.
env -i HOME="$work" "$work/venv/bin/canyon" check "$source/tests/data/cases/world-parts-missing/adv.gml" | grep "ETRS89 / UTM zone 32N" >/dev/null ||
  { echo "FAILED: the wheel's PROJ does not know a reference system"; exit 1; }
env -i HOME="$work" "$work/venv/bin/python" -c "import canyon; print(canyon.__file__, canyon.simulate('demo/demo.yaml').summary['epochs'])"
