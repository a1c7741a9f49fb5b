#!/usr/bin/env bash
# Writes reference data of the Gazebo tests and the example: worlds, and canyon's results for the same drives. The
# tests find the folder in CANYON_GAZEBO_DATA.
# usage: tests/gazebo/prepare.sh CANYON_PROGRAM FOLDER
#
#   NAME/NAME.world        synthetic; hongkong if ../shared/data exists. Meshes are next to it
#   NAME/truth.csv         the drive: GPS week, tow [s], latitude, longitude [deg], height [m] (format urbannav)
#   NAME/reference.yaml    scenario of that drive through that world, specular model, noise off
#   NAME/epochs.csv, NAME/satellites.csv        results of canyon simulate
#   two_walls/two_walls.world, two_walls/poses.csv     name, east, north, up [m]
#   two_walls/MODEL/POSE/trace.json, epochs.csv, satellites.csv     of both models, the paper's frozen sky, noise off
set -euo pipefail

canyon=$(realpath "$1")
source=$(cd "$(dirname "$0")/../.." && pwd -P)
shared=$source/../shared/data
mkdir -p "$(dirname "$2")"
out=$(realpath -m "$2")
new=$out.new
rm -rf "$new" && mkdir "$new"

quiet='{pictures: false, nmea: false, kml: false, geojson: false, rinex_observation: false, rinex_navigation: false}'

# drive NAME CITY SKY TRAJECTORY: values of the scenario's keys; START and RATE as further keys in $5.
drive() {
  local name=$1 city=$2 sky=$3 trajectory=$4 more=${5:-}
  local folder=$new/$name
  mkdir "$folder"
  printf '%s\n' "city: $city" "sky: $sky" "trajectory: $trajectory" "outputs: $quiet" $'\n'"$more" >"$folder/drive.yaml"
  "$canyon" city build "$folder/drive.yaml" --name "$name" -o "$folder/$name.world" --quiet
  # The truth as in the scenario: at the requested height above the terrain, without rounding.
  "$canyon" simulate "$folder/drive.yaml" --out "$folder/first" --quiet
  tail -n +2 "$folder/first/epochs.csv" | cut -d, -f1-5 >"$folder/truth.csv"
  printf '%s\n' "city: {file: $name.world}" "sky: $sky" 'trajectory: {file: truth.csv, format: urbannav}' 'rate_hz: 1' \
    'receivers: [{profile: ideal}]' 'seed: 1' "outputs: $quiet" >"$folder/reference.yaml"
  "$canyon" simulate "$folder/reference.yaml" --out "$folder" --quiet
  rm -r "$folder/first" "$folder/drive.yaml"
}

drive synthetic \
  '{synthetic: {blocks_east: 8, blocks_north: 8, max_height_m: 200, seed: 7}, origin: {latitude_deg: 22.3, longitude_deg: 114.17}}' \
  '{nominal: true, systems: [GPS, Galileo]}' \
  '{waypoints: [{east_m: -228, north_m: -228}, {east_m: -228, north_m: 0}, {east_m: 0, north_m: 0}, {east_m: 0, north_m: 152}, {east_m: 152, north_m: 152}], speed_mps: 8, height_above_terrain_m: 1.5}' \
  $'start: 2026-06-01T08:00:00Z\nrate_hz: 5'

if [ -e "$shared/hongkong/buildings.dae" ]; then
  recorded=$(cd "$shared" && pwd -P)
  drive hongkong \
    "{mesh: $recorded/hongkong/buildings.dae, origin: {latitude_deg: 22.298251, longitude_deg: 114.178761}, offset: {north_m: 8}}" \
    "{navigation: [$recorded/urbannav-tst-20190428/hksc1180.19n, $recorded/urbannav-tst-20190428/hksc1180.19b], systems: [GPS, BeiDou]}" \
    "{file: $recorded/urbannav-tst-20190428/groundTruth_TST.csv, format: urbannav, height_above_terrain_m: 2}"
else
  echo "SKIPPED: the Hong Kong world (../shared/data/hongkong is not here)" >&2
fi

walls=$new/two_walls
mkdir "$walls"
cp "$source/tests/gazebo/two_walls.world" "$walls/"
printf '%s\n' 'middle,0,0,2' 'left,-6.5,-30,1.5' 'right,9,55.25,4' >"$walls/poses.csv"
for model in specular mirror; do
  while IFS=, read -r pose east north up; do
    folder=$walls/$model/$pose
    mkdir -p "$folder"
    cat >"$folder/scenario.yaml" <<Y
city: {file: ../../two_walls.world}
sky:
  frozen:
    satNum: 8
    satAzimuth: [2.93, 3.39, 5.56, 0.23, 4.02, 1.38, 2.23, 0.65]
    satElevation: [0.78, 0.32, 1.02, 0.90, 0.47, 0.26, 1.09, 0.38]
start: 2026-06-01T12:00:00Z
duration_s: 1
trajectory: {position: {east_m: $east, north_m: $north, up_m: $up}}
receivers: [{profile: ideal, elevation_mask_deg: 10}]
propagation: {model: $model}
outputs: $quiet
Y
    "$canyon" trace "$folder/scenario.yaml" --json >"$folder/trace.json"
    "$canyon" simulate "$folder/scenario.yaml" --out "$folder" --quiet
  done <"$walls/poses.csv"
done

rm -rf "$out" && mv "$new" "$out"
