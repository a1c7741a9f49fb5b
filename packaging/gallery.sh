#!/usr/bin/env bash
# Six runs as pages of the viewer, which open without a server: gallery.sh CANYON OUT. A page that is younger than the program stays.
set -euo pipefail
canyon=$(realpath "$1")
mkdir -p "$2"
out=$(realpath "$2")
root=$(realpath "$(dirname "$0")/..")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"

# stands NAME: whether its page is younger than the program.
stands() { [ "$out/$1.html" -nt "$canyon" ]; }

# page NAME SCENARIO [OPTION...]: at one epoch a second, with the four strongest paths of a satellite.
page() {
  stands "$1" && return
  sed -i 's/^rate_hz: .*/rate_hz: 1/' "$2"
  "$canyon" view "$2" --paths 4 --export "$out/$1.html" --quiet "${@:3}"
}

cp "$root"/examples/{synthetic_drive,rtk,faults}.yaml .
page downtown synthetic_drive.yaml

cat >gazebo.yaml <<END
city: {mesh: $root/adapters/gz_sim/worlds/canyon_downtown.sdf}
sky: {nominal: true}
start: 2026-06-01T08:00:00Z
rate_hz: 1
trajectory: {waypoints: [{east_m: -130, north_m: -26, up_m: 1.5}, {east_m: 130, north_m: -26, up_m: 1.5}], speed_mps: 4}
receivers: [{name: car, profile: ublox-m10}]
seed: 1
END
page gazebo gazebo.yaml
page rtk rtk.yaml
page jammed faults.yaml

# A small estimator among towers: it follows what a whole street reflects.
if ! stands bench; then
  "$canyon" bench make bench --only high --quiet
  /usr/bin/python3 bench/ekf.py bench/high estimate.csv
  sed -i 's/^rate_hz: .*/rate_hz: 1/' bench/high/scenario.yaml
  "$canyon" view bench/high --track ekf=estimate.csv --paths 4 --export "$out/bench.html" --quiet
fi

if ! stands map; then
  "$canyon" heatmap synthetic_drive.yaml --spacing 6 --out map --quiet
  "$canyon" view map/map.nc --city synthetic_drive.yaml --export "$out/map.html" --quiet
fi
