#!/usr/bin/env bash
# Proves that lint.sh finds what it is there to find: each breach is planted in a copy of the tree.
set -u
root=$(cd "$(dirname "$0")/.." && pwd)
copy=$(mktemp -d)
trap 'rm -rf "$copy"' EXIT
cp -r "$root/canyon" "$root/CMakeLists.txt" "$copy"
failed=0
"$root/tests/lint.sh" "$copy" || { echo "the tree itself has breaches"; exit 1; }

# plant FILE TEXT: the lint must fail on a file with that text, and name the file.
plant() {
  printf '%s\n' "$2" >"$copy/$1"
  if output=$("$root/tests/lint.sh" "$copy"); then
    echo "not found: $1: $2"; failed=1
  elif ! grep -qF "$1" <<<"$output"; then
    echo "found, but the file is not named: $1: $output"; failed=1
  fi
  rm "$copy/$1"
}
plant canyon/geodesy/planted.cpp '#include "canyon/orbit/sky.hpp"'
plant canyon/simulation/planted.cpp '#include "canyon/output/sinks.hpp"'
plant canyon/receiver/planted.cpp '#include <gazebo/common/Plugin.hh>'
plant canyon/output/planted.cpp '#include <ros/ros.h>'
plant canyon/output/planted.cpp '#include <mavlink/v2.0/common/mavlink.h>'
plant canyon/propagation/planted.cpp '#include <embree3/rtcore.h>'
plant canyon/simulation/planted.cpp '#include <gdal.h>'
plant canyon/city/planted.cpp '#include <assimp/scene.h>'
plant canyon/city/planted.hpp 'using namespace std;'
plant canyon/city/planted_test.cpp 'std::this_thread::sleep_for(1s);'
[ "$failed" -eq 0 ] && echo "every planted breach was found"
exit "$failed"
