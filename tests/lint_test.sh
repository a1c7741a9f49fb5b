#!/usr/bin/env bash
# Proves that lint.sh finds what it is there to find: each breach is planted in a copy of the tree.
set -u
root=$(cd "$(dirname "$0")/.." && pwd)
copy=$(mktemp -d)
trap 'rm -rf "$copy"' EXIT
cp -r "$root/canyon" "$root/CMakeLists.txt" "$copy"
mkdir -p "$copy/adapters" && cp -r "$root/adapters/common" "$copy/adapters"
mkdir "$copy/tests" && cp "$root"/tests/{lines,words}_budget.txt "$copy/tests"
"$root/tests/lint.sh" "$copy" || { echo "the tree itself has breaches"; exit 1; }

# All are planted at once, each in a file of its own, which the lint must name.
wanted=()
# plant FILE TEXT: a new file with that text; its name gets a number.
plant() {
  local file=${1/planted/planted_${#wanted[@]}}
  { [[ $file != *.cpp ]] || echo '// No header declares it: a planted file.'; printf '%s\n' "$2"; } >"$copy/$file"
  wanted+=("$file")
}
plant canyon/base/geodesy/planted.cpp '#include "canyon/sky/orbit/sky.hpp"'
plant canyon/simulation/planted.cpp '#include "canyon/outputs/encoding/sinks.hpp"'
plant canyon/receiver/planted.cpp '#include <gazebo/common/Plugin.hh>'
plant canyon/outputs/encoding/planted.cpp '#include <ros/ros.h>'
plant canyon/outputs/encoding/planted.cpp '#include <mavlink/v2.0/common/mavlink.h>'
plant canyon/outputs/view/planted.cpp '#include <nlohmann/json.hpp>'
plant canyon/paths/propagation/planted.cpp '#include <embree3/rtcore.h>'
plant canyon/simulation/planted.cpp '#include <gdal.h>'
# Folders in folders: a folder's parts stand above it, and one that CMakeLists.txt does not name is none.
plant canyon/city/buildings/sources/planted.cpp '#include "canyon/city/buildings/city_builder.hpp"'
plant canyon/analysis/heatmap/kernels/planted.cpp '#include "canyon/analysis/heatmap/engine/engine.hpp"'
plant canyon/analysis/heatmap/planted.cpp '#include "canyon/base/text.hpp"'
plant canyon/analysis/heatmap/engine/planted.cpp '#include <netcdf.h>'
plant canyon/outputs/drawing/planted.cpp '#include <cairo.h>'
plant canyon/city/axes.cpp '#include <cairo.h>'    # drawing's file of that name may
plant canyon/analysis/validation/planted.cpp '#include <osmium/osm.hpp>'
plant canyon/city/planted.hpp '#pragma once
using namespace std;'
plant canyon/city/planted.hpp '// no pragma once'
plant canyon/receiver/planted.hpp '#include <Eigen/QR>'
echo '#pragma once' >"$copy/canyon/receiver/tracking/first.hpp"
plant canyon/receiver/tracking/first.cpp '#include <vector>
#include "canyon/receiver/tracking/first.hpp"'
plant canyon/receiver/tracking/planted.cpp $'// caf\xc3\xa9'
plant canyon/analysis/heatmap/files/planted_test.cpp 'usleep(10);'
plant canyon/city/planted_test.cpp 'std::this_thread::sleep_for(1s);'
plant canyon/city/planted.cpp '#include "canyon/canyon.hpp"'
plant adapters/common/planted.hpp '#include <sdf/sdf.hh>'
plant adapters/common/planted.cpp '#include "adapters/common/sdf/plugin_settings.hpp"'
echo 'int undeclared;' >"$copy/canyon/city/undeclared.cpp" && wanted+=(canyon/city/undeclared.cpp)
echo '#include "canyon/city/meshes/mesh_scene.hpp"' >"$copy/canyon/city/other_family.cpp" && wanted+=(canyon/city/other_family.cpp)
plant canyon/city/planted.cpp '// Declared in canyon/city/city.hpp.'
{ echo '#pragma once'; yes '// one more line' | head -150000; } >"$copy/canyon/sky/gnss/budget.hpp"
wanted+=("the tree has")
mkdir "$copy/canyon/cellar"
plant canyon/cellar/planted.cpp 'int in_no_layer;'
plant canyon/planted.cpp 'int in_no_folder;'
plant canyon/planted.md '[a page](absent.md)'
plant canyon/planted.md '[a heading](#absent)'
plant canyon/base/planted.cpp 'bool begun_anew = false;'
# add FILE TEXT NAMED: a line more in a file that is there; the lint must name NAMED.
add() {
  printf '%s\n' "$2" >>"$copy/$1"
  wanted+=("$3")
}
add canyon/base/input_error.hpp '#include <fmt/format.h>' canyon/base/input_error.hpp
add canyon/base/geodesy/frames.hpp '#include <netcdf.h>' canyon/base/geodesy/frames.hpp
add canyon/canyon.hpp '#include "canyon/analysis/heatmap/pictures/map_style.hpp"' canyon/analysis/heatmap/pictures/map_style.hpp
add canyon/io.hpp '#include "canyon/city/absent.hpp"' canyon/city/absent.hpp

if output=$("$root/tests/lint.sh" "$copy"); then echo "no breach was found"; exit 1; fi
failed=0
for file in "${wanted[@]}"; do
  grep -qF "$file" <<<"$output" || { echo "not found: $file"; failed=1; }
done
[ "$failed" -eq 0 ] && echo "all of ${#wanted[@]} planted breaches were found"
exit "$failed"
