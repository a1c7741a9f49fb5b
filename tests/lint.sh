#!/usr/bin/env bash
# Rules of the layout that no compiler checks. Prints each breach with file and line; exit status 1 if there is any.
# usage: tests/lint.sh [ROOT]
set -u
export LC_ALL=C
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
done < <(grep -nHE '^#include "canyon/' "${sources[@]}" | sed -E 's|^([^:]*:[0-9]+):#include "canyon/([a-z_/]+)/[a-z0-9_]+.hpp".*|\1:\2|')

# 2. The engine knows no host.
grep_each "the engine includes a host's header" \
  '#include [<"](gazebo|gz|ignition|ros|rclcpp|mavlink|sensor_msgs|std_msgs|geometry_msgs|adapters|cli)/' "${sources[@]}"

# 3. Only raytrace knows Embree; only canyon::io's files know Assimp, Cairo and rasters.
mapfile -t outside < <(printf '%s\n' "${sources[@]}" | grep -v '^canyon/raytrace/')
grep_each "only canyon/raytrace may include Embree" '#include [<"]embree' "${outside[@]}"
mapfile -t outside < <(printf '%s\n' "${sources[@]}" | grep -v '^canyon/buildings/')
grep_each "only canyon/buildings may include map libraries" \
  '#include [<"](osmium|protozero|geos|curl)' "${outside[@]}"
mapfile -t outside < <(printf '%s\n' "${sources[@]}" | grep -vE '^canyon/(buildings|heatmap)/')
grep_each "only canyon/buildings and canyon/heatmap may include raster libraries" \
  '#include [<"](gdal|ogr|netcdf)' "${outside[@]}"
io=$(tr -s '\n ' ' ' <CMakeLists.txt | grep -oE 'IO( [a-z0-9_]+\.cpp)+' | tr ' ' '\n' | grep cpp)
while IFS= read -r file; do
  name=$(basename "$file" .cpp)
  [[ $file == *.hpp ]] || grep -qxF "${name%_test}.cpp" <<<"$io" ||
    breach "$file: includes Assimp, Cairo, GDAL or NetCDF but is not named after IO in CMakeLists.txt"
done < <({ grep -lE '#include [<"](assimp|cairo)' "${sources[@]}"
           printf '%s\n' "${sources[@]}" | grep '^canyon/heatmap/' |
             xargs grep -lE '#include [<"](gdal|ogr|netcdf)'; } | sort -u)

# 4. Habits.
grep_each "no 'using namespace' in a header" '^ *using namespace' $(printf '%s\n' "${sources[@]}" | grep hpp$)
while IFS= read -r file; do breach "$file: no '#pragma once'"; done \
  < <(printf '%s\n' "${sources[@]}" | grep 'hpp$' | xargs grep -L '^#pragma once')
grep_each "not ASCII" '[^ -~	]' $(printf '%s\n' "${sources[@]}")
grep_each "a test may not sleep" 'sleep_for|usleep\(|[^_a-z]sleep\(' $(printf '%s\n' "${sources[@]}" | grep '_test\.cpp$')

[ "$breaches" -eq 0 ] && echo "lint: ${#sources[@]} files, no breach"
[ "$breaches" -eq 0 ]
