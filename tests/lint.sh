#!/usr/bin/env bash
# Rules of the layout that no compiler checks. Prints each breach with file and line; exit status 1 if there is any.
# usage: tests/lint.sh [ROOT]
set -u
export LC_ALL=C
here=$(cd "$(dirname "$0")" && pwd)
links=$here/links.py counter=$here/lines.sh words=$here/words.py
cd "${1:-$(dirname "$0")/..}" || exit 2
breaches=0
breach() { echo "lint: $*"; breaches=$((breaches + 1)); }
# grep_each MESSAGE PATTERN FILE...: a breach for every line that matches.
grep_each() {
  local message=$1 pattern=$2; shift 2
  while IFS= read -r hit; do breach "$message: $hit"; done < <(grep -nHE "$pattern" "$@" /dev/null)
}

mapfile -t sources < <(find canyon -name '*.hpp' -o -name '*.cpp' | sort)
[ "${#sources[@]}" -gt 0 ] || { echo "lint: no sources under $PWD/canyon"; exit 2; }

# 1. A folder includes only itself and folders above it; the order is CMakeLists.txt's.
mapfile -t order < <(sed -n 's/^ *canyon_folder(\([a-z_/]*\).*/\1/p' CMakeLists.txt)
declare -A rank
for i in "${!order[@]}"; do rank[${order[$i]}]=$i; done
while IFS=: read -r file line included; do
  folder=${file#canyon/} folder=${folder%/*}
  if [ -z "${rank[$folder]:-}" ] || [ -z "${rank[$included]:-}" ]; then
    breach "$file:$line: folder canyon/$folder or canyon/$included is not in CMakeLists.txt's pipeline"
  elif [ "${rank[$included]}" -gt "${rank[$folder]}" ]; then
    breach "$file:$line: canyon/$folder includes canyon/$included, which lies further down the pipeline"
  fi
done < <(printf '%s\n' "${sources[@]}" | grep -v '^canyon/[a-z]*\.hpp$' | xargs grep -nHE '^#include "canyon/' | sed -E 's|^([^:]*:[0-9]+):#include "canyon/([a-z_/]+)/[a-z0-9_]+[.][a-z]+".*|\1:\2|')

# Eight layers, each with a README, and two more headers.
layers='base|sky|city|paths|receiver|simulation|outputs|analysis'
while IFS= read -r file; do breach "$file: is in none of the eight layers"; done \
  < <(printf '%s\n' "${sources[@]}" | grep -vE "^canyon/(($layers)/.*|(canyon|io)\.hpp)\$")
for layer in ${layers//|/ }; do [ -e "canyon/$layer/README.md" ] || breach "canyon/$layer: no README.md"; done

# 2. The engine does not depend on hosts.
grep_each "the engine includes a host's header" \
  '#include [<"](gazebo|gz|ignition|ros|rclcpp|mavlink|sensor_msgs|std_msgs|geometry_msgs|adapters|cli|pybind11|python)/' "${sources[@]}"

# Code shared by hosts needs no SDF; adapters/common/sdf/ reads it for hosts with SDF.
mapfile -t shared < <(find adapters/common adapters/common/msgs adapters/common/testing -maxdepth 1 -name '*.?pp' 2>/dev/null | sort)
grep_each "only adapters/common/sdf may include SDF" '#include [<"](sdf/|adapters/common/sdf/)' "${shared[@]}"

# 3. Only canyon/base/json.cpp uses nlohmann/json, and tests, which compare with it; only raytrace uses Embree; only
# canyon::io's files use Cairo and rasters.
mapfile -t outside < <(printf '%s\n' "${sources[@]}" | grep -vE '^canyon/base/json\.cpp$|_test\.cpp$')
grep_each "only canyon/base/json.cpp may include nlohmann/json" '#include [<"]nlohmann' "${outside[@]}"
mapfile -t outside < <(printf '%s\n' "${sources[@]}" | grep -v '^canyon/city/raytrace/')
grep_each "only canyon/raytrace may include Embree" '#include [<"]embree' "${outside[@]}"
mapfile -t outside < <(printf '%s\n' "${sources[@]}" | grep -vE '^canyon/city/buildings/|^canyon/city/meshes/geos\.hpp$')
grep_each "only canyon/city/buildings may include map libraries (and canyon/city/meshes/geos.hpp GEOS)" \
  '#include [<"](osmium|protozero|geos|curl)' "${outside[@]}"
mapfile -t outside < <(printf '%s\n' "${sources[@]}" | grep -vE '^canyon/(city/buildings|analysis/heatmap)/')
grep_each "only canyon/city/buildings and canyon/analysis/heatmap may include raster libraries" \
  '#include [<"](gdal|ogr|netcdf)' "${outside[@]}"
# FOLDER/FILE.cpp, or FOLDER/ALL, of the files assigned to canyon::io in CMakeLists.txt.
io=$(tr -s '\n ' ' ' <CMakeLists.txt | grep -oE 'canyon_folder\([^)]*\)' | sed -nE 's/^canyon_folder\(([a-z_/]+) (.* )?IO ([^)]*)\)/\1 \3/p' |
  while read -r folder names; do for name in $names; do [[ $name != *.cpp && $name != ALL ]] || echo "canyon/$folder/$name"; done; done)
while IFS= read -r file; do
  [[ $file == *.hpp ]] || grep -qxF -e "${file/%_test.cpp/.cpp}" -e "${file%/*}/ALL" <<<"$io" ||
    breach "$file: includes Cairo, GDAL or NetCDF but is not named after IO in CMakeLists.txt"
done < <({ grep -lE '#include [<"]cairo' "${sources[@]}"
           printf '%s\n' "${sources[@]}" | grep '^canyon/analysis/heatmap/' |
             xargs grep -lE '#include [<"](gdal|ogr|netcdf)'; } | sort -u)

# 4. Public headers are those included by the umbrella headers (cmake/install_headers.cmake installs
# them): they need only the standard library and Eigen, and canyon/canyon.hpp needs no part of canyon::io.
# reached HEADER: Canyon's headers that it includes, directly or indirectly, and itself.
reached() {
  local waiting=("$@") header
  declare -A seen=()
  while [ "${#waiting[@]}" -gt 0 ]; do
    header=${waiting[0]} waiting=("${waiting[@]:1}")
    [ -z "${seen[$header]:-}" ] || continue
    seen[$header]=1
    echo "$header"
    [ ! -e "$header" ] || mapfile -t -O "${#waiting[@]}" waiting < <(sed -n 's/^#include "\(canyon[^"]*\)".*/\1/p' "$header")
  done
}
mapfile -t public < <(reached canyon/canyon.hpp canyon/io.hpp)
for header in "${public[@]}"; do [ -e "$header" ] || breach "$header: a public header includes it, and it is not there"; done
grep_each "a public header includes another library than Eigen" \
  '#include (<[^E>][^>/]*/|<[^>]*\.h>|"([^c]|c[^a]))' $(ls "${public[@]}" 2>/dev/null)
mapfile -t io_only < <(sed -n 's/^ *canyon_folder(\([a-z_/]*\) IO ALL.*/canyon\/\1\//p' CMakeLists.txt)
while IFS= read -r header; do
  for folder in "${io_only[@]}"; do
    [[ ${header%/*}/ != "$folder" ]] || breach "$header: canyon/canyon.hpp reaches it, and it is canyon::io's"
  done
done < <(reached canyon/canyon.hpp)
grep_each "inside, include what is needed" '#include "canyon/(canyon|io)\.hpp"' \
  $(printf '%s\n' "${sources[@]}" | grep -v '^canyon/io\.hpp$')

# 5. Conventions.
grep_each "no 'using namespace' in a header" '^ *using namespace' $(printf '%s\n' "${sources[@]}" | grep hpp$)
while IFS= read -r file; do breach "$file: no '#pragma once'"; done \
  < <(printf '%s\n' "${sources[@]}" | grep 'hpp$' | xargs grep -L '^#pragma once')
for source in $(printf '%s\n' "${sources[@]}" | grep '^canyon/.*\.cpp$'); do
  header=${source%cpp}hpp
  [ ! -e "$header" ] || [ "$(grep -m1 '^#include' "$source")" = "#include \"$header\"" ] ||
    breach "$source: its own header comes first: so it is proved to compile alone"
done
# A source has a header of its name, or belongs to a family: sources of one kind, declared in one header for
# the code that selects among them.
families='
adapters/gazebo_classic/publishers.hpp
adapters/gz_sim/publishers.hpp
canyon/base/transport/devices.hpp
canyon/city/meshes/mesh_scene.hpp
canyon/outputs/encoding/encoder.hpp
canyon/outputs/encoding/ubx/messages.hpp
canyon/sky/broadcast/messages.hpp
cli/city_commands.hpp
cli/commands.hpp
python/src/binding.hpp
'
mapfile -t alone < <(find canyon cli adapters python/src -name '*.cpp' ! -name '*_test.cpp' ! -name '*_bench.cpp' ! -path '*/testing/*' 2>/dev/null |
  sort)
for source in "${alone[@]}"; do
  [ ! -e "${source%cpp}hpp" ] && ! head -3 "$source" | grep -q '^// No header declares it: ' || continue
  sed -n 's/^#include "\(.*\)"$/\1/p' "$source" | grep -xF "$(grep "^${source%/*}/[a-z_]*[.]hpp$" <<<"$families" || echo none)" >/dev/null ||
    breach "$source: no header of its name, and of no family in tests/lint.sh"
done
grep_each "a source is declared in the header of its name" '^// Declared in ' "${alone[@]}"
grep_each "not ASCII" '[^ -~	]' $(printf '%s\n' "${sources[@]}")
grep_each "a test may not sleep" 'sleep_for|usleep\(|[^_a-z]sleep\(' $(printf '%s\n' "${sources[@]}" | grep '_test\.cpp$')

# Headers are cheap: what solves, parses or formats is included by sources. Exceptions are headers that one folder alone includes.
mapfile -t cheap < <(printf '%s\n' "${sources[@]}" | grep '\.hpp$' | grep -vE \
  '/(base/transport/devices|city/mesh_parts|receiver/positioning/fusion/inertial_errors|analysis/heatmap/cells/cell_fix)\.hpp$')
grep_each "a header may not include solvers, JSON, YAML, fmt or Boost" \
  '#include <(Eigen/(Dense|QR|SVD|LU|Cholesky|Eigenvalues)|nlohmann/|yaml-cpp/|fmt/|boost/)' "${cheap[@]}"

# 6. The total of lines does not rise above tests/lines_budget.txt.
allowed=$(sed -n 's/^total *//p' tests/lines_budget.txt 2>/dev/null)
lines=$("$counter" . | sed -n 's/^total *//p')
[ "$lines" -le "${allowed:-$lines}" ] || breach "tests/lines_budget.txt: the tree has $lines lines, and may have $allowed"

# 7. Words that standard terms replace become no more than tests/words_budget.txt has.
while IFS= read -r hit; do breach "$hit"; done < <(python3 "$words" .)

# 8. Links of the documentation.
while IFS= read -r hit; do breach "$hit"; done < <(python3 "$links")

[ "$breaches" -eq 0 ] && echo "lint: ${#sources[@]} files, no breach"
[ "$breaches" -eq 0 ]
