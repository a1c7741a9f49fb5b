#!/usr/bin/env bash
# Runs the installed-looking program as a user does and checks exit status, messages and files.
# usage: tests/cli/cli_test.sh CANYON_PROGRAM CASE
set -u
canyon=$1 case=$2
root=$(cd "$(dirname "$0")/../.." && pwd)
data=$root/../shared/data
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work" || exit 1

failed=0
fail() { echo "FAILED: $*"; failed=1; }
# runs STATUS COMMAND...: the command must exit with STATUS; its output goes to files out and err.
runs() {
  local want=$1 status; shift
  timeout 120 "$@" >out 2>err; status=$?
  [ "$status" -eq "$want" ] || { fail "exit status $status instead of $want: $*"; cat err; }
}
# says FILE TEXT...: every text stands in the file.
says() {
  local file=$1 text; shift
  for text in "$@"; do grep -qF -- "$text" "$file" || { fail "$file does not say '$text':"; cat "$file"; }; done
}
# one_line: the error is one line, and the last one.
one_line() {
  [ "$(grep -c '^canyon: ' err)" -eq 1 ] && tail -n 1 err | grep -q '^canyon: ' || { fail "not one line of error:"; cat err; }
}
needs_data() { [ -e "$data/$1" ] || { echo "SKIPPED: real data ../shared/data/$1 is not here"; exit 77; }; }

cat >small.yaml <<'Y'
city: {synthetic: {blocks_east: 3, blocks_north: 3, seed: 2}}
sky: {nominal: true}
start: 2026-03-01T10:00:00Z
trajectory:
  waypoints: [{east_m: -60, north_m: 0, up_m: 2}, {east_m: 60, north_m: 0, up_m: 2}]
  speed_mps: 6
rate_hz: 1
outputs: {pictures: false}
Y

# Two buildings at 48 N, 11 E: one of 30 m, one that says only that it is a house, 80 m east of it.
block_osm() {
  cat <<'X'
<?xml version="1.0" encoding="UTF-8"?>
<osm version="0.6">
 <node id="1" version="1" lat="48.0" lon="11.0"/>
 <node id="2" version="1" lat="48.0" lon="11.0004"/>
 <node id="3" version="1" lat="48.0002" lon="11.0004"/>
 <node id="4" version="1" lat="48.0002" lon="11.0"/>
 <node id="5" version="1" lat="48.0" lon="11.0011"/>
 <node id="6" version="1" lat="48.0" lon="11.0014"/>
 <node id="7" version="1" lat="48.0002" lon="11.0014"/>
 <node id="8" version="1" lat="48.0002" lon="11.0011"/>
 <way id="10" version="1"><nd ref="1"/><nd ref="2"/><nd ref="3"/><nd ref="4"/><nd ref="1"/><tag k="building" v="yes"/><tag k="height" v="30"/></way>
 <way id="11" version="1"><nd ref="5"/><nd ref="6"/><nd ref="7"/><nd ref="8"/><nd ref="5"/><tag k="building" v="house"/></way>
</osm>
X
}

case $case in
help)
  runs 0 "$canyon" --help; says out simulate sky trace city validate
  runs 0 "$canyon" --version; says out canyon
  runs 0 "$canyon" simulate --help
  says out --out --seed --duration --rate --threads --quiet receivers elevation_mask_deg height_above_terrain_m
  runs 2 "$canyon"
  runs 2 "$canyon" simulat
  runs 2 "$canyon" simulate small.yaml ;;
simulate)
  runs 0 "$canyon" simulate small.yaml --out res
  for file in epochs.csv satellites.csv receiver.nmea receiver.obs sky.nav track.kml track.geojson; do
    [ -s "res/$file" ] || fail "no res/$file"
  done
  [ "$(wc -l <res/epochs.csv)" -eq 22 ] || fail "$(wc -l <res/epochs.csv) lines in epochs.csv instead of 21 epochs and a header"
  ls -A res | grep -E 'part|probe' && fail "temporary files left"
  says err city sky trajectory "times real time"
  runs 0 "$canyon" simulate small.yaml --out res2 --quiet
  [ ! -s out ] && [ ! -s err ] || fail "--quiet printed something"
  cmp res/epochs.csv res2/epochs.csv || fail "same seed, other bytes"
  runs 0 "$canyon" simulate small.yaml --out res3 --quiet --seed 9 --duration 5 --rate 2 --threads 1
  [ "$(wc -l <res3/epochs.csv)" -eq 12 ] || fail "--duration 5 --rate 2 is not 11 epochs" ;;
pictures)
  sed -i 's/outputs:.*/outputs: {pictures: true}/' small.yaml
  runs 0 "$canyon" simulate small.yaml --out res
  for file in track skyplot timeline; do
    [ "$(head -c 4 "res/$file.png" | tail -c 3)" = PNG ] || fail "res/$file.png is no PNG"
    grep -q '<svg' "res/$file.svg" || fail "res/$file.svg is no SVG"
  done ;;
sky)
  runs 0 "$canyon" sky --at 22.3,114.17,10 --time 2026-03-01T10:00:00Z; says out azimuth G0 E R C "satellites above"
  runs 0 "$canyon" sky --at 22.3,114.17,10 --time 2026-03-01T10:00:00Z --systems GPS --json
  says out '"satellites"' '"azimuth_deg"'; grep -q '"E' out && fail "Galileo although --systems GPS"
  runs 2 "$canyon" sky --at 2230,114.17,10 --time 2026-03-01T10:00:00Z; one_line; says err latitude -90
  runs 2 "$canyon" sky --at 22.3 --time 2026-03-01T10:00:00Z; one_line; says err LATITUDE
  runs 2 "$canyon" sky --at 22.3,114.17,10 --time yesterday; one_line; says err yesterday 2019-04-28
  runs 2 "$canyon" sky --at 22.3,114.17,10 --time 2026-03-01T10:00:00Z --systems GSP; one_line; says err GSP
  runs 2 "$canyon" sky --nav absent.20n --at 22.3,114.17,10 --time 2026-03-01T10:00:00Z; one_line; says err absent.20n ;;
sky_real)
  needs_data urbannav-tst-20190428/hksc1180.19n
  runs 0 "$canyon" sky --nav "$data/urbannav-tst-20190428/hksc1180.19n" "$data/urbannav-tst-20190428/hksc1180.19b" \
    --at 22.30115538,114.17900033,6.6 --time 2019-04-28T12:58:03Z
  says out G C hksc1180.19n hksc1180.19b
  runs 2 "$canyon" sky --nav "$data/urbannav-tst-20190428/groundTruth_TST.csv" --at 22.3,114.2,6 --time 2019-04-28T12:58:03Z
  one_line; says err groundTruth_TST.csv ;;
trace)
  runs 0 "$canyon" trace small.yaml --enu 0,0,2; says out azimuth visibility direct
  runs 0 "$canyon" trace small.yaml --json; says out '"paths"' '"excess_path_m"'
  { cat small.yaml; echo 'propagation: {reflection_order: 2}'; } >twice.yaml
  runs 0 "$canyon" trace twice.yaml --enu 0,0,2; says out 'reflected twice' 'before that'
  runs 0 "$canyon" trace twice.yaml --enu 0,0,2 --json; says out '"order": 2' '"far_point_enu_m"' '"far_incidence_deg"'
  runs 2 "$canyon" trace small.yaml --receiver nobody; one_line; says err nobody rover
  runs 2 "$canyon" trace small.yaml --enu 1,2; one_line; says err EAST,NORTH,UP
  runs 2 "$canyon" trace small.yaml --enu nan,0,2; one_line ;;
validate)
  # Canyon's own receiver as the recorded one: made, then judged by the same scenario.
  sed -i 's/speed_mps: 6/speed_mps: 3/' small.yaml; echo 'noise: {enabled: false}' >>small.yaml
  runs 0 "$canyon" simulate small.yaml --out res --quiet
  awk -F, 'NR > 1 {print $1 "," $2 "," $3 "," $4 "," $5}' res/epochs.csv >truth.csv
  sed 's/^sky:.*/sky: {navigation: [res\/sky.nav]}/' small.yaml >judge.yaml
  judge=("$canyon" validate judge.yaml --obs res/receiver.obs --truth truth.csv --truth-format urbannav --no-atmosphere)
  runs 0 "${judge[@]}" --json figures.json --markdown table.md --report rep
  says out "whole recording" "epochs" AUC "Tracked satellites" "Fixes by the same solver"
  python3 - <<'P' || fail "figures.json is not what was simulated"
import json
f = json.load(open("figures.json"))["models"][0]
assert 39 <= f["epochs"] <= 41 and f["position"]["measured"]["fixes"] == f["epochs"]
# The recorded receiver is the simulated one.
for view in "los", "nlos":
    t = f["tracked"][view]
    assert t["measured"] == t["simulated"], t
p = f["position"]
assert abs(p["measured"]["horizontal_error_m"]["p95"] - p["simulated"]["horizontal_error_m"]["p95"]) < 0.1, p
P
  [ -s rep/report.html ] && [ -s table.md ] || fail "no report or no table"
  grep -qE '\b(nan|inf)\b' out figures.json table.md && fail "a number that is none"
  runs 0 "${judge[@]}" --align --reach 4 --models mirror,specular --json - --quiet
  python3 -c 'import json; f = json.load(open("out")); assert len(f["models"]) == 3 and 19 <= f["alignment"]["epochs"] <= 21, f' || fail "--json - is not what was asked for"
  [ ! -s err ] || fail "--quiet printed something"
  runs 0 "${judge[@]}" --align --align-heading --split 0.6 --ladder
  says out "city moved by east" "turned by" "last 40 %" "+ ground reflection" "| mirror"
  runs 2 "${judge[@]}" --split 0.5; one_line; says err --align
  runs 2 "${judge[@]}" --align --split 1.5; one_line; says err --split
  runs 2 "${judge[@]}" --align --split 0.1; one_line; says err epochs
  runs 2 "${judge[@]}" --align --reach 1; one_line; says err reach
  runs 2 "${judge[@]}" --models miror; one_line; says err miror "'mirror'"
  runs 2 "${judge[@]}" --models mirror --ladder
  runs 2 "$canyon" validate judge.yaml --obs res/receiver.obs --truth truth.csv --truth-format gpx; one_line; says err gpx urbannav
  runs 2 "${judge[@]}" --report judge.yaml; one_line; says err judge.yaml
  runs 2 "$canyon" validate judge.yaml --obs res/receiver.obs; one_line; says err --truth
  runs 2 "$canyon" validate judge.yaml --obs none.obs --truth truth.csv; one_line; says err none.obs
  runs 2 "$canyon" validate judge.yaml --obs truth.csv --truth truth.csv; one_line; says err truth.csv
  runs 2 "$canyon" validate judge.yaml --obs res/receiver.obs --truth truth.csv --truth-format urbannav; one_line; says err Klobuchar
  sed 's/^[0-9]*,/2000,/' truth.csv >other.csv
  runs 2 "$canyon" validate judge.yaml --obs res/receiver.obs --truth other.csv --truth-format urbannav --no-atmosphere
  one_line; says err other.csv truth
  ls -A . rep | grep -E 'part|probe' && fail "temporary files left" ;;
validate_real)
  needs_data urbannav-tst-20190428/COM3_190428_124409.obs
  drive=$data/urbannav-tst-20190428
  sed -e "s#hongkong/#$data/hongkong/#; s#urbannav-tst-20190428/#$drive/#g" "$root/examples/urbannav_tst.yaml" >tst.yaml
  runs 0 "$canyon" validate tst.yaml --obs "$drive/COM3_190428_124409.obs" --align --models mirror,specular --report rep --json figures.json
  says out "city moved by" "first half" "second half" "242 epochs" reflected
  python3 - <<'P' || fail "the drive's figures are not those of docs/validate.md"
import json
f = json.load(open("figures.json"))
assert abs(f["alignment"]["east_m"] + 2) < 2 and abs(f["alignment"]["north_m"]) < 2, f["alignment"]
mirror, specular = f["models"][1], f["models"][2]
assert abs(specular["separation_by_error"]["auc"] - 0.907) < 0.03
assert abs(specular["separation_by_cn0"]["auc"] - 0.861) < 0.03
assert specular["explained"][-1]["spearman"]["rho"] > mirror["explained"][-1]["spearman"]["rho"] + 0.2
P
  [ -s rep/report.html ] || fail "no report" ;;
skyplot)
  runs 0 "$canyon" skyplot --help
  says out --out --frames --at --enu --time --receiver --style --projection --trails --width --every --first --last --threads "east to the LEFT"
  # One picture: files, sizes, and nothing left behind.
  runs 0 "$canyon" skyplot small.yaml -o sky.png --trails 30; says err sky.png
  runs 0 "$canyon" skyplot small.yaml -o up.svg --style fisheye --projection stereographic --enu 0,0,2 --quiet
  [ ! -s out ] && [ ! -s err ] || fail "--quiet printed something"
  # size PNG: width and height as the header (IHDR) has them.
  size() { od -An -tu1 -j16 -N8 "$1" | awk '{print ($3 * 256 + $4) "x" ($7 * 256 + $8)}'; }
  [ "$(size sky.png)" = 1980x1672 ] || fail "sky.png is $(size sky.png)"
  python3 -c 'import sys, xml.dom.minidom as m; assert m.parse(sys.argv[1]).documentElement.tagName == "svg"' up.svg || fail "up.svg is not well-formed"
  runs 0 "$canyon" skyplot small.yaml -o small.png --width 400 --time 2026-03-09T10:00:00Z; says err warning: "stands at its end"
  [ "$(size small.png)" = 400x338 ] || fail "small.png is $(size small.png)"
  # Frames: 20 s of drive every 4 s are six; the same bytes on any number of threads.
  runs 0 "$canyon" skyplot small.yaml --frames film --style fisheye --width 300 --every 4 --threads 1; says err "6 frames"
  [ "$(cd film && echo *)" = "$(printf 'frame_%06d.png ' 1 2 3 4 5 6 | sed 's/ $//')" ] || fail "film holds $(ls film)"
  [ "$(size film/frame_000006.png)" = 300x253 ] || fail "a frame is $(size film/frame_000006.png)"
  runs 0 "$canyon" skyplot small.yaml --frames film2 --style fisheye --width 300 --every 4 --quiet
  diff -r film film2 || fail "other bytes on another number of threads"
  cmp -s film/frame_000001.png film/frame_000006.png && fail "the drive does not move"
  runs 0 "$canyon" skyplot small.yaml --frames film --style fisheye --width 300 --every 4 --first 4 --last 2026-03-01T10:00:12Z
  says err "3 frames" "frame_000004.png and what follows it"
  cmp film/frame_000003.png film2/frame_000004.png || fail "12 s after the start looks otherwise when it comes third"
  # Inside a building.
  runs 0 "$canyon" skyplot small.yaml -o in.png --width 300 --enu 30,30,1; says err warning: "inside a building"
  runs 0 "$canyon" skyplot small.yaml --frames indoors --width 300 --enu 30,30,1 --last 1 --quiet; says err warning: "2 of 2 frames"
  # Bad input: one line each, and no file.
  runs 2 "$canyon" skyplot small.yaml; one_line; says err --frames
  runs 2 "$canyon" skyplot small.yaml -o bad.jpg; one_line; says err bad.jpg .png .svg
  runs 2 "$canyon" skyplot small.yaml -o absent/bad.png; one_line; says err absent
  runs 2 "$canyon" skyplot small.yaml -o bad.png --enu 1,2; one_line; says err EAST,NORTH,UP
  runs 2 "$canyon" skyplot small.yaml -o bad.png --at 48,11,500; one_line; says err --at km
  runs 2 "$canyon" skyplot small.yaml -o bad.png --width 100; one_line; says err 200
  runs 2 "$canyon" skyplot small.yaml -o bad.png --trails 2000; one_line; says err 1440
  runs 2 "$canyon" skyplot small.yaml -o bad.png --receiver nobody; one_line; says err nobody
  runs 2 "$canyon" skyplot small.yaml -o bad.png --time soon; one_line; says err soon
  runs 2 "$canyon" skyplot small.yaml --frames none --first 9 --last 3; one_line; says err --last
  runs 2 "$canyon" skyplot small.yaml --frames none --every 0; one_line; says err --every
  runs 2 "$canyon" skyplot small.yaml --frames film -o bad.png
  runs 2 "$canyon" skyplot small.yaml -o bad.png --style round; says err sky fisheye
  runs 0 "$canyon" simulate small.yaml --out good --quiet
  sed 's/^sky.*/sky: {navigation: [good\/sky.nav]}/' small.yaml >files.yaml
  runs 0 "$canyon" skyplot files.yaml -o files.png --width 300 --quiet
  runs 2 "$canyon" skyplot files.yaml -o bad.png --time 2026-03-09T10:00:00Z; one_line; says err --time 2026-03-09 2026-03-01
  [ ! -e bad.png ] || fail "bad input left a picture"
  ls -A . film | grep part && fail "temporary files left"
  # Ctrl-C: whole frames without a gap.
  "$canyon" skyplot small.yaml --frames long --style fisheye --every 0.001 >out 2>err &
  program=$!
  for _ in $(seq 600); do [ -e long/frame_000003.png ] && break; sleep 0.1; done
  kill -INT "$program"; wait "$program"; status=$?
  [ "$status" -eq 130 ] || { fail "exit status $status instead of 130"; cat err; }
  finished=$(sed -n 's/.*interrupted: \([0-9]*\) of 20001 frames.*/\1/p' err)
  [ "$(ls -A long | wc -l)" -eq "${finished:-0}" ] || fail "said $finished frames, wrote $(ls -A long | wc -l)"
  [ "$(ls long | tail -n 1)" = "$(printf 'frame_%06d.png' "${finished:-0}")" ] || fail "the frames have a gap" ;;
city)
  printf 'v 0 0 0\nv 10 0 0\nv 10 0 10\nv 0 0 10\nf 1 2 3 4\n' >wall.obj
  runs 0 "$canyon" city info wall.obj; says out triangles "2 (0 terrain)"
  runs 0 "$canyon" city info small.yaml --json; says out '"buildings"' '"highest_roof_m"'
  runs 2 "$canyon" city info absent.dae; one_line; says err absent.dae
  printf 'v 0 0 0\n' >empty.obj
  runs 2 "$canyon" city info empty.obj; one_line; says err empty.obj
  printf 'garbage' >bad.xyz
  runs 2 "$canyon" city info bad.xyz; one_line; says err bad.xyz .obj ;;
city_build)
  block_osm >block.osm
  runs 0 "$canyon" city build block.osm -o city.canyon -o city.glb -o city.obj -o city.dae -o map.geojson -o town.world -o model/
  says out "buildings   2" "1 tagged, 0 from levels, 1 by default" "triangles"
  grep -q '"height_source":"default"' map.geojson || fail "map.geojson does not say where heights come from"
  grep -q spherical_coordinates town.world || fail "town.world has no spherical_coordinates"
  [ -s model/model.sdf ] && [ -s model/model.config ] || fail "no Gazebo model"
  for file in city.canyon city.glb city.obj city.dae town.world model block.osm; do
    runs 0 "$canyon" city info "$file"; says out "buildings     2" "highest roof  30.0 m"
  done
  runs 0 "$canyon" city build city.canyon -o again.glb --quiet
  [ ! -s out ] && [ ! -s err ] || fail "--quiet printed something"
  runs 0 "$canyon" city build block.osm -o half.canyon --bbox 11.0009,47.999,11.003,48.003 --height house=7 --json
  says out '"buildings": 1' '"heights_default": 1' '"highest_roof_m": 6.9999'
  runs 0 "$canyon" city build block.osm -o utm.obj --utm --origin 48,11,0; says out triangles
  runs 0 "$canyon" city info utm.obj --json; says out '"buildings": 2'
  runs 2 "$canyon" city build block.osm -o utm.canyon --utm; one_line; says err utm.canyon --utm
  runs 0 "$canyon" city view city.canyon -o city.png --size 640x400 --angle 90
  [ "$(head -c 4 city.png | tail -c 3)" = PNG ] || fail "city.png is no PNG"
  ls -A | grep -E 'part|probe' && fail "temporary files left" ;;
city_simulate)
  block_osm >block.osm
  sed 's/^city.*/city: {osm: block.osm, origin: {latitude_deg: 48, longitude_deg: 11}}/' small.yaml >map.yaml
  runs 0 "$canyon" simulate map.yaml --out map --quiet
  runs 0 "$canyon" city build block.osm -o block.canyon --origin 48,11,0 --quiet
  for city in 'file: block.canyon' 'mesh: block.canyon' 'file: block.osm, origin: {latitude_deg: 48, longitude_deg: 11}'; do
    sed "s/^city.*/city: {$city}/" small.yaml >file.yaml
    runs 0 "$canyon" simulate file.yaml --out file --quiet
    cmp map/satellites.csv file/satellites.csv || fail "city: {$city} gives other satellites than the map"
  done
  grep -q blocked map/satellites.csv || fail "no building blocks anything" ;;
city_real)
  needs_data osm/moscow.osm.gz
  runs 0 "$canyon" city build "$data/osm/moscow.osm.gz" -o moscow.canyon
  says out "buildings   628" "parts       42" "highest roof 540.0 m" ;;
bad_city)
  block_osm >block.osm
  printf 'garbage' >bad.osm
  runs 2 "$canyon" city build bad.osm -o c.canyon; one_line; says err bad.osm
  printf '<?xml version="1.0"?><gpx></gpx>' >gpx.osm
  runs 2 "$canyon" city build gpx.osm -o c.canyon; one_line; says err gpx.osm
  head -c 600 block.osm >cut.osm
  runs 2 "$canyon" city build cut.osm -o c.canyon; one_line; says err cut.osm
  gzip -c block.osm | head -c 200 >cut.osm.gz
  runs 2 "$canyon" city build cut.osm.gz -o c.canyon; one_line; says err cut.osm.gz
  head -c 500 /dev/urandom >cut.osm.pbf
  runs 2 "$canyon" city build cut.osm.pbf -o c.canyon; one_line; says err cut.osm.pbf
  printf '<osm version="0.6"><node id="1" lat="48" lon="11"/></osm>' >none.osm
  runs 2 "$canyon" city build none.osm -o c.canyon; one_line; says err none.osm building
  sed 's/lat="48.0"/lat="98.0"/' block.osm >pole.osm
  runs 2 "$canyon" city build pole.osm -o c.canyon; one_line; says err pole.osm
  printf '{"type": "FeatureCollection"}' >x.json
  runs 2 "$canyon" city build x.json -o c.canyon; one_line; says err x.json CityJSON
  printf 'no raster' >t.tif
  runs 2 "$canyon" city build block.osm -o c.canyon --terrain t.tif; one_line; says err t.tif raster
  runs 2 "$canyon" city build block.osm -o c.xyz; one_line; says err c.xyz .canyon
  runs 2 "$canyon" city build block.osm -o no/c.glb; one_line; says err no/c.glb
  runs 2 "$canyon" city build block.osm wall.obj -o c.glb; one_line; says err wall.obj
  runs 2 "$canyon" city build block.osm -o c.glb --bbox 1,2,3; one_line; says err WEST
  runs 2 "$canyon" city build block.osm -o c.glb --bbox 179,1,-179,2; one_line; says err antimeridian
  runs 2 "$canyon" city build block.osm -o c.glb --bbox 1,2,3,4; one_line; says err "in the box"
  runs 2 "$canyon" city build block.osm -o c.glb --origin 0,0,0; one_line; says err km bbox
  runs 2 "$canyon" city build block.osm -o c.glb --height house; one_line; says err TYPE=METRES
  runs 2 "$canyon" city build block.osm -o c.glb --level-height 0; one_line; says err level_m
  runs 2 "$canyon" city build -o c.glb; one_line; says err nothing
  runs 2 "$canyon" city build -o c.glb --overpass http://127.0.0.1:9/ --bbox 11,48,11.01,48.01 --cache cache; one_line
  printf 'canyon?' >bad.canyon
  runs 2 "$canyon" city info bad.canyon; one_line; says err bad.canyon
  runs 2 "$canyon" city view block.osm -o c.jpg; one_line; says err c.jpg
  runs 2 "$canyon" city view block.osm -o c.png --size 10; one_line; says err --size
  runs 0 "$canyon" city build block.osm -o block.canyon --quiet
  sed 's/^city.*/city: {file: block.canyon, origin: {latitude_deg: 48, longitude_deg: 11}}/' small.yaml >bad.yaml
  runs 2 "$canyon" simulate bad.yaml --out res; one_line; says err bad.yaml:1: origin
  sed 's/^city.*/city: {osm: block.osm, heading_deg: 3}/' small.yaml >bad.yaml
  runs 2 "$canyon" simulate bad.yaml --out res; one_line; says err bad.yaml:1: heading_deg
  sed 's/^city.*/city: {osm: block.osm, bbox: [1, 2, 3]}/' small.yaml >bad.yaml
  runs 2 "$canyon" simulate bad.yaml --out res; one_line; says err bad.yaml:1: bbox
  ls c.* 2>/dev/null && fail "bad input left results" ;;
bad_scenario)
  sed 's/speed_mps/sped_mps/' small.yaml >bad.yaml
  runs 2 "$canyon" simulate bad.yaml --out res; one_line; says err bad.yaml:6: sped_mps speed_mps
  sed 's/up_m: 2/up_m: 2 m/' small.yaml >bad.yaml
  runs 2 "$canyon" simulate bad.yaml --out res; one_line; says err bad.yaml:5:
  sed 's/up_m: 2}/up_m: .nan}/' small.yaml >bad.yaml
  runs 2 "$canyon" simulate bad.yaml --out res; one_line; says err bad.yaml:5:
  printf 'city: {synthetic: {}\n' >bad.yaml
  runs 2 "$canyon" simulate bad.yaml --out res; one_line; says err bad.yaml:
  sed 's/^city.*/city: {mesh: absent.dae, origin: {latitude_deg: 22, longitude_deg: 114, height_m: 0}}/' small.yaml >bad.yaml
  runs 2 "$canyon" simulate bad.yaml --out res; one_line; says err bad.yaml:1: absent.dae
  printf 'v 0 0 0\n' >empty.obj
  sed 's/^city.*/city: {mesh: empty.obj, origin: {latitude_deg: 22, longitude_deg: 114, height_m: 0}}/' small.yaml >bad.yaml
  runs 2 "$canyon" simulate bad.yaml --out res; one_line; says err empty.obj
  runs 2 "$canyon" simulate absent.yaml --out res; one_line; says err absent.yaml
  [ ! -e res/epochs.csv ] || fail "bad input left results" ;;
bad_trajectory)
  sed '/waypoints/,/speed/d' small.yaml >base.yaml
  with_file() { { cat base.yaml; } | sed "s/^trajectory:.*/trajectory: {file: $1}/" >bad.yaml; }
  printf 'time,latitude,longitude,height\n0,22.3,114.17,nan\n1,22.3,114.17,2\n' >t.csv; with_file t.csv
  runs 2 "$canyon" simulate bad.yaml --out res; one_line; says err t.csv:2:
  printf 'time,latitude,longitude,height\n0,2230.1,114.17,2\n1,2230.2,114.17,2\n' >t.csv; with_file t.csv
  runs 2 "$canyon" simulate bad.yaml --out res; one_line; says err t.csv:2: latitude
  printf 'time,latitude,longitude,height\n0,22.3,114.17,2\n5,22.3,114.17,2\n4,22.3,114.17,2\n' >t.csv; with_file t.csv
  runs 2 "$canyon" simulate bad.yaml --out res; one_line; says err t.csv:4:
  printf 'time,latitude,longitude,height\n0,48.1,11.6,2\n5,48.1,11.6,2\n' >t.csv; with_file t.csv
  runs 2 "$canyon" simulate bad.yaml --out res; one_line; says err km
  : >t.csv; with_file t.csv
  runs 2 "$canyon" simulate bad.yaml --out res; one_line; says err t.csv
  [ ! -e res/epochs.csv ] || fail "bad input left results" ;;
bad_sky)
  head -c 3000 /dev/urandom >garbage.nav
  sed 's/^sky.*/sky: {navigation: [garbage.nav]}/' small.yaml >bad.yaml
  runs 2 "$canyon" simulate bad.yaml --out res; one_line; says err garbage.nav
  : >empty.nav
  sed 's/^sky.*/sky: {navigation: [empty.nav]}/' small.yaml >bad.yaml
  runs 2 "$canyon" simulate bad.yaml --out res; one_line; says err empty.nav
  runs 0 "$canyon" simulate small.yaml --out good --quiet
  head -c 4000 good/sky.nav >cut.nav
  sed 's/^sky.*/sky: {navigation: [cut.nav]}/' small.yaml >bad.yaml
  runs 0 "$canyon" simulate bad.yaml --out res; says err warning: cut.nav:
  sed 's/^sky.*/sky: {navigation: [good\/sky.nav]}/; s/^start.*/start: 2026-04-01T10:00:00Z/' small.yaml >bad.yaml
  runs 2 "$canyon" simulate bad.yaml --out res2; one_line; says err 2026-04-01 allow_stale
  [ ! -e res2/epochs.csv ] || fail "bad input left results" ;;
bad_output)
  : >file
  runs 2 "$canyon" simulate small.yaml --out file; one_line; says err file
  if [ "$(id -u)" -ne 0 ]; then
    mkdir locked; chmod 500 locked
    runs 2 "$canyon" simulate small.yaml --out locked/res; one_line; says err locked
  else
    runs 2 "$canyon" simulate small.yaml --out /proc/res; one_line; says err /proc/res
  fi
  # A disk that takes no more (here: a limit on the size of files): one clear error, and what an earlier run left
  # stays as it was.
  runs 0 "$canyon" simulate small.yaml --out res --quiet
  cp res/satellites.csv before.csv
  runs 2 bash -c 'trap "" XFSZ; ulimit -f 8; exec "$0" simulate small.yaml --out res --quiet --seed 2' "$canyon"
  one_line; says err res/ "cannot be written"
  cmp before.csv res/satellites.csv || fail "a failed run spoilt an older file"
  ls -A res | grep part && fail "temporary files left" ;;
interrupt)
  # Long enough to be interrupted for certain: a day at 10 Hz.
  sed 's/rate_hz.*/rate_hz: 10/; s/speed_mps.*/speed_mps: 0.001/' small.yaml >long.yaml
  "$canyon" simulate long.yaml --out res >out 2>err &
  program=$!
  # Wait until epochs flow, with a deadline.
  for _ in $(seq 200); do ls res/*.part* >/dev/null 2>&1 && [ "$(cat res/epochs.csv.part* | wc -l)" -gt 10 ] && break; sleep 0.1; done
  kill -INT "$program"; wait "$program"; status=$?
  [ "$status" -eq 130 ] || { fail "exit status $status instead of 130"; cat err; }
  says err interrupted "epochs finished"
  for file in epochs.csv satellites.csv receiver.nmea receiver.obs sky.nav; do [ -s "res/$file" ] || fail "no res/$file"; done
  finished=$(sed -n 's/.*interrupted: \([0-9]*\) of.*/\1/p' err)
  [ "$(wc -l <res/epochs.csv)" -eq $((finished + 1)) ] || fail "said $finished epochs, wrote $(wc -l <res/epochs.csv) lines"
  ls -A res | grep part && fail "temporary files left" ;;
*) echo "no case '$case'"; exit 2 ;;
esac
exit "$failed"
