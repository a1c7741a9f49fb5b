#!/usr/bin/env bash
# Installs Canyon into an empty prefix and builds and runs a separate project with it.
# usage: tests/consumer/run.sh BUILD_FOLDER WORK_FOLDER GENERATOR
set -euo pipefail
source=$(cd "$(dirname "$0")" && pwd)
build=$1 work=$2 generator=$3
rm -rf "$work"
mkdir -p "$work"
cmake --install "$build" --prefix "$work/prefix" >"$work/log"
cmake -S "$source" -B "$work/build" -G "$generator" -DCMAKE_BUILD_TYPE=Release -DCMAKE_PREFIX_PATH="$work/prefix" >>"$work/log" ||
  { tail -n 30 "$work/log"; exit 1; }
cmake --build "$work/build" >>"$work/log" || { tail -n 40 "$work/log"; exit 1; }
# docs/library.md shows first.cpp, then loop.cpp, unchanged.
sed -n '/^```cpp/,/^```$/p' "$source/../../docs/library.md" | sed '/^```/d' | diff <(cat "$source/first.cpp" "$source/loop.cpp") - ||
  { echo "docs/library.md shows other programs than tests/consumer/first.cpp and loop.cpp"; exit 1; }
"$work/build/first" "$source/../../examples/synthetic_drive.yaml" >"$work/table"
grep -q 'horizontal error, 95 %' "$work/table" || { echo "the first program prints no figures:"; cat "$work/table"; exit 1; }
(cd "$work" && "$work/build/loop" >"$work/loop" && test -s loop.kml) || { echo "the loop writes no track"; exit 1; }
grep -q 'horizontal error, 95 %' "$work/loop" || { echo "the loop prints no figures:"; cat "$work/loop"; exit 1; }
# Internal headers are not installed.
[ ! -e "$work/prefix/include/canyon/raytrace/embree.hpp" ] || { echo "internal headers are installed"; exit 1; }
"$work/build/engine_consumer"
printf 'v 0 0 0\nv 10 0 0\nv 10 0 10\nv 0 0 10\nf 1 2 3 4\n' >"$work/wall.obj"
"$work/build/io_consumer" "$work/wall.obj"
"$work/prefix/bin/canyon" --version
