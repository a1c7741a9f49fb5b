#!/usr/bin/env bash
# Runs the program like a user and checks exit status, messages and files.
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
# says FILE TEXT...: every text is in the file.
says() {
  local file=$1 text; shift
  for text in "$@"; do grep -qF -- "$text" "$file" || { fail "$file does not say '$text':"; cat "$file"; }; done
}
# one_line: the error is one line, and the last one.
one_line() {
  [ "$(grep -c '^canyon: ' err)" -eq 1 ] && tail -n 1 err | grep -q '^canyon: ' || { fail "not one line of error:"; cat err; }
}
# schema_holds FILE: a view's header conforms to viewer/schema.json.
schema_holds() {
  python3 -c 'import jsonschema' 2>/dev/null || { echo "SKIPPED: the schema (no python3-jsonschema)"; return; }
  python3 -c 'import json, sys, jsonschema; jsonschema.validate(json.load(open(sys.argv[1])), json.load(open(sys.argv[2])))' \
    "$1" "$root/viewer/schema.json" || fail "$1 is not what the schema says"
}
# local_tileset FILE: a tile of one triangle, and a missing one.
local_tileset() {
  local box='"boundingVolume":{"sphere":[0,0,0,20]},"geometricError":'
  local floats; floats=$(printf '%b' '\0\0\0\0\0\0\0\0\0\0\0\0\0\0\x10A\0\0\0\0\0\0\0\0\0\0\0\0\0\0\x10A\0\0\0\0' | base64 -w 0)
  cat >"${1%/*}.gltf" <<EOF
{"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
 "buffers":[{"byteLength":36,"uri":"data:;base64,$floats"}],"bufferViews":[{"buffer":0,"byteLength":36}],
 "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}]}
EOF
  printf '{"asset":{"version":"1.1"},"geometricError":9,"root":{%s9,"refine":"ADD","content":{"uri":"%s.gltf"},"children":[{%s0,"content":{"uri":"missing.glb"}}]}}' \
    "$box" "${1%/*}" "$box" >"$1"
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

# Two buildings at 48 N, 11 E: one of 30 m, one tagged only as a house, 80 m east of it.
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

# needs_ranks COMMAND...: skips the case without mpirun, and checks that one of two processes without MPI's
# library fails, since each would compute everything, and that a single one, also in a Slurm job, needs none. Sets ranks.
needs_ranks() {
  command -v mpirun >/dev/null || { echo "SKIPPED: mpirun is not installed"; exit 77; }
  mkdir absent
  for library in libmpi.so.40 libmpi.so.12; do echo none >absent/$library; done
  runs 2 env LD_LIBRARY_PATH=absent OMPI_COMM_WORLD_RANK=0 OMPI_COMM_WORLD_SIZE=2 "$@"
  one_line; says err "libmpi.so" "cannot be loaded" openmpi-bin "--shard K/N"
  runs 0 env LD_LIBRARY_PATH=absent OMPI_COMM_WORLD_RANK=0 OMPI_COMM_WORLD_SIZE=1 SLURM_PROCID=0 SLURM_NTASKS=8 "$@"
  # Also as root (containers), on machines with one core, and in parallel with other tests.
  export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 OMPI_MCA_rmaps_base_oversubscribe=1
  export PRTE_MCA_rmaps_default_mapping_policy=:oversubscribe
  ranks=(mpirun --bind-to none -n)
}
# lose_a_rank N OF COMMAND...: kills one of two ranks once OF, a function, counts N. The job must fail.
lose_a_rank() {
  local many=$1 count=$2 program victim; shift 2
  "${ranks[@]}" 2 "$@" >out 2>err &
  program=$!
  for _ in $(seq 3000); do
    [ "$($count)" -ge "$many" ] && break
    kill -0 "$program" 2>/dev/null || break
    sleep 0.01
  done
  victim=$(pgrep -P "$program" -x "$(basename "$canyon")" | tail -n 1)
  [ -n "$victim" ] && kill -KILL "$victim" || fail "no rank to kill"
  wait "$program" && fail "a lost rank went unnoticed"
}

# Maps of a receiver with signal strength take a thousand times as long.
case $case in heatmap*) echo 'receivers: [{profile: ideal, elevation_mask_deg: 10, noise: {enabled: true}}]' >>small.yaml ;; esac

case $case in
help)
  runs 0 "$canyon" --help; says out simulate sky trace city validate calibrate heatmap
  runs 0 "$canyon" --version; says out canyon
  runs 0 "$canyon" simulate --help
  says out --out --seed --duration --rate --threads --quiet rinex_observation pictures "canyon scenario keys"
  runs 0 "$canyon" scenario keys; says out elevation_mask_deg height_above_terrain_m
  # Each command accepts --quiet and the options in the last block of each help.
  commands_of() { "$canyon" "$@" --help | awk '/^S[Uu][Bb][Cc][Oo][Mm][Mm][Aa][Nn][Dd][Ss]/ {on = 1; next} /^[^ ]/ {on = 0} on && /^  [a-z]/ {print $1}'; }
  for command in $(commands_of); do
    "$canyon" "$command" --help | grep -q -- --quiet || [ -n "$(commands_of "$command")" ] || fail "$command takes no --quiet"
    for inner in $(commands_of "$command"); do
      "$canyon" "$command" "$inner" --help | grep -q -- --quiet || fail "$command $inner takes no --quiet"
    done
  done
  runs 0 "$canyon" profiles --quiet; says out ublox-m10
  runs 0 "$canyon" faults list --quiet; runs 0 "$canyon" scenario schema --quiet
  # Without a command: the help. An unknown word or option: a hint with the closest known one.
  runs 2 "$canyon"; says err simulate heatmap "Exit status"
  runs 2 "$canyon" simulat; one_line; says err "no command 'simulat'" "did you mean 'simulate'?"
  runs 2 "$canyon" city inof small.yaml; one_line; says err "no command 'inof'" "'info'"
  runs 2 "$canyon" city xyzzy; one_line; says err "no command 'xyzzy'" "info, build"
  runs 2 "$canyon" simulat --help; one_line; says err "did you mean 'simulate'?"
  # Output without a reader: reported, or no error if a reader has closed its end; a run ends with its files.
  for words in "--help" "scenario keys" "check small.yaml"; do
    "$canyon" $words 2>err >/dev/full && fail "rc 0 of $words to a full disk"
    says err "standard output cannot be written: No space left on device"
  done
  "$canyon" simulate small.yaml --out piped --duration 5 2>/dev/null | true
  [ "${PIPESTATUS[0]}" -eq 0 ] || fail "a reader that went away ended the run"
  "$canyon" simulate small.yaml --out full --duration 5 >/dev/null 2>/dev/full || fail "standard error on a full disk ended the run"
  "$canyon" simulate small.yaml --out closed --duration 5 >&- 2>&- || fail "closed handles ended the run"
  for each in full closed; do diff -r piped $each || fail "other files"; done
  runs 2 "$canyon" simulate small.yaml --ouut res; one_line; says err "no option '--ouut'" "'--out'"
  runs 2 "$canyon" simulate small.yaml --colour; one_line; says err "canyon simulate --help"
  runs 2 "$canyon" simulate small.yaml ;;
odd)
  # Valid input that is usually a mistake: a warning, and the run.
  sed 's/^start.*/start: 2026-03-01T10:00:00/; s/speed_mps.*/speed_mps: 2000/' small.yaml >odd.yaml
  runs 0 "$canyon" simulate odd.yaml --out res
  says err "start: 2026-03-01T10:00:00 has no time zone" "taken as UTC" "no vehicle moves at 2000 m/s"
  sed 's/^start.*/start: 2026-03-01T11:00:00+01:00/; s/2000/6/' odd.yaml >plain.yaml
  runs 0 "$canyon" simulate plain.yaml --out res2; grep warning err && fail "an ordinary scenario is warned of"
  runs 0 "$canyon" sky --at 22.3,114.17,10 --time 2026-03-01T10:00:00; says err "has no time zone"
  runs 0 "$canyon" sky --at 22.3,114.17,10 --time '2026-03-01 10:00:00 GPST'; [ ! -s err ] || fail "GPST is a zone"
  sed '/waypoints/,/speed/d' small.yaml | sed 's/^trajectory:.*/trajectory: {file: t.csv}/' >file.yaml
  printf 'time,latitude,longitude,height\n2026-03-01T10:00:00,22.3,114.17,2\n2026-03-01T10:00:01,22.3,114.17,2\n' >t.csv
  runs 0 "$canyon" simulate file.yaml --out res3; says err "t.csv:2: time without time zone (the first of 2); taken as UTC"
  # Times before GPS and beyond its week 9999.
  for start in 1975-06-01 1700-01-01T00:00:00Z 1980-01-05T23:59:59Z 2171-09-01T00:00:00Z 1650-01-01; do
    sed "s/^start.*/start: $start/" small.yaml >old.yaml
    runs 2 "$canyon" simulate old.yaml --out old; one_line; says err old.yaml:3: "$start" 1980-01-06 2171-08-31
  done
  [ ! -e old ] || fail "a time out of range left results"
  sed 's/^start.*/start: 1980-01-06T00:00:00Z/' small.yaml >first.yaml
  runs 0 "$canyon" simulate first.yaml --out first --quiet ;;
check)
  # Each kind of file of the cases, by one command.
  cp -r "$root"/tests/data/cases/* .
  runs 0 "$canyon" check nmea-gnsslogger/log.nmea; says out 'recorded path (nmea)' '2024-05-01' 'good for'
  runs 0 "$canyon" check gpx-pause/pause.gpx; says out 'recorded path (gpx)' 'has 1 pause'
  runs 0 "$canyon" check text-bom/bom.csv text-bom/bom.n sp3-two-days/day1.sp3 osm-josm-delete/edited.osm
  says out 'recorded path (csv)' 'RINEX navigation' 'GPS 1' 'SP3 precise orbits' 'buildings     1'
  runs 0 "$canyon" check nmea-gga-no-altitude/all2d.nmea; says out 'it has no heights'
  runs 0 "$canyon" check kml-timestamped-points/trail.kml; says out '7 points, 2026-06-01T12:00:00Z to 2026-06-01T12:01:00Z' '334 m'
  runs 0 "$canyon" check gpx-time-zone-name/named.gpx; says out '6 points, 2026-06-01T13:32:37Z to 2026-06-01T13:33:02Z'
  printf 'ULog\001\0225\001' >flight.ulg; runs 2 "$canyon" check flight.ulg; one_line; says err 'flight log of PX4 (ULog)' 'ulog2csv'
  printf '\243\225\200\200YFMT' >flight.bin; runs 2 "$canyon" check flight.bin; one_line; says err 'DataFlash' 'mavlogdump.py'
  mkdir bag; echo 'rosbag2_bagfile_information: {version: 5}' >bag/metadata.yaml
  for path in bag bag/metadata.yaml; do runs 2 "$canyon" check $path; one_line; says err 'is a bag of ROS 2' 'ros2 topic echo'; done
  runs 0 "$canyon" city build citygml-future-demolition/planned.gml --geoid-undulation 0 -o ends.geojson --quiet
  says err 'left out 1 Building objects that are demolished'
  for id in planned_2045 open_end_2099; do grep -q "\"$id\"" ends.geojson || fail "$id is not built"; done
  # Omitted parts of a world are reported by each command, once, also with --quiet.
  cd world-parts-missing || exit 1
  for command in 'simulate run.yaml --out res --quiet' 'trace run.yaml' 'skyplot run.yaml -o s.png --quiet' 'city info world.sdf' \
                 'heatmap run.yaml --out map --spacing 50 --times 2026-06-01T08:00:00Z --quiet' 'city build world.sdf -o w.obj --quiet'; do
    # shellcheck disable=SC2086
    runs 0 "$canyon" $command; says err "mesh 'model://tower" "'model://office_block' is not in" '1 <heightmap> geometries left out'
    [ "$(grep -c ^warning: err)" -eq 3 ] || fail "$command: $(cat err)"
  done
  [ "$(grep -c ^loss: res/report.txt)" -eq 3 ] && [ "$(grep -c ^loss: map/report.txt)" -eq 3 ] || fail "report.txt"
  runs 0 "$canyon" check run.yaml --json; says out '"level": "loss"'
  runs 0 "$canyon" city build world.sdf -o w.canyon --quiet; runs 0 "$canyon" city info w.canyon; says err '1 <heightmap> geometries'
  for command in 'simulate adv.yaml --out adv --quiet' 'heatmap adv.yaml --out advmap --spacing 100 --quiet'; do
    # shellcheck disable=SC2086
    runs 0 "$canyon" $command; says err 'warning: adv.gml: heights above DHHN2016'
  done
  cd ..
  runs 2 "$canyon" check containers/page.n text-bom/bom.n; says err 'is a web page'; says out 'RINEX navigation'
  printf 'what is this' >unknown; runs 2 "$canyon" check unknown; one_line; says err 'is not a known kind of file'
  runs 2 "$canyon" check containers/page.n text-bom/bom.csv --json
  python3 -c 'import json; a, b = json.load(open("out")); assert not a["usable"] and b["kind"] == "recorded path (csv)", (a, b)' ;;
strangers)
  # tests/data/cases: the smallest inputs of bugs reported by users of other programs.
  cp -r "$root"/tests/data/cases/* .
  # field N FILE: the field of each line except the header.
  field() { tail -n +2 "$2" | cut -d, -f "$1"; }
  for name in good day-before default-1980 future rollover; do
    runs 0 "$canyon" simulate nmea-void-date/$name.yaml --out void-$name --quiet
    cmp void-good/epochs.csv void-$name/epochs.csv || fail "$name: other epochs"
  done
  [ "$(wc -l <void-good/epochs.csv)" -eq 31 ] || fail "void dates: not 30 epochs"
  for case in nmea-gnsslogger/s:5 nmea-two-talkers/s:6 nmea-gga-no-altitude/one:6 nmea-gga-no-altitude/all2d:6 \
              text-bom/bom:3 text-bom/quoted:3 text-bom/semicolon:3 gpx-geoidheight/s:5; do
    runs 0 "$canyon" simulate ${case%:*}.yaml --out res --quiet
    [ "$(field 1 res/epochs.csv | wc -l)" -eq "${case#*:}" ] || fail "$case: $(field 1 res/epochs.csv | wc -l) epochs"
  done
  [ "$(field 5 res/epochs.csv | sort -u)" = 547.0000 ] || fail "geoidheight: heights $(field 5 res/epochs.csv | sort -u)"
  runs 2 "$canyon" simulate csv-ecef/s.yaml --out res; one_line; says err "motion.csv:1: has no header" trajectory.columns
  sed -i "s/format: csv/columns: {time: '1 [s]', x: '2 [m]', y: '3 [m]', z: '4 [m]'}/" csv-ecef/s.yaml
  runs 0 "$canyon" simulate csv-ecef/s.yaml --out res --quiet
  [ "$(field 5 res/epochs.csv | cut -d. -f1 | sort -u)" = 99 ] || fail "ECEF: heights $(field 5 res/epochs.csv | sort -u)"
  sed -i '1i time,latitude,longitude,height' csv-ecef/as_advised.csv
  runs 0 "$canyon" simulate csv-ecef/advised.yaml --out res; says err "no vehicle is at a height of 3662785 m"
  runs 0 "$canyon" simulate gpx-pause/s.yaml --out res --duration 3; says err "has 1 pause, the longest of 3591 s"
  for file in text-bom/good.n text-bom/bom.n containers/good.n.Z containers/good.n.zip; do
    runs 0 "$canyon" sky --nav $file --at 40,-4,700 --time '2024-05-01T10:00:00 GPST' --all
    says out G05 329.7
  done
  runs 2 "$canyon" sky --nav containers/page.n --at 40,-4,700 --time '2024-05-01T10:00:00 GPST'; one_line; says err "is a web page" "require a login"
  runs 2 "$canyon" sky --nav /dev/zero --at 40,-4,700 --time '2024-05-01T10:00:00 GPST'; one_line; says err "a device"
  for name in single list1 list2; do runs 0 "$canyon" simulate sp3-two-days/$name.yaml --out $name --quiet; done
  cmp single/satellites.csv list1/satellites.csv || fail "a list of one file is not the file"
  [ "$(field 2 list2/satellites.csv | sort -u | wc -l)" -eq 37 ] || fail "$(field 2 list2/satellites.csv | sort -u | wc -l) epochs over midnight"
  runs 0 "$canyon" city info cityjsonseq/seq.city.jsonl; grep -vE 'city.json|loaded' out >seq
  runs 0 "$canyon" city info cityjsonseq/same.city.json; grep -vE 'city.json|loaded' out | cmp - seq || fail "a sequence by another name is another city"
  runs 0 "$canyon" city info osm-josm-delete/edited.osm; says out "20"; grep -F 80 out && fail "a deleted building stands"
  runs 0 "$canyon" city info osm-josm-uid/uid.osm
  runs 0 "$canyon" city info overpass-json/overpass.json
  runs 0 "$canyon" city build osm-roof-angle/roof.osm -o r.geojson; says r.geojson '"roof_height_m":7.46'
  runs 0 "$canyon" city info gltf-no-scene/library.gltf --origin 48,11,0; says out '10 m east-west, 10 m north-south, 0.0 to 20.0 m high'
  runs 2 "$canyon" city info gltf-meshopt/m.gltf; one_line; says err meshopt
  runs 2 "$canyon" city info collada-skew-abort/skew.dae; one_line; says err "<skew> is not read"
  runs 0 "$canyon" city info mesh-concave-face/face6.dae; says out "built area    75"
  runs 0 "$canyon" city info obj-y-up/y_up.obj; says err "is upright" "up_axis: Y"
  mkdir t; gzip -dc terrain-impossible/max-N48E011.hgt.gz >t/N48E011.hgt
  runs 0 "$canyon" city build terrain-impossible/m.osm --terrain t/N48E011.hgt -o c.canyon; says err "posts in use are outside"
  runs 0 "$canyon" city info c.canyon; says out 546.1
  timeout 60 "$canyon" live live-password/live.yaml >out 2>err
  grep -rF SECRETWORD out err && fail "a password is printed"; says err "ntrip://somebody:...@127.0.0.1:9/MOUNT"
  runs 0 "$canyon" scenario show live-password/live.yaml; says err "passwords of addresses are shown as '...'"
  grep -rF SECRETWORD out err && fail "a password is printed"; says out "ntrip://somebody:...@127.0.0.1:9/MOUNT"
  runs 0 "$canyon" city build obj-y-up/y_up.obj -o y_up.canyon --origin 48,11,0; says err "is upright"
  sed 's/^city.*/city: {mesh: obj-y-up\/y_up.obj, origin: {latitude_deg: 48, longitude_deg: 11, height_m: 0}}/' small.yaml >y_up.yaml
  runs 0 "$canyon" heatmap y_up.yaml --out y_up --spacing 40 --format netcdf --quiet; says err "is upright"
  runs 0 "$canyon" check obj-y-up/y_up.obj; says out "is upright" ;;
antimeridian)
  # Three buildings over 320 m and the ground 200 m around them, at 180 deg: longitudes on both sides, and a box in two ways of writing.
  { echo '<osm version="0.6">'; n=0
    for east in 179.9990 -179.9996 -179.9984; do
      for corner in "0 0" "4 0" "4 4" "0 4"; do
        set -- $corner; n=$((n + 1))
        echo "<node id=\"$n\" version=\"1\" lat=\"$(python3 -c "print(-16.8 + $2 * 1e-4)")\" lon=\"$(python3 -c "print($east + $1 * 1e-4)")\"/>"
      done
      echo "<way id=\"$n\" version=\"1\"><nd ref=\"$((n - 3))\"/><nd ref=\"$((n - 2))\"/><nd ref=\"$((n - 1))\"/><nd ref=\"$n\"/><nd ref=\"$((n - 3))\"/><tag k=\"building\" v=\"yes\"/><tag k=\"height\" v=\"30\"/></way>"
    done; echo '</osm>'; } >m.osm
  sed 's/^city.*/city: {osm: m.osm}/' small.yaml >s.yaml
  runs 0 "$canyon" city info m.osm; says out "buildings     3" "720 m east-west"
  for box in 179.9985,-16.801,-179.9975,-16.799 179.9985,-16.801,180.0025,-16.799; do
    runs 0 "$canyon" heatmap s.yaml --bbox $box --spacing 10 --format netcdf --out map-$box --quiet
    for place in -16.7998,179.9995 -16.7998,-179.9990; do
      runs 0 "$canyon" heatmap query map-$box/map.nc --at=$place; cat out >>values-$box
    done
  done
  cmp values-* || fail "the two boxes give other maps"
  says values-179.9985,-16.801,-179.9975,-16.799 "-179.9990000" computed ;;
many)
  # Many receivers: pictures of the first ones, and a readable table.
  sed -i 's/outputs:.*/outputs: {pictures: true, nmea: false, rinex_observation: false, kml: false, geojson: false}/' small.yaml
  { echo receivers:; for i in $(seq 40); do echo "  - {name: r$i}"; done; } >>small.yaml
  runs 0 "$canyon" simulate small.yaml --out res --duration 2
  [ "$(ls res/*/track.png | wc -l)" -eq 16 ] || fail "$(ls res/*/track.png | wc -l) pictures instead of 16"
  says err "pictures    of the first 16 of 40 receivers"; says out "and 24 more receivers" r16
  grep -q r17 out && fail "more than 16 receivers in the table"
  # The same folder again with fewer receivers: the files of the previous run are removed, and nothing else.
  echo mine >res/r3/notes.txt; echo changed >>res/r4/epochs.csv; touch -d '+2 seconds' res/r4/epochs.csv
  sed '/name: r[^12]/d; /name: r[12][0-9]/d' small.yaml >two.yaml
  runs 0 "$canyon" simulate two.yaml --out res --duration 2
  [ "$(ls res | tr '\n' ' ')" = "r1 r2 r3 r4 report.txt sky.nav " ] || fail "res holds $(ls res)"
  [ "$(ls res/r3 res/r4 | tr '\n' ' ')" = "res/r3: notes.txt  res/r4: epochs.csv " ] || fail "left are $(ls res/r3 res/r4)"
  says err "files of an earlier run from res"
  # A requested end is immediate: no picture is drawn.
  sed -i 's/speed_mps.*/speed_mps: 0.001/' small.yaml
  "$canyon" simulate small.yaml --out long >out 2>err &
  program=$!
  for _ in $(seq 200); do [ "$(cat long/r1/epochs.csv.part* 2>/dev/null | wc -l)" -gt 10 ] && break; sleep 0.1; done
  kill -TERM "$program"; wait "$program"; status=$?
  [ "$status" -eq 130 ] || { fail "exit status $status instead of 130"; cat err; }
  says err interrupted "without pictures"
  [ -s long/r1/epochs.csv ] && [ ! -e long/r1/track.png ] || fail "long/r1 holds $(ls -A long/r1)"
  find long -name '*.part*' | grep . && fail "temporary files left" ;;
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
  # Only the listed outputs are written.
  sed 's/outputs:.*/outputs: [nmea, gpx]/' small.yaml >listed.yaml
  runs 0 "$canyon" simulate listed.yaml --out listed --duration 2
  [ "$(ls listed | tr '\n' ' ')" = "receiver.nmea report.txt track.gpx " ] || fail "listed holds $(ls listed)"
  sed 's/outputs:.*/outputs: [nmae]/' small.yaml >unknown.yaml
  runs 2 "$canyon" simulate unknown.yaml --out unknown; one_line; says err "'nmae' is unknown" "did you mean 'nmea'"
  # Mean sea level affects outputs of receivers, but no metric of the run.
  sed 's/seed: 2}/&, geoid_undulation_m: 39.625/' small.yaml >sea.yaml
  runs 0 "$canyon" simulate sea.yaml --out sea --quiet
  cmp res/epochs.csv sea/epochs.csv || fail "another sea level, other epochs"
  [ "$(grep -c 'GGA,.*,M,39.625,M,' sea/receiver.nmea)" -eq "$(grep -c 'GGA,.*,M,0.0,M,' res/receiver.nmea)" ] || fail "sentences without the separation"
  sed 's/seed: 2}/&, geoid_undulation_m: 1e9/' small.yaml >deep.yaml
  runs 2 "$canyon" simulate deep.yaml --out deep; one_line; says err deep.yaml:1: geoid_undulation_m
  runs 0 "$canyon" simulate small.yaml --out res3 --quiet --seed 9 --duration 5 --rate 2 --threads 1
  [ "$(wc -l <res3/epochs.csv)" -eq 12 ] || fail "--duration 5 --rate 2 is not 11 epochs"
  # Warnings during the run are five lines at most, as those before it; all are in report.txt.
  {
    echo 'city: {open: true, origin: {latitude_deg: 48, longitude_deg: 11, height_m: 500}}'
    echo 'sky: {nominal: true, systems: [GPS, Galileo]}'
    printf 'start: 2026-06-01T06:00:00Z\nduration_s: 20\ntrajectory: {waypoints: [{east_m: 0, north_m: 0, up_m: 1.5}]}\noutputs: [nmea]\nreceivers:\n'
    for i in 1 2 3 4 5 6 7; do echo "  - {name: r$i, profile: survey, corrections: {from: base, station_error_m: [0, 60, 0]}}"; done
    echo '  - {name: base, profile: survey, fixed: {east_m: 900, north_m: 300, up_m: 5}}'
  } >seven.yaml
  runs 0 "$canyon" simulate seven.yaml --out res4 --quiet; says err "2 more warnings: res4/report.txt"
  [ "$(wc -l <err)" -eq 6 ] && [ "$(grep -c 'pseudoranges put it' res4/report.txt)" -eq 7 ] || fail "warnings of the run: $(cat err)" ;;
scenario)
  runs 0 "$canyon" scenario show small.yaml; cp out shown.yaml
  says shown.yaml elevation_mask_deg "blocks_east: 3" "speed_mps: 6"
  mkdir elsewhere
  runs 0 "$canyon" simulate small.yaml --out res --quiet
  runs 0 "$canyon" simulate shown.yaml --out elsewhere/res --quiet
  diff -rx report.txt res elsewhere/res || fail "the effective scenario gives other bytes"
  runs 0 "$canyon" scenario show shown.yaml; cmp out shown.yaml || fail "not its own effective scenario"
  sed 's/rate_hz: 1/interval_s: 20/' small.yaml >slow.yaml
  runs 0 "$canyon" simulate slow.yaml --out slow --quiet
  [ "$(wc -l <slow/epochs.csv)" -eq 3 ] || fail "20 s at an epoch every 20 s are not 2 epochs"
  runs 0 "$canyon" scenario schema; says out json-schema.org elevation_mask_deg exclusiveMaximum
  runs 0 "$canyon" scenario keys; says out "receivers[].elevation_mask_deg"
  runs 0 "$canyon" scenario keys --markdown; says out "| \`rate_hz\` |"
  sed 's/speed_mps: 6/speed_mps: 0/' small.yaml >bad.yaml
  runs 2 "$canyon" scenario show bad.yaml; one_line; says err bad.yaml:6: speed_mps "above 0" ;;
stream)
  # Paced by the wall clock, so that a client has time to connect; it receives the end of the file's content.
  port=$(python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])')
  "$canyon" simulate small.yaml --out res --duration 4 --rate 5 --realtime --stream "nmea=tcp://127.0.0.1:$port" \
    --stream satellites_csv=file:copy.csv >out 2>err &
  program=$!
  for _ in $(seq 600); do exec 3<>"/dev/tcp/127.0.0.1/$port" && break; sleep 0.05; done 2>/dev/null
  cat <&3 >heard; exec 3>&-
  wait "$program" || { fail "exit status $?"; cat err; }
  [ -s heard ] || fail "the client heard nothing"
  tail -c "$(stat -c %s heard)" res/receiver.nmea | cmp - heard || fail "the client heard something else"
  head -c 1 heard | grep -qF '$' || fail "the client's first sentence is cut"
  cmp copy.csv res/satellites.csv || fail "the stream to a file differs from the file"
  runs 0 "$canyon" simulate small.yaml --out res2 --stream nmea=pty:; says err "nmea=pty:: the pseudo-terminal is /dev/pts/"
  runs 2 "$canyon" simulate small.yaml --out res --stream nmea; one_line; says err "FORMAT=ADDRESS"
  runs 2 "$canyon" simulate small.yaml --out res --stream nmae=pty:; one_line; says err "did you mean 'nmea'"
  runs 2 "$canyon" simulate small.yaml --out res --stream kml=pty:; one_line; says err "complete only at the end of a run"
  sed '$a receivers: [{name: left}, {name: right}]' small.yaml >two.yaml
  runs 2 "$canyon" simulate two.yaml --out res --stream nmea=pty:; one_line; says err "does not name its receiver" "left, right"
  runs 0 "$canyon" simulate two.yaml --out res --stream right/epochs_csv=file:right.csv
  cmp right.csv res/right/epochs.csv || fail "the stream is not of the receiver it names"
  # A base station's corrections, as read by RTKLIB's stream program: complete frames, all bytes unchanged.
  if ! command -v str2str >/dev/null; then
    echo "SKIPPED: str2str (RTKLIB) is not installed"
  else
    sed 's/outputs:.*/outputs: {rtcm: true, pictures: false}/' small.yaml >base.yaml
    sed -i '$a receivers: [{name: base, fixed: {east_m: 0, north_m: 0, up_m: 90}}, {name: rover}]' base.yaml
    "$canyon" simulate base.yaml --out res4 --duration 6 --rate 5 --realtime --stream "base/rtcm=tcp://127.0.0.1:$port" >out 2>err &
    program=$!
    for _ in $(seq 600); do exec 3<>"/dev/tcp/127.0.0.1/$port" && break; sleep 0.05; done 2>/dev/null
    exec 3>&-
    str2str -in "tcpcli://127.0.0.1:$port" -out "file://$PWD/heard.rtcm3" >str2str.log 2>&1 &
    client=$!
    wait "$program" || { fail "exit status $?"; cat err; }
    sleep 1
    kill "$client"; wait "$client" || true
    size=$(stat -c %s heard.rtcm3)
    [ "$size" -gt 1000 ] || fail "str2str heard $size bytes"
    tail -c "$size" res4/base/receiver.rtcm3 | cmp - heard.rtcm3 || fail "str2str heard something else"
    [ "$(head -c 1 heard.rtcm3 | od -An -tx1)" = " d3" ] || fail "str2str's first frame is cut"
  fi ;;
live)
  for speed in -3 0 nan; do
    runs 2 "$canyon" live small.yaml --speed $speed; one_line; says err --speed
  done
  runs 2 "$canyon" live small.yaml --poses udp://127.0.0.1:9001; one_line; says err "an address to send to" udp-listen://
  # The reason for no fix is in the last line; an unread terminal does not block the run.
  sed '/speed_mps/d; s/waypoints.*/position: {east_m: 0, north_m: 0, up_m: -5}/' small.yaml >under.yaml
  runs 0 "$canyon" live under.yaml --duration 1.5 --stream nmea=pty:
  says err "0 with a fix; now no fix: rover: antenna inside a building or under the terrain"
  begin=$(date +%s%N)
  runs 0 "$canyon" live small.yaml --speed 20 --stream paths_csv=pty:
  [ $(($(date +%s%N) - begin)) -lt 2900000000 ] || fail "$(($(date +%s%N) - begin)) ns for a drive of 1 s" ;;
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
demo)
  runs 0 "$canyon" demo --out here
  says out "horizontal error, median [m]" "canyon simulate here/demo.yaml --out here/mine" "driving at 8 m/s"
  runs 0 "$canyon" heatmap query here/heatmap/map.nc --at 22.3,114.17; says out "receiver driving at 8 m/s"
  for file in demo.yaml epochs.csv track.png heatmap/map.nc; do [ -s "here/$file" ] || fail "no here/$file"; done
  cmp -s here/demo.yaml "$root/examples/synthetic_drive.yaml" || fail "demo.yaml is not the example"
  runs 0 "$canyon" simulate here/demo.yaml --out here/mine
  runs 0 "$canyon" demo --out still --quiet; [ ! -s out ] && [ ! -s err ] || fail "demo --quiet printed something"
  cmp -s here/epochs.csv here/mine/epochs.csv || fail "what it says next gives another drive"
  : >file; runs 2 "$canyon" demo --out file/here; one_line ;;
new)
  # A street from south to north between the two buildings, and one to the east; a road through a building is not used.
  street='<node id="21" version="1" lat="47.9985" lon="11.00075"/><node id="22" version="1" lat="48.0001" lon="11.00075"/>
    <node id="23" version="1" lat="48.0016" lon="11.00075"/><node id="24" version="1" lat="48.0016" lon="10.9980"/>
    <node id="25" version="1" lat="48.0001" lon="11.0002"/>
    <way id="31" version="1"><nd ref="21"/><nd ref="22"/><nd ref="23"/><nd ref="24"/><tag k="highway" v="residential"/></way>
    <way id="32" version="1"><nd ref="22"/><nd ref="25"/><nd ref="24"/><tag k="highway" v="residential"/></way></osm>'
  { block_osm | grep -v '^</osm>'; echo "$street"; } >'my map.osm'; block_osm >bare.osm
  runs 0 "$canyon" new 'my map.osm' -o drive.yaml
  says out 'my map.osm, 2 buildings' 'nominal satellites, since' '500 m along streets' 'canyon simulate drive.yaml --out out/drive --view'
  says drive.yaml 'canyon profiles' 'canyon scenario keys' 'T12:00:00 GPST'; grep -q 'longitude_deg: 11.0002' drive.yaml && fail "through a building"
  runs 0 "$canyon" simulate drive.yaml --out res; says err '500 m, 63 epochs'; grep -q 'inside a building' err && fail "inside a building"
  # Existing files are kept; nothing is left for an impossible name.
  cp drive.yaml kept.yaml; runs 2 "$canyon" new bare.osm -o drive.yaml; one_line; says err 'drive.yaml: already exists'; cmp drive.yaml kept.yaml || fail "replaced"
  runs 2 "$canyon" new bare.osm -o bare.osm; one_line; runs 2 "$canyon" new bare.osm -o nowhere/drive.yaml; one_line
  runs 0 "$canyon" new bare.osm -o bare.yaml; says out 'straight on, outside buildings'; runs 0 "$canyon" simulate bare.yaml --out res --quiet
  # A path without times, one with its first position off the map, and navigation of the day; the same without a file.
  echo '<gpx><trk><trkseg><trkpt lat="47.999" lon="11.00075"/><trkpt lat="48.001" lon="11.00075"/></trkseg></trk></gpx>' >track.gpx
  runs 0 "$canyon" new 'my map.osm' track.gpx -o track.yaml; says out '2 of 2 positions of track.gpx, 1.5 m above the ground, at 8 m/s, since it has no times'
  runs 0 "$canyon" simulate track.yaml --out by_file --quiet; runs 0 "$canyon" simulate track.gpx 'my map.osm' --out without; says err 'assumed     trajectory'
  cmp by_file/epochs.csv without/epochs.csv || fail "another run without a file"; [ ! -e new.yaml ] || fail "a file that nobody asked for"
  { echo time,latitude,longitude,height; s=0; for latitude in 48.0041 48.0031 48.0021 48.0011 48.0001 47.9991; do echo "2026-03-01T10:00:0$((s++)).25Z,$latitude,11.00075,500"; done; } >timed.csv
  runs 0 "$canyon" new 'my map.osm' timed.csv -o timed.yaml; says out 'for 2 s, where the path is on the map' '3 of 6 positions'
  runs 0 "$canyon" simulate timed.yaml --out res; says err '3 epochs every 1'
  runs 2 "$canyon" new 'my map.osm' track.gpx timed.csv -o two.yaml; one_line; says err 'timed.csv: is one file too many'
  runs 2 "$canyon" new track.gpx -o two.yaml; one_line; says err 'no file is a city'
  runs 2 "$canyon" new absent.osm -o two.yaml; one_line; says err 'canyon: absent.osm: no such file'; [ ! -e two.yaml ] || fail "written although refused"
  runs 2 "$canyon" new bare.osm -o nowhere/two.yaml; one_line; says err 'two.yaml: cannot be written: No such file or directory; choose an existing, writable folder'
  # Heights are those of the ground, so a path needs none; nor times; times of a day begin the run.
  cut -d, -f1-3 timed.csv | sed 's/stamp/time/' >flat.csv; runs 0 "$canyon" new 'my map.osm' flat.csv -o flat.yaml; says out '3 of 6 positions'
  printf 'latitude,longitude\n47.999,11.00075\n48.001,11.00075\n' >bare.csv
  runs 0 "$canyon" new 'my map.osm' bare.csv -o timeless.yaml; says out 'since it has no times'; runs 0 "$canyon" simulate timeless.yaml --out timeless --quiet
  printf '$GPGGA,11300%d.00,4759.94,N,01100.045,E,1,8,1,500,M,0,M,,\n' 0 >gga.nmea; for s in 1 2 3; do printf '$GPGGA,11300%d.00,4759.9%d,N,01100.045,E,1,8,1,500,M,0,M,,\n' $s $((4 + s)); done >>gga.nmea
  runs 0 "$canyon" new 'my map.osm' gga.nmea -o gga.yaml; says out 'since the path has no dates'; runs 0 "$canyon" simulate gga.yaml --out gga; says err '4 epochs'
  head -2 bare.csv >one.csv; runs 2 "$canyon" new 'my map.osm' one.csv -o two.yaml; one_line; says err 'one.csv: has one position'
  printf 'latitude,longitude\n11,48\n11,48.001\n' >far.csv; runs 2 "$canyon" new 'my map.osm' far.csv -o two.yaml; one_line; says err 'it begins 5' 'km from it'
  # A name with a blank; the next keys named in the file.
  runs 0 "$canyon" new bare.osm -o 'my drive.yaml'; says out "canyon simulate 'my drive.yaml' --out 'out/my drive' --view"
  sed -i 's/^# \(outputs\|faults\):/\1:/' 'my drive.yaml'; runs 0 "$canyon" simulate 'my drive.yaml' --out res --quiet; [ -s res/receiver.obs ] || fail "no RINEX"
  echo 'o box' >box.obj; runs 2 "$canyon" new box.obj -o two.yaml; one_line; says err 'box.obj: is a mesh' '--origin'
  # A corner in a building is rejected with the nearest free point, which is then accepted.
  sed 's/waypoints.*/waypoints: [{east_m: -38, north_m: 0, up_m: 2}, {east_m: -20, north_m: 30, up_m: 2}]/' small.yaml >inside.yaml
  runs 2 "$canyon" simulate inside.yaml --out in; one_line; says err 'waypoint 2 is inside a building' 'nearest free position is {latitude_deg'
  place=$(grep -o '{east_m[^}]*' err); sed -i "s/{east_m: -20, north_m: 30/$place/" inside.yaml; runs 0 "$canyon" simulate inside.yaml --out in --quiet ;;
reference)
  for shell in bash zsh fish; do runs 0 "$canyon" completion $shell; cp out "$shell"; done
  says zsh "#compdef canyon"
  says fish "complete -c canyon -n '__fish_use_subcommand' -a simulate" "-l threads"
  # completes WORD... WANTED: bash's completions of these words, the last one incomplete.
  completes() {
    local got
    got=$(bash -c 'source ./bash; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _canyon; echo "${COMPREPLY[@]}"' - "${@:1:$#-1}")
    [ "$got" = "${!#}" ] || fail "completion of '${*:1:$#-1}' is '$got' instead of '${!#}'"
  }
  completes canyon si simulate
  completes canyon heatmap qu query
  completes canyon simulate drive.yaml --thr --threads
  completes canyon -x heatmap query map.nc --at --at
  completes canyon simulate ./dr ""
  completes canyon live --pose-format js json
  completes canyon simulate --out ma "" # a file
  # zsh and fish run their scripts if installed.
  in_zsh() { # WORD... WANTED: zsh's completions after these words, the last one incomplete.
    local got
    got=$(zsh -f -c 'compdef() { }; compadd() { shift; print -r -- "$@"; (($#)) }; _files() { print files }; . ./zsh
                     words=("$@"); CURRENT=$#; PREFIX=$words[-1]; _canyon' - "${@:1:$#-1}" 2>&1)
    [ "$got" = "${!#}" ] || fail "zsh offers '$got' behind '${*:1:$#-1}' instead of '${!#}'"
  }
  if command -v zsh >/dev/null; then
    in_zsh canyon live --pose-format "" "json binary mavlink"
    in_zsh canyon heatmap query map.nc --speed 3 "" "--at --path --format --altitude --time --speed --stretch --step --json --quiet --help"
    in_zsh canyon simulate --out "" $'\nfiles'
    in_zsh canyon simulate ./dr files
  fi
  in_fish() { # TYPED WANTED: the completions of fish.
    local got
    got=$(fish --no-config -c 'source ./fish; complete -C $argv[1]' "$1" 2>&1 | cut -f1 | tr '\n' ' ')
    [ "$got" = "$2" ] || fail "fish offers '$got' behind '$1' instead of '$2'"
  }
  if command -v fish >/dev/null; then
    in_fish "canyon si" "simulate "
    in_fish "canyon live --pose-format " "binary json mavlink "
    in_fish "canyon completion " "bash fish zsh "
    in_fish "canyon simulate --seed 3 --qu" "--quiet "
    in_fish "canyon heatmap query --sp" "--speed "
    in_fish "canyon heatmap qu" "query "
  fi
  runs 0 "$canyon" manual --out man
  [ "$(ls man | wc -l)" -gt 25 ] || fail "not a page for each command"
  says man/canyon-heatmap-query.1 '.TH "canyon-heatmap-query" 1' '\-\-at'
  runs 2 "$canyon" completion tcsh; says err "bash,zsh,fish" ;;
rtk)
  needs_data rtk-nagoya-20240624
  pair=$data/rtk-nagoya-20240624
  runs 0 "$canyon" rtk "$pair/rover.obs" "$pair/base.obs" --nav "$pair/base.nav" --quiet --out r.pos \
    --base-position 35.134707705,136.977577939,104.853 --truth 35.13469901,136.97757549,104.8626
  says out 'fixed     301  100.0' 'first fixed after 0.0 s' 'r.pos written'
  [ "$(grep -vc '^%' r.pos)" -eq 301 ] || fail "r.pos has not 301 solutions"
  runs 0 "$canyon" rtk "$pair/rover.obs" "$pair/base.obs" --nav "$pair/base.nav" --systems GPS --signals L1CA --quiet
  says err "the base is at the position in its file's header"
  says out 'fixed' 'float'
  runs 2 "$canyon" rtk "$pair/rover.obs" "$data/urbannav-tst-20190428/COM3_190428_124409.obs" --nav "$pair/base.nav" --quiet
  says err 'have no common time'; one_line
  runs 2 "$canyon" rtk "$pair/rover.obs" "$pair/base.nav" --nav "$pair/base.nav"; one_line
  # Errors are reported before the first epoch, and the compared data.
  solve=("$canyon" rtk "$pair/rover.obs" "$pair/base.obs" --nav "$pair/base.nav" --base-position 35.134707705,136.977577939,104.853 --quiet)
  runs 2 "${solve[@]}" --signals L1CA --signals L2; one_line; says err "L2" "did you mean 'L2C'"
  runs 0 "${solve[@]}" --signals L1CA,E1; says out "first fixed"
  mkdir folder
  runs 2 "${solve[@]}" --out folder; one_line; says err "folder: is a folder"; says out
  runs 2 "${solve[@]}" --out none/r.pos; one_line; [ ! -s out ] || fail "computed before it asked for the file"
  runs 2 "${solve[@]}" --truth "$data/urbannav-tst-20210517/UrbanNav_TST_GT.txt"; one_line; says err "lasts from 2021-05-17" "give the true positions of the same time"
  head -60 r.pos >part.pos
  runs 0 "${solve[@]}" --truth part.pos; says err "errors are of the epochs in both"
  # Across a week's end, RINEX and RTCM 3 of both, GLONASS by message 1230.
  printf '%s\n' 'city: {synthetic: {blocks_east: 1, blocks_north: 1}, origin: {latitude_deg: 50, longitude_deg: 10, height_m: 0}}' \
    'sky: {nominal: true}' 'start: 2026-06-06T23:59:30Z' 'rate_hz: 1' \
    'trajectory: {waypoints: [{east_m: 1000, north_m: 0, up_m: 2}, {east_m: 1100, north_m: 0, up_m: 2}], speed_mps: 2}' \
    'receivers: [{name: car, profile: ublox-f9p}, {name: base, profile: survey, fixed: {east_m: 1070, north_m: 0, up_m: 5}}]' \
    'outputs: {rtcm: true, rinex_observation: true, rinex_navigation: true}' > week.yaml
  runs 0 "$canyon" simulate week.yaml --out week --quiet
  for rover in obs rtcm3; do
    runs 0 "$canyon" rtk "week/car/receiver.$rover" week/base/receiver.rtcm3 --nav week/sky.nav --quiet
    says out 'fixed      51  100.0' 'first fixed after 0.0 s'
  done
  runs 2 "$canyon" rtk "$pair/rover.obs" "$pair/base.obs" --nav "$pair/base.nav" --base-position here
  says err "--base-position 'here' is not a position"; one_line
  ;;
iq)
  runs 0 "$canyon" iq small.yaml --out d.iq --duration 1 --rate 2.5e6
  says err '2.5 Msps int8, 0.005 GB: GPS L1CA' 'times real time'
  [ "$(stat -c %s d.iq)" -eq 5000000 ] || fail "d.iq has $(stat -c %s d.iq) bytes"
  says d.sigmf-meta '"core:datatype": "ci8"' '"core:sample_rate": 2500000.0' '"core:dataset": "d.iq"' '2026-03-01T10:00:00.000000000Z'
  runs 0 "$canyon" iq small.yaml --out e.iq --duration 1 --rate 2.5e6 --threads 1 --quiet
  says err 'warning: e.iq: left out, too wide'; [ "$(wc -l <err)" -eq 1 ] || fail "--quiet printed more than the warning"
  cmp d.iq e.iq || fail "the bytes depend on the threads"
  runs 0 "$canyon" iq small.yaml --out d.sigmf-data --duration 1 --rate 2.5e6 --format float32 --noise-level 0.1
  says d.sigmf-meta cf32_le; grep -q dataset d.sigmf-meta && fail "SigMF's own name needs no dataset"
  python3 - <<'P' || fail "the samples are not noise of the level that was asked for"
import array, math
x = array.array('f', open("d.sigmf-data", "rb").read())
assert len(x) == 5000000, len(x)
deviation = math.sqrt(sum(v * v for v in x[:200000]) / 200000)
assert 0.1 < deviation < 0.12, deviation
P
  runs 0 "$canyon" iq small.yaml --out - --duration 1 --rate 2.5e6 --quiet
  cmp d.iq out || fail "a pipe has other bytes"
  # TCP: the file's bytes; a reader that disconnects ends the run.
  port=$(python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])')
  "$canyon" iq small.yaml --out "tcp://127.0.0.1:$port" --duration 1 --rate 2.5e6 >out 2>err &
  pid=$!
  for _ in $(seq 600); do exec 3<>"/dev/tcp/127.0.0.1/$port" && break; sleep 0.05; done 2>/dev/null
  timeout 60 cat <&3 >tcp.iq; exec 3<&-
  wait $pid || fail "tcp: exit status $?"
  cmp d.iq tcp.iq || fail "TCP has other bytes"
  says err "waiting for a reader of tcp://127.0.0.1:$port"
  "$canyon" iq small.yaml --out "tcp://127.0.0.1:$port" --rate 2.5e6 --quiet >out 2>err &
  pid=$!
  for _ in $(seq 600); do exec 3<>"/dev/tcp/127.0.0.1/$port" && break; sleep 0.05; done 2>/dev/null
  head -c 1000 <&3 >tcp.iq; exec 3<&-
  wait $pid; [ $? -eq 1 ] || fail "a reader that is gone: exit status"
  one_line; says err 'the reader is gone'
  runs 1 "$canyon" iq small.yaml --out "tcp-connect://127.0.0.1:$port" --rate 2.5e6 --quiet; one_line; says err 'cannot be reached'
  runs 2 "$canyon" iq small.yaml --out "tcp://127.0.0.1:$port" --band L1 --band E1; one_line; says err 'can hold one band'
  runs 0 "$canyon" iq small.yaml --out two.iq --duration 1 --rate 2.5e6 --band L1 --band E1
  [ -s two.L1.iq ] || fail "no two.L1.iq"
  runs 0 "$canyon" iq small.yaml --out r.iq --duration 1 --rate 5e6 --real --if 1.25e6 --format 2bit
  says err '1575.420 MHz at 1.25 MHz, 5 Msps real 2bit' 'warning: --if is now --intermediate-hz'
  [ "$(stat -c %s r.iq)" -eq 1250000 ] || fail "r.iq has $(stat -c %s r.iq) bytes"
  says r.sigmf-meta '"core:datatype": "ru8"' '"canyon:bits": 2'
  runs 2 "$canyon" iq small.yaml --out f.iq --real; one_line; says err 'real samples need an intermediate frequency' '1000000 Hz'
  runs 2 "$canyon" iq small.yaml --out f.iq --real --intermediate-hz 3e6; one_line; says err 'is aliased' '1000000 Hz leaves the widest band'
  runs 2 "$canyon" iq small.yaml --out f.iq --real --intermediate-hz=2e5; one_line; says err 'too narrow for GPS L1CA' 'now 1000000 Hz'
  runs 2 "$canyon" iq small.yaml --out f.iq --format 1bit --noise-level 0.5; one_line; says err 'have no noise level'
  runs 0 "$canyon" iq small.yaml --out b.iq --duration 1 --rate 2.5e6 --bandwidth 2e6 --quiet
  runs 0 "$canyon" iq small.yaml --out c.iq --duration 1 --rate 2.5e6 --bandwidth 2e6 --quiet --threads 1
  cmp b.iq c.iq || fail "the filter's bytes depend on the threads"
  says b.sigmf-meta 'Filtered: 2 MHz'
  runs 2 "$canyon" iq small.yaml --out f.iq --rate 2.5e6 --bandwidth 2.4e6; one_line; says err 'needs 1320000 Hz on either side, but only 1250000 Hz are available'
  runs 2 "$canyon" iq small.yaml --out f.iq --band L9; one_line; says err "'L9' is not a band"
  runs 2 "$canyon" iq small.yaml --out f.iq --band L6; one_line; says err 'carry no signal of the sky'
  runs 2 "$canyon" iq small.yaml --out f.iq --duration 0.5; one_line; says err 'one epoch'
  runs 2 "$canyon" iq small.yaml --out f.iq --rate 1e5; says err '--rate'
  runs 2 "$canyon" iq small.yaml --out f.iq --receiver nobody; one_line; says err "the scenario has no receiver 'nobody'"
  runs 2 "$canyon" iq small.yaml --out absent/f.iq; one_line; says err absent
  { cat small.yaml; echo 'receivers: [{name: p, profile: paper}]'; } >paper.yaml
  runs 2 "$canyon" iq paper.yaml --out f.iq; one_line; says err 'have no strength'
  [ ! -e f.iq ] || fail "a refused run left a file"
  sed 's/^trajectory:/trajectory: {waypoints: [{east_m: 0, north_m: 0, up_m: 2}], hold_s: 900000}/; /^  /d' small.yaml >years.yaml
  runs 1 "$canyon" iq years.yaml --out f.iq --rate 200e6 --duration 900000; one_line; says err 'the samples need' 'GB are free'
  [ ! -e f.iq ] || fail "a refused run left a file"
  # An interrupted run leaves a complete file.
  "$canyon" iq small.yaml --out long.iq --rate 2.5e6 --threads 1 >out 2>err &
  pid=$!
  for _ in $(seq 100); do [ "$(stat -c %s long.iq.part* 2>/dev/null | sort -n | tail -n 1)" -gt 5000000 ] 2>/dev/null && break; sleep 0.05; done
  kill -INT $pid; wait $pid
  status=$?
  [ $status -eq 130 ] || [ $status -eq 0 ] || fail "interrupted: exit status $status"
  [ -s long.iq ] && [ -s long.sigmf-meta ] || fail "nothing left of an interrupted run" ;;
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
  runs 2 "$canyon" trace small.yaml --at 48,11; one_line; says err "'48,11' is not a position" 'LATITUDE,LONGITUDE,HEIGHT'
  { cat small.yaml; echo 'propagation: {reflection_order: 2}'; } >twice.yaml
  runs 0 "$canyon" trace twice.yaml --enu 0,0,2; says out 'reflected twice' 'before that'
  runs 0 "$canyon" trace twice.yaml --enu 0,0,2 --json; says out '"order": 2' '"far_point_enu_m"' '"far_incidence_deg"'
  { cat small.yaml; echo 'receivers: [{name: two, profile: survey, tracks: [L1CA, L5, E1, E5a]}]'; } >bands.yaml
  runs 0 "$canyon" trace bands.yaml; says out 'E1 0.0, E5a 0.0'
  runs 0 "$canyon" trace bands.yaml --json
  python3 - <<'P' || fail "the JSON is not what its signals say"
import json
names = set()
for s in json.load(open("out"))["satellites"]:
    clear = {one["signal"]: one["clear_cn0_dbhz"] for one in s["signals"]}
    names |= set(clear) if s["sat"][0] in "GE" else set()
    # Galileo OS SIS ICD 2.1, table 12: E5a 2 dB above E1.
    if s["sat"][0] == "E": assert abs(clear["E5a"] - clear["E1"] - 2) < 1e-9, s
    if s["sat"][0] == "R": assert set(clear) == {"G1", "G2"}, s  # none is tracked: all are listed
    for path in s["paths"]:
        loss = path["signal_loss_db"]
        assert set(loss) == set(clear), path
        assert path["kind"] != "direct" or all(abs(db) < 0.01 for db in loss.values()), path
assert names == {"L1CA", "L5", "E1", "E5a"}, names
P
  runs 2 "$canyon" trace small.yaml --receiver nobody; one_line; says err nobody rover
  runs 2 "$canyon" trace small.yaml --enu 1,2; one_line; says err EAST,NORTH,UP
  runs 2 "$canyon" trace small.yaml --enu nan,0,2; one_line ;;
validate)
  # Canyon's own receiver as the recorded one: simulated, then compared with the same scenario.
  sed -i 's/speed_mps: 6/speed_mps: 3/' small.yaml; echo 'receivers: [{profile: ideal, elevation_mask_deg: 10}]' >>small.yaml
  runs 0 "$canyon" simulate small.yaml --out res --quiet
  awk -F, 'NR > 1 {print $1 "," $2 "," $3 "," $4 "," $5}' res/epochs.csv >truth.csv
  sed 's/^sky:.*/sky: {navigation: [res\/sky.nav]}/' small.yaml >judge.yaml
  judge=("$canyon" validate judge.yaml --obs res/receiver.obs --truth truth.csv --format urbannav --no-atmosphere)
  runs 0 "${judge[@]}" --json figures.json --view rep
  says out "whole recording" "epochs" AUC "Tracked satellites" "by the same solver on both"
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
  python3 - <<'P' || fail "the view is not what was judged"
import gzip, json, struct
h = json.load(open("rep/view.json"))
p = json.load(open("figures.json"))["models"][0]["position"]
for r, side in zip(h["receivers"], ("measured", "simulated")):
    error = p[side]["horizontal_error_m"]
    assert r["summary"]["fixes"] == p[side]["fixes"], (side, r["summary"])
    for p_ in ("p50", "p95"):
        assert abs(r["summary"][f"horizontal_{p_}_m"] - error[p_]) < 1e-6, (side, p_)
# docs/view-format.md: magic, one table, reserved; its index and rows.
chunk = gzip.open("rep/comparison.bin.gz").read()
assert chunk[:8] == b"canyonV1" and struct.unpack("<IIII", chunk[8:24])[0] == 1
assert h["tables"][struct.unpack("<I", chunk[16:20])[0]]["name"] == "comparison"
assert struct.unpack("<I", chunk[20:24])[0] == h["receivers"][0]["summary"]["epochs"]
assert [r["name"] for r in h["receivers"]] == ["recorded", "simulated"] and h["comparison"]["streets"]
P
  schema_holds rep/view.json
  grep -qE '\b(nan|inf)\b' figures.json && fail "a number that is none"
  runs 0 "${judge[@]}" --align --search-radius 4 --models mirror,specular --json - --quiet
  python3 -c 'import json; f = json.load(open("out")); assert len(f["models"]) == 3 and 19 <= f["alignment"]["epochs"] <= 21, f' || fail "--json - is not what was asked for"
  [ ! -s err ] || fail "--quiet printed something"
  runs 0 "${judge[@]}" --align --align-heading --split 0.6 --cumulative-models
  says out "city moved by east" "rotated by" "last 40 %" "+ ground reflection" "mirror (the paper's)"
  # A stationary antenna: its position instead of a file, as an option or in the scenario.
  sed -e 's/waypoints.*/position: {east_m: 0, north_m: 0, up_m: 2}/' -e '/speed_mps/d' small.yaml >stands.yaml; echo 'duration_s: 40' >>stands.yaml
  runs 0 "$canyon" simulate stands.yaml --out still --quiet
  sed 's/^sky:.*/sky: {navigation: [still\/sky.nav]}/' stands.yaml >stood.yaml
  place=$(awk -F, 'NR == 2 {print $3 "," $4 "," $5}' still/epochs.csv)
  runs 0 "$canyon" validate stood.yaml --obs still/receiver.obs --no-atmosphere --json - --quiet; cp out in_scenario.json
  runs 0 "$canyon" validate judge.yaml --obs still/receiver.obs --truth "$place" --no-atmosphere --json - --quiet
  python3 - <<'P' || fail "a fixed antenna is not judged at its place"
import json
for name in "in_scenario.json", "out":
    f = json.load(open(name))["models"][0]
    assert f["epochs"] == 41 and f["position"]["measured"]["horizontal_error_m"]["p95"] < 3, f["position"]
P
  runs 2 "$canyon" validate small.yaml --obs still/receiver.obs; one_line; says err "--truth is missing" "LATITUDE,LONGITUDE,HEIGHT"
  # Resampled cities: measurements are unchanged, simulations are of all cities.
  sed 's/^city: *{/city: {georeference: {sigma_m: 3}, /' judge.yaml >unsure.yaml
  grep -q georeference unsure.yaml || sed 's/^city:$/city:\n  georeference: {sigma_m: 3}/' judge.yaml >unsure.yaml
  runs 0 "$canyon" validate unsure.yaml "${judge[@]:3}" --runs 3 --json - --quiet
  python3 -c 'import json; f = json.load(open("out"))["models"][0]; p = f["position"]; assert f["runs"] == 3 and p["simulated"]["epochs"] == 3 * p["measured"]["epochs"], f' || fail "--runs 3 is not three cities"
  # Samples of unspecified values.
  sed 's/profile: ideal/profile: ublox-m8t/' judge.yaml >open.yaml
  runs 0 "$canyon" validate open.yaml "${judge[@]:3}" --ensemble 3 --json e.json
  says out "level: -10 to 6 dB" "skyline: 0 to 0.75" "within the 90 % interval"
  python3 -c 'import json; e = json.load(open("e.json")); d = e["recordings"][0]["draws"]; assert len({x["unknowns"]["level"] for x in d}) == 3 and e["coverage"]["figures"] == 5, e' || fail "e.json is not of three draws"
  runs 0 "$canyon" validate open.yaml "${judge[@]:3}" --ensemble 2 --fixed-unknowns level,facades; says out "skyline" "satellites used"; says err "90 % intervals of 2 samples are intervals of 33 %: give --ensemble 19"
  ! grep -q "^- level" out || fail "a known level was drawn"
  runs 2 "$canyon" validate open.yaml "${judge[@]:3}" --ensemble 2 --fixed-unknowns levl; one_line; says err "no unknown 'levl'"
  runs 2 "$canyon" validate open.yaml "${judge[@]:3}" --forget-unknowns; says err "--forget-unknowns requires --ensemble"
  # Two bands, and a receiver that tracks a different second one; a code that does not exist.
  cp small.yaml ideal.yaml
  sed -i 's/^receivers:.*/receivers: [{name: car, profile: survey, tracks: [L1CA, L2C], noise: {enabled: false}}]/' small.yaml
  runs 0 "$canyon" simulate small.yaml --out two --quiet
  sed 's/C2L/C9Z/' two/receiver.obs >unknown.obs
  sed 's/^sky:.*/sky: {navigation: [two\/sky.nav]}/' small.yaml >two.yaml
  runs 0 "$canyon" validate two.yaml --obs two/receiver.obs "${judge[@]:5}"
  says out "GPS L2C" "Carrier phase" "GPS L1CA" "Between cycle slips"
  runs 0 "$canyon" validate two.yaml --obs unknown.obs "${judge[@]:5}"
  says err "1 codes of G not known: 9Z"
  says out "Signals not compared" "Tracked by the simulated"
  runs 2 "${judge[@]}" --runs 3; one_line; says err --runs georeference
  # The part used for metrics.
  runs 0 "${judge[@]}" --part first --json - --quiet
  python3 -c 'import json; f = json.load(open("out")); assert "alignment" not in f and 19 <= f["models"][0]["epochs"] <= 21, f' || fail "--part first is not the first half"
  runs 0 "${judge[@]}" --align --part all; says out "whole recording"
  # Own fixes: those of the (simulated) receiver, compared with the position filter's.
  runs 0 "${judge[@]}" --nmea res/receiver.nmea --json figures.json; says out "receiver's own"
  python3 - <<'P' || fail "own fixes are not those of the receiver"
import json
f = json.load(open("figures.json"))["models"][0]
own, fixes = f["own_fixes"], f["position"]["measured"]
assert abs(own["fixes"] - fixes["fixes"]) <= 1 and own["mean_satellites_used"] is None, own
for at in "p50", "p95":
    assert abs(own["horizontal_error_m"][at] - fixes["horizontal_error_m"][at]) < 0.5, (own, fixes)
P
  # A satellite high above the horizon for 130 s that is never in the recording: named and omitted, or kept.
  sed 's/speed_mps: 3/speed_mps: 0.9/' ideal.yaml >slow.yaml
  runs 0 "$canyon" simulate slow.yaml --out slow --quiet
  sed 's/^sky:.*/sky: {navigation: [slow\/sky.nav]}/' slow.yaml >judge_slow.yaml
  awk -F, 'NR > 1 {print $1 "," $2 "," $3 "," $4 "," $5}' slow/epochs.csv >slow.csv
  python3 - <<'P'
import collections, csv
high = collections.Counter(
    row["sat"] for row in csv.DictReader(open("slow/satellites.csv"))
    if float(row["elevation_deg"]) > 40 and row["visibility"].startswith("LOS"))
lost = high.most_common(1)[0][0]
open("lost", "w").write(lost)
lines, out = open("slow/receiver.obs").read().split("\n"), []
while lines:
    line = lines.pop(0)
    if line.startswith(">"):
        here = [lines.pop(0) for _ in range(int(line[32:35]))]
        here = [one for one in here if not one.startswith(lost)]
        out += [line[:32] + "%3d" % len(here) + line[35:]] + here
    else:
        out.append(line)
open("lost.obs", "w").write("\n".join(out))
P
  lost=("$canyon" validate judge_slow.yaml --obs lost.obs --truth slow.csv --format urbannav --no-atmosphere)
  runs 0 "${lost[@]}" --json figures.json; says out "never tracked above 15 deg in clear view, left out: $(cat lost)"
  runs 0 "${lost[@]}" --all-satellites --json all.json; says out "never tracked above 15 deg in clear view: $(cat lost)"
  python3 - <<'P' || fail "a satellite that was never recorded is not left out"
import json
left, kept = (json.load(open(f))["models"][0] for f in ("figures.json", "all.json"))
assert [s["left_out"] for s in left["never_tracked"] + kept["never_tracked"]] == [True, False]
assert left["never_tracked"][0]["clear_s"] >= 120
assert kept["tracked"]["los"]["satellites"] >= left["tracked"]["los"]["satellites"] + 120
# Recorded and simulated receiver are equal except for that satellite.
assert left["tracked"]["los"]["measured"] == left["tracked"]["los"]["simulated"]
used = [f["position"]["simulated"]["mean_satellites_used"] - f["position"]["measured"]["mean_satellites_used"] for f in (left, kept)]
assert abs(used[0]) < 0.05 < 0.5 < used[1], used
P
  # A list of recordings, with files next to it.
  cat >list.yaml <<'Y'
recordings:
  - {name: one, class: ours, scenario: judge.yaml, obs: res/receiver.obs, truth: truth.csv, truth_format: urbannav}
  - {name: two, class: ours, scenario: judge.yaml, obs: res/receiver.obs, truth: truth.csv, truth_format: urbannav,
     nmea: res/receiver.nmea, profile: ideal, align: true}
Y
  runs 0 "$canyon" validate list.yaml --no-atmosphere --view beside --json figures.json
  says out "all ours" "95 %" "two: city moved by" "observations of one, two pooled" "filter p50 (own fixes)"
  runs 0 "$canyon" validate list.yaml --no-atmosphere --models mirror; says out "Models, two:" "mirror (the paper's)"
  [ -s beside/one/view.json ] && [ -s beside/two/view.json ] || fail "views are missing"
  python3 - <<'P' || fail "figures.json is not of both recordings"
import json
f = json.load(open("figures.json"))
one, two = f["recordings"]
assert (one["name"], two["name"]) == ("one", "two") and "alignment" in two and "alignment" not in one
assert one["models"][0]["epochs"] in range(39, 42) and two["models"][0]["epochs"] in range(19, 22)
h = one["headlines"]["tracked_los"]
# The recorded receiver is the simulated one.
assert h["measured"] == h["simulated"] and h["measured_interval_95"] == h["simulated_interval_95"], h
assert h["measured_interval_95"][0] <= h["measured"] <= h["measured_interval_95"][1], h
(ours,) = f["classes"]
assert ours["recordings"] == ["one", "two"] and ours["headlines"]["horizontal_p50_m"]["measured"] > 0
P
  runs 2 "$canyon" validate list.yaml --obs res/receiver.obs; one_line; says err --obs list
  sed -i 's/profile: ideal/profil: ideal/' list.yaml
  runs 2 "$canyon" validate list.yaml; one_line; says err list.yaml:4 "'profile'"
  runs 2 "$canyon" validate judge.yaml; one_line; says err --obs
  runs 2 "${judge[@]}" --split 0.5; one_line; says err --align
  runs 2 "${judge[@]}" --align --split 1.5; one_line; says err --split
  runs 2 "${judge[@]}" --align --split 0.1; one_line; says err epochs
  runs 2 "${judge[@]}" --align --search-radius 1; one_line; says err reach
  runs 2 "${judge[@]}" --models miror; one_line; says err miror "'mirror'"
  runs 2 "${judge[@]}" --models mirror --cumulative-models
  runs 2 "$canyon" validate judge.yaml --obs res/receiver.obs --truth truth.csv --format igc; one_line; says err igc urbannav
  runs 2 "${judge[@]}" --view judge.yaml; one_line; says err judge.yaml
  runs 2 "$canyon" validate judge.yaml --obs res/receiver.obs; one_line; says err --truth
  runs 2 "$canyon" validate judge.yaml --obs none.obs --truth truth.csv; one_line; says err none.obs
  runs 2 "$canyon" validate judge.yaml --obs truth.csv --truth truth.csv; one_line; says err truth.csv
  grep -v 'IONOSPHERIC CORR' res/sky.nav >bare.nav
  sed 's/res.sky.nav/bare.nav/' judge.yaml >bare.yaml
  runs 0 "$canyon" validate bare.yaml --obs res/receiver.obs --truth truth.csv --truth-format urbannav
  says err "the ionosphere is a standard one" "--truth-format is now --format"
  sed 's/^[0-9]*,/2000,/' truth.csv >other.csv
  runs 2 "$canyon" validate judge.yaml --obs res/receiver.obs --truth other.csv --format urbannav --no-atmosphere
  one_line; says err other.csv truth
  ls -A . rep | grep -E 'part|probe' && fail "temporary files left" ;;
calibrate)
  # Canyon's own receiver as the recorded one, three decibels stronger than its profile and without Galileo.
  sed -i 's/speed_mps: 6/speed_mps: 3/; s/nominal: true/nominal: true, errors: {enabled: false}/' small.yaml
  cp small.yaml recorder.yaml
  echo 'receivers: [{name: car, profile: ublox-m8t, exclude_signals: [Galileo], signal: {link: {above_minimum_db: 4.5}, shadowing: {enabled: false}}}]' >>recorder.yaml
  runs 0 "$canyon" simulate recorder.yaml --out res --quiet
  awk -F, 'NR > 1 {print $1 "," $2 "," $3 "," $4 "," $5}' res/epochs.csv >truth.csv
  { sed 's/^sky:.*/sky: {navigation: [res\/sky.nav]}/' small.yaml; echo 'receivers: [{name: car, profile: ublox-m8t}]'; } >judge.yaml
  one=(--obs res/receiver.obs --truth truth.csv --format urbannav --no-atmosphere)
  runs 0 "$canyon" calibrate judge.yaml "${one[@]}" -o mine.yaml --json fit.json
  says out "verdict" "signal.link.above_minimum_db" "By the held-out part" "recorded first half" "not identified" "KS C/N0 LOS"
  says mine.yaml "description: " "calibrated by" "Not identified by these recordings" "was 1.5;" "as ublox-m8t"
  python3 - <<'P' || fail "fit.json is not what was recorded"
import json
f = json.load(open("fit.json"))
level = next(e for e in f["estimates"] if e["key"] == "signal.link.above_minimum_db")
low, high = map(float, level["interval_95"].split(" to "))
assert low < 4.5 < high, level
assert {e["verdict"] for e in f["estimates"]} <= {"fitted", "agrees", "not identified"}
assert len(f["judged"]["recordings"]) == 2
P
  # The profile is valid.
  sed 's/profile: ublox-m8t/profile: .\/mine.yaml/' judge.yaml >mine_judge.yaml
  runs 0 "$canyon" scenario show mine_judge.yaml
  runs 0 "$canyon" validate mine_judge.yaml "${one[@]}" --quiet
  # A complete list; keys set by the scenario are named.
  sed 's/profile: ublox-m8t/profile: ublox-m8t, signal: {link: {above_minimum_db: 1}, shadowing: {enabled: true}}/' judge.yaml >own.yaml
  cat >list.yaml <<'Y'
recordings:
  - {name: a, scenario: judge.yaml, obs: res/receiver.obs, truth: truth.csv, truth_format: urbannav}
  - {name: b, scenario: own.yaml, obs: res/receiver.obs, truth: truth.csv, truth_format: urbannav}
Y
  runs 0 "$canyon" calibrate list.yaml --no-atmosphere --part all -o both.yaml
  says out "Nothing was held out"; says err "own.yaml:" "overrides the calibrated profile"
  # Faults are reported before anything is computed, and nothing is written.
  runs 2 "$canyon" calibrate judge.yaml "${one[@]}"; says err out
  runs 2 "$canyon" calibrate judge.yaml "${one[@]}" -o bad; one_line; says err .yaml
  runs 2 "$canyon" calibrate judge.yaml "${one[@]}" -o no/bad.yaml; one_line; says err no/
  runs 2 "$canyon" calibrate judge.yaml "${one[@]}" -o bad.yaml --profile ublox; one_line; says err ublox-m8t
  runs 2 "$canyon" calibrate judge.yaml "${one[@]}" -o bad.yaml --profile ideal --quiet; one_line; says err strength --profile
  runs 2 "$canyon" calibrate judge.yaml "${one[@]}" -o bad.yaml --split 0.1 --quiet; one_line; says err epochs
  runs 2 "$canyon" calibrate judge.yaml -o bad.yaml; one_line; says err --obs
  sed -i 's/obs: res.receiver.obs/obs: none.obs/' list.yaml
  runs 2 "$canyon" calibrate list.yaml -o bad.yaml; one_line; says err list.yaml:2 none.obs
  [ ! -e bad.yaml ] || fail "a profile was written"
  ls -A . | grep -E 'part|probe' && fail "temporary files left"
  : ;;
validate_real)
  needs_data urbannav-tst-20190428/COM3_190428_124409.obs
  drive=$data/urbannav-tst-20190428
  # Without obstacles missing in the map: the metrics of docs/results.md.
  sed -e "s#hongkong/#$data/hongkong/#; s#urbannav-tst-20190428/#$drive/#g; /^surroundings:/d; /^  roofs_m:/d" "$root/examples/urbannav_tst_m8t.yaml" >tst.yaml
  runs 0 "$canyon" validate tst.yaml --obs "$drive/COM3_190428_124409.obs" --align --models mirror,specular --json figures.json
  says out "city moved by" "first half" "second half" "242 epochs" reflected
  python3 - <<'P' || fail "the drive's figures are not those of docs/results.md"
import json
f = json.load(open("figures.json"))
assert abs(f["alignment"]["east_m"] + 2) < 2 and abs(f["alignment"]["north_m"]) < 2, f["alignment"]
mirror, specular = f["models"][1], f["models"][2]
assert abs(specular["separation_by_error"]["auc"] - 0.907) < 0.03
assert abs(specular["separation_by_cn0"]["auc"] - 0.861) < 0.03
assert specular["explained"][-1]["spearman"]["rho"] > mirror["explained"][-1]["spearman"]["rho"] + 0.2
# The M8T's own: docs/results.md.
m8t = f["models"][0]
assert m8t["explained"][-1]["share"] > 0.95
assert m8t["distributions"]["nlos_error_m"]["ks"] < 0.25 and m8t["distributions"]["los_error_m"]["ks"] < 0.2
d = m8t["distributions"]
medians = [d["los_cn0_dbhz"][k]["p50"] - d["nlos_cn0_dbhz"][k]["p50"] for k in ("measured", "simulated")]
assert abs(medians[0] - medians[1]) <= 4, medians
P
  sed 's/east_m: 0, north_m: 8/east_m: 60, north_m: 68/' tst.yaml >off.yaml
  runs 0 "$canyon" validate off.yaml --obs "$drive/COM3_190428_124409.obs" --align --json figures.json
  says err "does not determine the city's offset" --search-radius
  # Both drives together, with positions as in the scenarios.
  [ -e "$data/berlin-potsdamer-platz/truth.csv" ] || { echo "without Berlin: it is not in ../shared/data"; exit $failed; }
  for folder in hongkong urbannav-tst-20190428 urbannav-tst-20210517 berlin-potsdamer-platz; do ln -s "$data/$folder" .; done
  cp "$root"/examples/{urbannav_tst_m8t,urbannav_tst_2021,berlin_m8}.yaml .
  grep -v align: "$root/examples/recordings.yaml" >recordings.yaml
  runs 0 "$canyon" validate recordings.yaml --part rest --json figures.json
  says out "tst (mass market)" "berlin (mass market)" "all mass market" "687 epochs"
  python3 - <<'P' || fail "the drives are not those of docs/results.md"
import json
f = json.load(open("figures.json"))
tst, berlin, *other_day = (r["headlines"] for r in f["recordings"])
# Metrics of the recordings alone, without Canyon's models.
assert abs(tst["horizontal_p50_m"]["measured"] - 8.5) < 2 and abs(berlin["horizontal_p50_m"]["measured"] - 31) < 5
assert abs(tst["cn0_los_dbhz"]["measured"] - 36) <= 1 and abs(berlin["cn0_los_dbhz"]["measured"] - 45) <= 1
# The map of one drive lacks obstacles, the other's does not (docs/shadowing.md).
for h in tst, berlin:
  assert abs(h["tracked_los"]["measured"] - h["tracked_los"]["simulated"]) < 0.1, h
# Facades, scattering and edges make echoes as weak relative to clear signals as recorded (docs/results.md).
  assert abs(h["cn0_los_less_nlos_db"]["measured"] - h["cn0_los_less_nlos_db"]["simulated"]) <= 3, h
assert [[s["satellite"] for s in r["models"][0]["never_tracked"]] for r in f["recordings"][:2]] == [["C07"], []]
assert len(other_day) == 3, len(other_day)
pooled = f["classes"][0]["headlines"]
for key in "horizontal_p50_m", "cn0_los_dbhz", "tracked_los":
    between = sorted(h[key]["measured"] for h in (tst, berlin))
    assert between[0] <= pooled[key]["measured"] <= between[1], key
P
  ;;
correlation)
  runs 0 "$canyon" simulate small.yaml --out c --duration 2 --quiet
  name=$(awk -F, 'NR == 1 {for (i = 1; i <= NF; ++i) {if ($i == "sat") s = i; if ($i == "visibility") v = i}}
    NR > 1 && $v == "LOS" {print $s; exit}' c/satellites.csv)
  correlation=${canyon%/*}/correlation_csv
  runs 0 "$correlation" small.yaml --satellite "$name" --duration 2
  python3 - <<'P' || fail "the peak of a satellite in sight is not at its line of sight"
import csv
first = [r for r in csv.DictReader(open("out")) if float(r["time_s"]) == 0]
assert len(first) == 301, len(first)
# From one chip of L1 C/A, the signal near L1, before the line of sight to two after it.
assert [float(r["delay_m"]) for r in (first[0], first[-1])] == [-293.052, 586.105], first
peak = max(first, key=lambda r: abs(complex(float(r["in_phase"]), float(r["quadrature"]))))
assert abs(float(peak["delay_m"])) < 60, peak
assert 0.3 < abs(complex(float(peak["in_phase"]), float(peak["quadrature"]))) < 3, peak
P
  runs 2 "$correlation" small.yaml --satellite C62; says err 'the sky has no satellite C62'
  runs 2 "$correlation" small.yaml --satellite "$name" --signal E1; says err "sends no signal 'E1'"
  ;;
skyplot)
  runs 0 "$canyon" skyplot --help
  says out --out --frames --at --enu --time --receiver --style --projection --trails --width --every --first --last --threads "east to the LEFT"
  # One picture: files, sizes, and no leftovers.
  runs 0 "$canyon" skyplot small.yaml -o sky.png --trails 30; says err sky.png
  runs 0 "$canyon" skyplot small.yaml -o up.svg --style fisheye --projection stereographic --enu 0,0,2 --quiet
  [ ! -s out ] && [ ! -s err ] || fail "--quiet printed something"
  # size PNG: width and height as the header (IHDR) has them.
  size() { od -An -tu1 -j16 -N8 "$1" | awk '{print ($3 * 256 + $4) "x" ($7 * 256 + $8)}'; }
  [ "$(size sky.png)" = 1980x1672 ] || fail "sky.png is $(size sky.png)"
  python3 -c 'import sys, xml.dom.minidom as m; assert m.parse(sys.argv[1]).documentElement.tagName == "svg"' up.svg || fail "up.svg is not well-formed"
  runs 0 "$canyon" skyplot small.yaml -o small.png --width 400 --time 2026-03-09T10:00:00Z; says err warning: "is at its end"
  [ "$(size small.png)" = 400x338 ] || fail "small.png is $(size small.png)"
  # Frames: 20 s of drive every 4 s are six; the same bytes on any number of threads.
  runs 0 "$canyon" skyplot small.yaml --frames film --style fisheye --width 300 --every 4 --threads 1; says err "6 frames"
  [ "$(cd film && echo *)" = "$(printf 'frame_%06d.png ' 1 2 3 4 5 6 | sed 's/ $//')" ] || fail "film holds $(ls film)"
  [ "$(size film/frame_000006.png)" = 300x253 ] || fail "a frame is $(size film/frame_000006.png)"
  runs 0 "$canyon" skyplot small.yaml --frames film2 --style fisheye --width 300 --every 4 --quiet
  diff -r film film2 || fail "other bytes on another number of threads"
  cmp -s film/frame_000001.png film/frame_000006.png && fail "the drive does not move"
  runs 0 "$canyon" skyplot small.yaml --frames film --style fisheye --width 300 --every 4 --first 4 --last 2026-03-01T10:00:12Z
  says err "3 frames"; [ "$(cd film && echo *)" = "$(printf 'frame_%06d.png ' 1 2 3 | sed 's/ $//')" ] || fail "left of an earlier run: $(ls film)"
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
  runs 2 "$canyon" skyplot small.yaml -o bad.png --style round; one_line; says err --style sky fisheye
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
  [ "$(ls long | wc -l)" -eq "${finished:-0}" ] || fail "said $finished frames, wrote $(ls long | wc -l)"
  [ "$(ls long | tail -n 1)" = "$(printf 'frame_%06d.png' "${finished:-0}")" ] || fail "the frames have a gap" ;;
city)
  printf 'v 0 0 0\nv 10 0 0\nv 10 0 10\nv 0 0 10\nf 1 2 3 4\n' >wall.obj
  runs 0 "$canyon" city info wall.obj; says out triangles "2 (0 terrain)"
  runs 0 "$canyon" city info small.yaml --json; says out '"buildings"' '"highest_roof_m"'
  runs 2 "$canyon" city info absent.dae; one_line; says err absent.dae
  printf 'v 0 0 0\n' >empty.obj
  runs 2 "$canyon" city info empty.obj; one_line; says err empty.obj
  printf 'garbage' >bad.xyz
  runs 2 "$canyon" city info bad.xyz; one_line; says err bad.xyz .obj
  local_tileset tileset.json
  runs 0 "$canyon" city info tileset.json; says out "3D Tiles 1.1: 1 tile of 1 tileset" "triangles     1"; says err "city.origin" "gap: " missing.glb
  runs 2 "$canyon" city build tileset.json -o tiles.canyon; one_line; says err "is not georeferenced"
  runs 0 "$canyon" city build tileset.json -o tiles.canyon --origin 48,11,500; says err missing.glb
  runs 0 "$canyon" city info tiles.canyon; says out missing.glb
  runs 2 "$canyon" city info tileset.json --bbox 1,2,3; one_line; says err --bbox
  runs 2 "$canyon" city info wall.obj --error 2; one_line; says err "not 3D Tiles"
  runs 2 "$canyon" city info 'http://127.0.0.1:9/t.json?key=s3cret'; one_line; grep -F s3cret out err && fail "a key is printed"
  runs 0 "$canyon" check tileset.json; says out "city (3D Tiles)" ;;
city_build)
  block_osm >block.osm
  runs 0 "$canyon" city build block.osm -o city.canyon -o city.glb -o city.obj -o city.dae -o map.geojson -o town.world -o model/
  says out "buildings   2" "1 tagged, 0 from levels, 1 by default" "triangles"
  runs 0 "$canyon" city build block.osm -o type.canyon --height hous=7
  says err "the map has no building of type 'hous'; did you mean 'house'?"
  grep -q '"height_source":"default"' map.geojson || fail "map.geojson does not say where heights come from"
  grep -q spherical_coordinates town.world || fail "town.world has no spherical_coordinates"
  [ -s model/model.sdf ] && [ -s model/model.config ] || fail "no Gazebo model"
  for file in city.canyon city.glb city.obj city.dae town.world model block.osm; do
    runs 0 "$canyon" city info "$file"; says out "buildings     2" "highest roof  30.0 m"
  done
  # Tiles of CityGML: a folder, one of them damaged, a box, blocks missing in the files.
  python3 "$root/tests/cross_checks/lod2_tiles.py" tiles 3 9
  runs 0 "$canyon" city info tiles; says out "objects     27 Building LoD 2" "of 3 files" "27 have a use"
  runs 0 "$canyon" check tiles; says out "buildings     27"
  printf 'city: {osm: tiles/}\ntrajectory: {position: {east_m: 0, north_m: 0, up_m: 30}}\nduration_s: 1\nstart: 2026-06-01T08:00:00Z\nsky: {nominal: true}\nreceivers: [{name: a}]\n' >tiles.yaml
  runs 0 "$canyon" simulate tiles.yaml --out tiles_out
  sed -i 's|tiles/|tiles|' tiles.yaml; runs 2 "$canyon" simulate tiles.yaml --out tiles_out; one_line; says err "end its name with /"
  head -c 9000 tiles/LoD2_33_381_5810_1_BE.gml >cut && mv cut tiles/LoD2_33_381_5810_1_BE.gml
  runs 0 "$canyon" city build tiles -o tiles.canyon --geoid-undulation 40 --foliage
  says err "tile left out: tiles/LoD2_33_381_5810_1_BE.gml:" "is cut short"; says out "buildings   18"
  runs 0 "$canyon" city info tiles --geoid-undulation 40; says out "40.000 m added"
  runs 2 "$canyon" city info tiles/LoD2_33_381_5810_1_BE.gml; one_line; says err "1_BE.gml:" "is cut short"
  runs 2 "$canyon" city build tiles -o blocks.canyon --lod 1; one_line; says err "up to LoD 1"
  runs 0 "$canyon" city build tiles -o some.canyon --bbox 13.2,52.4,13.244,52.45; says out "buildings"
  runs 0 "$canyon" city build city.canyon -o again.glb --quiet
  [ ! -s out ] && [ ! -s err ] || fail "--quiet printed something"
  runs 0 "$canyon" city build block.osm -o half.canyon --bbox 11.0009,47.999,11.003,48.003 --height house=7 --json
  says out '"buildings": 1' '"heights_default": 1' '"highest_roof_m": 6.9999'
  ls -A | grep -E 'part|probe' && fail "temporary files left" ;;
city_simulate)
  block_osm >block.osm
  sed 's/^city.*/city: {osm: block.osm, origin: {latitude_deg: 48, longitude_deg: 11}}/' small.yaml >map.yaml
  runs 0 "$canyon" simulate map.yaml --out map --quiet
  sed 's/"30"/"x"/' block.osm >guess.osm; sed 's/block.osm/guess.osm/' map.yaml >guess.yaml
  runs 0 "$canyon" simulate guess.yaml --out guess; says err "2 of 2 heights are guesses"
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
  runs 2 "$canyon" city build block.osm -o c.glb --bbox 2,1,-2,2; one_line; says err "east bound"
  runs 2 "$canyon" city build block.osm -o c.glb --bbox 1,2,3,4; one_line; says err "in the box"
  runs 2 "$canyon" city build block.osm -o c.glb --origin 0,0,0; one_line; says err km bbox
  runs 2 "$canyon" city build block.osm -o c.glb --height house; one_line; says err TYPE=METRES
  runs 2 "$canyon" city build block.osm -o c.glb --level-height 0; one_line; says err --level-height "level_height_m: 0 is out of range"
  runs 2 "$canyon" city build -o c.glb; one_line; says err nothing
  runs 2 "$canyon" city build -o c.glb --overpass http://127.0.0.1:9/ --bbox 11,48,11.01,48.01 --cache cache; one_line
  printf 'canyon?' >bad.canyon
  runs 2 "$canyon" city info bad.canyon; one_line; says err bad.canyon
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
  # Files that are not paths are reported by their kind.
  block_osm >map.txt; printf '$@ no SBF' >log.txt
  for file in map.txt:'is a map of OpenStreetMap' log.txt:'is a log of SBF'; do
    printf 'city: {synthetic: {}}\nstart: 2026-03-01T10:00:00Z\ntrajectory: {file: %s}\n' "${file%%:*}" >path.yaml
    runs 2 "$canyon" simulate path.yaml --out res; one_line; says err "${file##*:}"
  done
  runs 2 "$canyon" rtk log.txt log.txt --nav log.txt; one_line; says err 'is a log of SBF' 'convbin -r sbf'
  grep -vE 'trajectory|waypoints|speed' small.yaml >still.yaml
  runs 2 "$canyon" live still.yaml --duration 1; one_line; says err "'trajectory' is missing" '--poses'
  sed '/waypoints/,/speed/d' small.yaml >base.yaml
  with_file() { { cat base.yaml; } | sed "s/^trajectory:.*/trajectory: {file: $1}/" >bad.yaml; }
  printf 'time,latitude,longitude,height\n0,22.3,114.17,nan\n1,22.3,114.17,nan\n' >t.csv; with_file t.csv
  runs 2 "$canyon" simulate bad.yaml --out res; one_line; says err t.csv:2:
  printf 'time,latitude,longitude,height\n0,114.17,22.3,2\n1,114.17,22.3,2\n' >t.csv; with_file t.csv
  runs 2 "$canyon" simulate bad.yaml --out res; one_line; says err t.csv:2: "latitude 114.17 deg is out of range"
  printf 'time,latitude,longitude,height\n0,2230.1,114.17,2\n1,2230.2,114.17,2\n' >t.csv; with_file t.csv
  runs 2 "$canyon" simulate bad.yaml --out res; one_line; says err t.csv:2: latitude
  printf 'time,latitude,longitude,height\n5,22.3,114.17,2\n4,22.3,114.17,2\n3,22.3,114.17,2\n' >t.csv; with_file t.csv
  runs 2 "$canyon" simulate bad.yaml --out res; one_line; says err t.csv: "sort the points by time"
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
  # Former names of options still work, with a warning.
  for each in heatmap:draws:samples heatmap:known:fixed-unknowns validate:reach:search-radius city\ info:most-tiles:max-tiles; do
    IFS=: read -r command former name <<<"$each"
    runs 2 "$canyon" $command none.yaml "--$former" 9; says err "--$former is now --$name"
  done
  for each in validate:unsaid:forget-unknowns validate:ladder:cumulative-models city\ info:elsewhere:allow-external; do
    IFS=: read -r command former name <<<"$each"
    runs 2 "$canyon" $command none.yaml "--$former"; says err "--$former is now --$name"
  done
  : >file
  runs 2 "$canyon" simulate small.yaml --out file; one_line; says err file
  if [ "$(id -u)" -ne 0 ]; then
    mkdir locked; chmod 500 locked
    runs 2 "$canyon" simulate small.yaml --out locked/res; one_line; says err locked
  else
    runs 2 "$canyon" simulate small.yaml --out /proc/res; one_line; says err /proc/res
  fi
  # A full disk (here: a limit on the size of files): one clear error, and files of an earlier run
  # are unchanged.
  runs 0 "$canyon" simulate small.yaml --out res --quiet
  cp res/satellites.csv before.csv
  runs 1 bash -c 'trap "" XFSZ; ulimit -f 8; exec "$0" simulate small.yaml --out res --quiet --seed 2' "$canyon"
  one_line; says err res/ "cannot be written"
  cmp before.csv res/satellites.csv || fail "a failed run spoilt an older file"
  ls -A res | grep part && fail "temporary files left"
  mkdir live
  runs 1 bash -c 'trap "" XFSZ; ulimit -f 2; exec "$0" live small.yaml --stamps --quiet --stream epochs_csv=file:live/a.csv' "$canyon"
  one_line; says err live/a.csv "cannot be written"
  [ -z "$(ls -A live)" ] || fail "live holds $(ls -A live)" ;;
inputs)
  # No output replaces an input of the run, by any name; then nothing is written.
  runs 0 "$canyon" simulate small.yaml --out in --duration 5 --quiet
  block_osm >in/block.osm
  runs 0 "$canyon" city build in/block.osm -o in/block.obj -o in/block.canyon -o in/block --quiet
  { printf 'ncols 40\nnrows 40\nxllcorner 10.98\nyllcorner 47.98\ncellsize 0.001\n'; yes 500 | head -1600; } >in/hdop.tif
  echo 'GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]]' >in/hdop.prj
  cp small.yaml in
  refuses() {
    local file=$1; shift
    cp -r in before
    runs 2 "$@"; one_line; says err "$file: is an input of this run and would be replaced; choose another --out or name"
    diff -r in before || fail "changed by: $*"
    find . -name '*.part*' | grep . && fail "temporary files left"
    rm -r before
  }
  drive() { sed "/waypoints/,/speed/d; s/^trajectory:.*/trajectory: {file: $1}/" small.yaml >in/drive.yaml; }
  drive track.kml
  refuses in/track.kml "$canyon" simulate in/drive.yaml --out in
  ln -s in link; ln in/track.kml hard.kml; ln -s in/track.kml soft.kml
  refuses link/track.kml "$canyon" simulate in/drive.yaml --out link
  for file in hard.kml soft.kml in/../in/track.kml in/drive.yaml; do
    refuses $file "$canyon" simulate in/drive.yaml --out o --stream kml=file:$file
  done
  drive receiver.nmea
  refuses in/receiver.nmea "$canyon" simulate in/drive.yaml --out in
  refuses in/receiver.nmea "$canyon" iq in/drive.yaml --out in/receiver.nmea --duration 1
  printf 'time,latitude_deg,longitude_deg,height_m\n2026-03-01T10:00:0%dZ,0.001,0,2\n' 0 >in/way.csv
  printf '2026-03-01T10:00:0%dZ,0.001,0,2\n' 1 2 3 >>in/way.csv
  drive way.csv
  refuses in/way.csv "$canyon" iq in/drive.yaml --out in/way.csv --duration 1
  sed 's/nominal: true/navigation: [sky.nav]/' small.yaml >in/day.yaml
  refuses in/sky.nav "$canyon" simulate in/day.yaml --out in
  refuses in/sky.nav "$canyon" rtk in/receiver.obs in/receiver.obs --nav in/sky.nav --out in/sky.nav
  printf 'scenario: drive.yaml\naxes: [{seeds: 2}]\n' >in/study.yaml
  mv in/way.csv in/table.csv; drive table.csv
  rm in/.canyon-results
  refuses in/table.csv "$canyon" study in/study.yaml --out in
  refuses in/block.obj "$canyon" city build in/block.obj -o in/block.obj
  refuses in/block.canyon "$canyon" city build in/block.canyon -o in/block.canyon
  refuses in/block/model.config "$canyon" city build in/block -o in/block
  sed 's/city:.*/city: {osm: block.osm, terrain: hdop.tif}/' small.yaml >in/ground.yaml
  refuses in/hdop.tif "$canyon" heatmap in/ground.yaml --out in --layers hdop --spacing 8
  echo '<!--canyon:data-->' >page.html
  CANYON_VIEWER=page.html refuses in/block.osm "$canyon" view in/block.osm --export in/block.osm
  # A result also does not replace a user's file of the same name; the second run of a command replaces its own.
  keeps() {
    local file=mine/$1; shift
    rm -rf mine; mkdir mine; echo notes >$file
    runs 2 "$@"; one_line; says err "$file: exists already and was not written by Canyon"
    [ "$(cat $file)" = notes ] || fail "replaced by: $*"
    rm $file; runs 0 "$@"; runs 0 "$@"
  }
  printf 'scenario: small.yaml\naxes: [{seeds: 2}]\n' >few.yaml
  keeps track.kml "$canyon" simulate small.yaml --out mine --duration 2 --quiet
  for file in map.nc hdop.tif map.png; do keeps $file "$canyon" heatmap small.yaml --out mine --layers hdop --spacing 16 --quiet; done
  runs 0 "$canyon" heatmap small.yaml --out mine --layers satellites_los --spacing 16 --format netcdf; says err "mine also has files of an earlier map"
  keeps table.csv "$canyon" study few.yaml --out mine --no-pictures --quiet
  keeps frame_000002.png "$canyon" skyplot small.yaml --frames mine --width 300 --every 10 --quiet
  # A folder has the results of one command; others are rejected before they read a city.
  runs 0 "$canyon" heatmap small.yaml --out one --layers hdop --spacing 16 --format netcdf --quiet; cp one/map.nc kept.nc
  for words in "simulate small.yaml --out" "study few.yaml --out" "skyplot small.yaml --frames" "view small.yaml --out"; do
    runs 2 "$canyon" $words one --quiet; one_line; says err "one: has the results of another command, 'canyon heatmap'"
  done
  cmp kept.nc one/map.nc || fail "the map has changed"
  runs 0 "$canyon" heatmap small.yaml --out one --layers hdop --spacing 16 --format netcdf --quiet
  mkdir shown; echo 'seed: 2' >shown/demo.yaml
  runs 2 "$canyon" demo --out shown; one_line; says err "shown/demo.yaml: already exists"
  # A file written by a run and read by the next one is not removed; the list does not follow links out of the folder.
  mkdir users; echo mine >users/a; touch -d '-1 hour' users/a
  runs 0 "$canyon" simulate small.yaml --out res --duration 5 --quiet
  ln -s ../users res/sub; printf '%s\n' sub/a ../users/a "$PWD/users/a" sub/../../users/a >>res/.canyon-results
  sed "/waypoints/,/speed/d; s/^trajectory:.*/trajectory: {file: res\/track.kml}/; s/^outputs.*/outputs: [epochs_csv]/" small.yaml >again.yaml
  runs 0 "$canyon" simulate again.yaml --out res --quiet
  runs 0 "$canyon" simulate again.yaml --out res --quiet
  [ "$(ls res | tr '\n' ' ')" = "epochs.csv report.txt sub track.kml " ] || fail "res holds $(ls res)"
  [ -s users/a ] || fail "the list of results reached out of the folder"
  # A list that is a link is ignored.
  mv res/.canyon-results list; ln -s ../list res/.canyon-results; cp list before
  runs 2 "$canyon" simulate small.yaml --out res --quiet --duration 1
  cmp list before || fail "wrote through a link"
  # The folder of a served view is exclusive.
  mkdir tmp; CANYON_VIEWER=page.html TMPDIR=$PWD/tmp "$canyon" view in/block.osm --quiet >address & served=$!
  until [ -s address ]; do kill -0 "$served" || { fail "canyon view ended"; break; }; sleep 0.1; done
  [ "$(stat -c %a tmp/canyon-view-*)" = 700 ] || fail "others may read $(stat -c '%n %a' tmp/*)"
  kill -HUP "$served"; wait "$served" || fail "canyon view did not end by itself"
  [ -z "$(ls tmp)" ] || fail "left: $(ls tmp)" ;;
interrupt)
  # Long enough for a reliable interruption: a day at 10 Hz.
  sed 's/rate_hz.*/rate_hz: 10/; s/speed_mps.*/speed_mps: 0.001/' small.yaml >long.yaml
  "$canyon" simulate long.yaml --out res >out 2>err &
  program=$!
  # Wait for epochs, with a deadline.
  for _ in $(seq 200); do ls res/*.part* >/dev/null 2>&1 && [ "$(cat res/epochs.csv.part* | wc -l)" -gt 10 ] && break; sleep 0.1; done
  kill -INT "$program"; wait "$program"; status=$?
  [ "$status" -eq 130 ] || { fail "exit status $status instead of 130"; cat err; }
  says err interrupted "epochs finished"
  for file in epochs.csv satellites.csv receiver.nmea receiver.obs sky.nav; do [ -s "res/$file" ] || fail "no res/$file"; done
  finished=$(sed -n 's/.*interrupted: \([0-9]*\) of.*/\1/p' err)
  [ "$(wc -l <res/epochs.csv)" -eq $((finished + 1)) ] || fail "said $finished epochs, wrote $(wc -l <res/epochs.csv) lines"
  ls -A res | grep part && fail "temporary files left"
  # One run at a time in a folder. Under nohup the end of the terminal has no effect.
  (trap '' HUP; exec "$canyon" simulate long.yaml --out res >out1 2>err1) &
  program=$!
  for _ in $(seq 200); do ls res/*.part* >/dev/null 2>&1 && break; sleep 0.1; done
  runs 2 "$canyon" simulate small.yaml --out res; one_line; says err "res: another run uses this folder (process $program)"
  kill -HUP "$program"; sleep 0.5; kill -TERM "$program"; wait "$program"; status=$?
  [ "$status" -eq 130 ] || fail "exit status $status instead of 130" ;;
heatmap)
  runs 0 "$canyon" heatmap --help
  says out --out --bbox --enu-box --area --spacing --altitude --altitude-kind --times --layers --format --model \
    --receiver --samples --motion --seed --threads --tile --keep-tiles --large horizontal_error_p95 sky_view query mpirun
  # The complete city in all formats: files, table, no leftovers.
  runs 0 "$canyon" heatmap small.yaml --out map --spacing 4 --threads 1
  # Titles name systems with satellites.
  sed 's/nominal: true/nominal: true, systems: [GPS, SBAS]/' small.yaml >sbas.yaml
  runs 0 "$canyon" heatmap sbas.yaml --out sbas --spacing 40 --quiet; grep -qa SBAS sbas/map.nc && fail "the sky has no SBAS"
  runs 0 "$canyon" heatmap small.yaml --out map --spacing 4 --threads 1
  says out "inside buildings" "availability of a fix" "cells/s" horizontal_error satellites_visible hdop median "95 %"
  says err "city " "grid " map.nc
  for file in map.nc horizontal_error.tif satellites_visible.tif hdop.tif map.png; do
    [ -s "map/$file" ] || fail "no map/$file, but $(ls map)"
  done
  [ ! -e map/tiles ] || fail "the tiles were left"
  ls -A map | grep -E 'part|probe' && fail "temporary files left"
  # Another number of threads, and quiet: the same bytes.
  runs 0 "$canyon" heatmap small.yaml --out map2 --spacing 4 --threads 2 --quiet
  [ ! -s out ] && [ ! -s err ] || fail "--quiet printed something"
  diff -r map map2 || fail "other bytes on another number of threads"
  # The map's cells equal trace and simulate at their centres.
  runs 0 "$canyon" heatmap small.yaml --out box --enu-box=-40,-8,40,8 --spacing 4 --altitude 2,20 --format netcdf \
    --layers horizontal_error,satellites_visible,satellites_blocked,availability --times 0,600 --keep-tiles --quiet
  [ -e box/tiles/manifest.json ] && [ ! -e box/map.png ] || fail "box holds $(ls box)"
  python3 - "$canyon" <<'P' || fail "the map is not what trace says of its cells"
import json, subprocess, sys
canyon = sys.argv[1]
run = lambda *a: json.loads(subprocess.run([canyon, *a], check=True, capture_output=True, text=True).stdout)
alike = 0
for time, altitude in ("2026-03-01T10:00:00Z", 2), ("2026-03-01T10:10:00Z", 20):
    for east in range(-38, 40, 4):
        t = run("trace", "small.yaml", "--enu", f"{east},2,{altitude}", "--time", time, "--json")
        above = [s for s in t["satellites"] if s["elevation_deg"] >= 10]
        q = run("heatmap", "query", "box/map.nc", "--at", f"{t['latitude_deg']:.9f},{t['longitude_deg']:.9f}",
                "--altitude", str(altitude), "--time", time, "--json")
        assert abs(q["enu_m"][0] - east) < 0.01 and q["altitude_m"] == altitude, q
        if t["placement"] != "free":
            assert q["state"] == "inside a building", (t["placement"], q)
            continue
        blocked = sum(s["visibility"] == "blocked" for s in above)
        v = q["values"]
        alike += v["satellites_blocked"] == blocked and v["satellites_visible"] == len(above) - blocked
print(alike)
assert alike >= 38, alike
P
  # The same command again finds its tiles; another one does not use them.
  box=("$canyon" heatmap small.yaml --out box --enu-box=-40,-8,40,8 --spacing 4 --altitude 2,20 --format netcdf
    --layers horizontal_error,satellites_visible,satellites_blocked,availability --times 0,600 --keep-tiles)
  cp box/map.nc first.nc
  runs 0 "${box[@]}"; says err "resumed"; cmp first.nc box/map.nc || fail "other bytes from kept tiles"
  runs 2 "${box[@]}" --seed 5; one_line; says err box/tiles "another map"
  runs 2 "${box[@]}" --model mirror; one_line; says err box/tiles
  # A damaged tile is named.
  tile=$(ls box/tiles/*.tile | head -n 1); printf 'x' | dd of="$tile" bs=1 seek=200 conv=notrunc 2>/dev/null
  runs 2 "${box[@]}"; one_line; says err "$tile" damaged
  # Times, areas, models, layers.
  runs 0 "$canyon" heatmap small.yaml --out day --enu-box=-20,-6,20,6 --spacing 8 --times day/8h --format netcdf --quiet
  runs 0 "$canyon" heatmap query day/map.nc --at 22.3,114.17 --time 2026-03-02T01:00:00Z; says out 2026-03-02T02:00:00Z
  at=$(sed -n 's/^\([0-9.-]*\), \([0-9.-]*\) (east.*/\1,\2/p' out)
  [ -n "$at" ] || fail "no place in the answer"
  cat >area.geojson <<'G'
{"type": "Feature", "properties": {}, "geometry": {"type": "Polygon", "coordinates":
 [[[114.1698, 22.2998], [114.1702, 22.2998], [114.1702, 22.3002], [114.1698, 22.2998]]]}}
G
  runs 0 "$canyon" heatmap small.yaml --out area --area area.geojson --spacing 2 --model mirror --format png \
    --layers horizontal_error_p95,sky_view --samples 8
  says out "outside the area" sky_view
  runs 0 "$canyon" heatmap small.yaml --out all --enu-box=-8,-8,8,8 --spacing 4 --layers all --samples 4 --format netcdf,geotiff
  says out largest_excess vertical_error_rms
  [ "$(ls all/*.tif | wc -l)" -eq 25 ] || fail "$(ls all)"
  # No trajectory is needed, and no city if a box is given.
  printf 'city: {open: true, origin: {latitude_deg: 48, longitude_deg: 11, height_m: 500}}\nsky: {nominal: true}\nstart: 2026-03-01T10:00:00Z\n' >open.yaml
  runs 0 "$canyon" heatmap open.yaml --out open --bbox 10.9999,47.9999,11.0001,48.0001 --format geotiff
  says out "100.0 %"
  command -v gdalinfo >/dev/null || { echo "SKIPPED: gdalinfo is not installed"; exit "$failed"; }
  gdalinfo -json open/hdop.tif >info.json && python3 - <<'P' || fail "GDAL does not see the box where it is"
import json
ring = json.load(open("info.json"))["wgs84Extent"]["coordinates"][0]
east, north = [p[0] for p in ring], [p[1] for p in ring]
# A cell is 2 m: 2.7e-5 deg of longitude at most.
assert abs(min(east) - 10.9999) < 3e-5 and abs(max(east) - 11.0001) < 3e-5, ring
assert abs(min(north) - 47.9999) < 3e-5 and abs(max(north) - 48.0001) < 3e-5, ring
P
  ;;
study)
  cat >study.yaml <<'Y'
scenario: small.yaml
axes:
  - seeds: 3
  - {key: "receivers[0].elevation_mask_deg", values: [5, 25]}
Y
  sed -i '$a receivers: [{name: car}]\nduration_s: 3' small.yaml
  runs 0 "$canyon" study --help; says out --shard SLURM_ARRAY_TASK_ID --dry-run merge axes[].seeds
  runs 0 "$canyon" study study.yaml --dry-run; says out "6 runs of 1 receivers (car)" elevation_mask_deg realization
  runs 0 "$canyon" study study.yaml --out whole --threads 1; says out "receiver" "runs" "intervals"
  for f in study.nc table.csv errors.png boxes.svg availability.png; do [ -s whole/$f ] || fail "no $f"; done
  head -1 whole/table.csv | grep -q '^elevation_mask_deg,receiver,runs,figure,unit,mean,low,high,' || fail "table.csv has another header"
  [ "$(wc -l <whole/table.csv)" -eq 11 ] || fail "table.csv has not two groups of five figures"
  # A run equals canyon simulate's.
  runs 0 "$canyon" study study.yaml --print-run 3; cp out run.yaml
  runs 0 "$canyon" simulate run.yaml --out run; says out "horizontal error, 95 %"
  p95=$(awk '/horizontal error, 95/ {print $NF}' out)
  python3 - "$p95" <<'P' || fail "run 3 has another error than canyon simulate"
import glob, json, sys
for name in glob.glob("whole/runs/*.jsonl"):
    for line in open(name):
        record = json.loads(line[9:])
        if record["run"] == 3:
            assert record["seed"] == 2 and record["at"] == ["2", "25"], record["at"]
            assert abs(record["receivers"][0]["figures"][4] - float(sys.argv[1])) < 6e-4
            sys.exit(0)
sys.exit(1)
P
  # Shards, threads, interruption: the same bytes.
  runs 0 "$canyon" study study.yaml --out a --shard 1/2 --quiet
  runs 0 "$canyon" study study.yaml --out b --shard 2/2 --threads 2 --quiet
  [ ! -e a/study.nc ] || fail "half a study has results"
  runs 2 "$canyon" study merge a --out c; says err "3 of 6 runs are missing"
  runs 0 "$canyon" study merge a b --out c --quiet
  for f in study.nc table.csv errors.png; do cmp whole/$f c/$f || fail "other bytes of $f from shards"; done
  # A scheduler's array of three jobs, at once, in separate folders and in one.
  for folder in 'part$SLURM_ARRAY_TASK_ID' shared; do
    pids=()
    for k in 1 2 3; do
      SLURM_ARRAY_TASK_ID=$k SLURM_ARRAY_TASK_COUNT=3 SLURM_PROCID=0 bash -c \
        "$canyon study study.yaml --out $folder --quiet --threads 1 --shard \$SLURM_ARRAY_TASK_ID/\$SLURM_ARRAY_TASK_COUNT" & pids+=($!)
    done
    for pid in "${pids[@]}"; do wait "$pid" || fail "a job of the array failed"; done
  done
  runs 0 "$canyon" study merge part1 part2 part3 --out joined --quiet
  runs 0 "$canyon" study study.yaml --out shared; says err "0 runs"
  for f in study.nc table.csv errors.png; do
    cmp whole/$f joined/$f && cmp whole/$f shared/$f || fail "other bytes of $f from an array"
  done
  runs 0 "$canyon" study study.yaml --out whole; says err "0 runs"
  # A disk that fills up in the middle: finished runs are kept, and the same command continues.
  sed 's/seeds: 3/seeds: 10/' study.yaml >many.yaml
  runs 0 "$canyon" study many.yaml --out many --quiet
  mkdir disk
  cat >full.sh <<'F'
mount -t tmpfs -o size=12k none disk || exit 77
"$1" study many.yaml --out disk/s --threads 1 --quiet; echo "status $?"
cat disk/s/runs/*.jsonl | wc -l
mount -o remount,size=1m disk
"$1" study many.yaml --out disk/s --threads 1 && cmp disk/s/study.nc many/study.nc && cmp disk/s/table.csv many/table.csv
F
  if unshare -rm true 2>/dev/null; then
    runs 0 unshare -rm bash full.sh "$canyon"
    says err "No space left on device; finished runs are kept: free disk space and run the same command again"
    says out "status 1"
    kept=$(sed -n '/^status/{n;p}' out)
    [ "$kept" -gt 0 ] && [ "$kept" -lt 20 ] || fail "$kept of 20 runs fitted on the disk"
    says err "$((20 - kept)) runs in"
  else
    echo "SKIPPED: a full disk (no namespaces of users here)"
  fi
  # Bad input.
  sed 's/seeds: 3/seeds: 4/' study.yaml >other.yaml
  runs 2 "$canyon" study other.yaml --out whole; one_line; says err "another study" "give another folder"
  runs 0 "$canyon" study other.yaml --out d --shard 1/2 --quiet
  runs 2 "$canyon" study merge a d --out e; one_line; says err "a shard of another study"
  runs 2 "$canyon" study merge . --out e; one_line; says err "contains no study"
  runs 2 "$canyon" study study.yaml; one_line; says err "--out is missing"
  runs 2 "$canyon" study study.yaml --out x --shard 3/2; one_line; says err "not a part of a study"
  runs 2 "$canyon" study study.yaml --print-run 6; one_line; says err "runs 0 to 5"
  sed 's/seeds: 3/seed: 3/' study.yaml >bad.yaml
  runs 2 "$canyon" study bad.yaml --dry-run; one_line; says err "bad.yaml:3"
  printf '%s\n' 'keep: epochs' >>bad.yaml; sed -i 's/seed: 3/seeds: 1000000/; s/values: .*/values: [5]}/' bad.yaml
  printf '%s\n' 'max_output_gb: 0.1' >>bad.yaml
  runs 2 "$canyon" study bad.yaml --dry-run; one_line; says err "would write about" "max_output_gb"
  # Runs that all fail are no result.
  sed '/^start/d' small.yaml >startless.yaml; sed 's/small/startless/' study.yaml >fails.yaml
  runs 2 "$canyon" study fails.yaml --out fails --quiet; one_line; says err "6 of 6 runs have no metrics" "'start' is missing" "add start:"
  [ ! -e fails/study.nc ] || fail "results of nothing" ;;
heatmap_query)
  runs 0 "$canyon" heatmap query --help; says out --at --path --format --speed --altitude --time --stretch --json
  runs 0 "$canyon" heatmap small.yaml --out map --enu-box=-70,-8,70,8 --spacing 2 --altitude 2,15 --times 0/600/300 \
    --layers horizontal_error_mean,availability,hdop --samples 16 --format netcdf --quiet
  runs 0 "$canyon" simulate small.yaml --out drive --quiet
  awk -F, 'NR > 1 {print $1 "," $2 "," $3 "," $4 "," $5}' drive/epochs.csv >truth.csv
  runs 0 "$canyon" heatmap query map/map.nc --path truth.csv --format urbannav
  says out "along the route" horizontal_error_mean "worst segment" "m of horizontal_error_mean in the mean" "a fix on" "120 m in 20 s" "receiver standing"
  # Positions without times, at a speed.
  { echo latitude,longitude; cut -d, -f3,4 truth.csv; } >places.csv; runs 0 "$canyon" heatmap query map/map.nc --path places.csv --speed 6; says out "120 m in 20 s"
  runs 2 "$canyon" heatmap query map/map.nc --path places.csv; one_line; says err 'has no times; give --speed'
  runs 0 "$canyon" heatmap query map/map.nc --path drive/receiver.nmea; says out "along the route" "in 20 s"  # by its content
  runs 0 "$canyon" heatmap query map/map.nc --path truth.csv --format urbannav --speed 2 --altitude 15 --stretch 20 --json
  python3 - <<'P' || fail "the route's JSON is not what was asked for"
import json
r = json.load(open("out"))
assert abs(r["length_m"] - 120) < 0.5 and abs(r["duration_s"] - 60) < 0.3, r["length_m"]
assert abs(len(r["stations"]) - 120) <= 1 and r["stations_outside"] == 0
known = [s for s in r["stations"] if s["state"] == "computed"]
e = [s["horizontal_error_mean"] for s in known if s["horizontal_error_mean"] is not None]
assert r["expected_error_layer"] == "horizontal_error_mean" and abs(sum(e) / len(e) - r["expected_error_m"]) < 1e-6
assert abs(sum(s["availability"] for s in known) / len(known) - r["availability"]) < 1e-9
assert abs(r["worst_stretch"]["to_m"] - r["worst_stretch"]["from_m"] - 20) < 1.1
P
  runs 0 "$canyon" heatmap query map/map.nc --at 22.3,114.17; says out hdop 2026-03-01T10:00:00Z "2 m above the terrain" computed
  runs 0 "$canyon" heatmap query map/map.nc --at 22.3,114.17 --altitude 19; says out "15 m above the terrain"
  says err warning: "no altitude of 19 m" "using the nearest, 15 m above the terrain"
  runs 0 "$canyon" heatmap query map/map.nc --path truth.csv --format urbannav --altitude 8
  says err warning: "no altitude of 8 m" "using the nearest, 2 m above the terrain"
  runs 0 "$canyon" heatmap query map/map.nc --at 22.3,114.17 --altitude 15; [ ! -s err ] || fail "15 m is an altitude of the map"
  runs 2 "$canyon" heatmap query map/map.nc --at 22.3,114.17 --altitude 60; one_line; says err --altitude 60 "15 m above"
  runs 2 "$canyon" heatmap query map/map.nc; one_line; says err --at --path
  runs 2 "$canyon" heatmap query map/map.nc --at 22.3; one_line; says err LATITUDE,LONGITUDE
  runs 2 "$canyon" heatmap query map/map.nc --at 48,11; one_line; says err --at outside
  runs 2 "$canyon" heatmap query map/map.nc --at 22.3,114.17 --time 2026-04-01T10:00:00Z; one_line; says err --time 2026-04-01
  runs 2 "$canyon" heatmap query map/map.nc --path truth.csv --format igc; one_line; says err igc urbannav
  runs 2 "$canyon" heatmap query map/map.nc --path truth.csv --format urbannav --speed 0; one_line; says err --speed
  runs 2 "$canyon" heatmap query map/map.nc --path truth.csv --format urbannav --time 2027-01-01T00:00:00Z
  one_line; says err truth.csv outside
  runs 2 "$canyon" heatmap query absent.nc --at 22.3,114.17; one_line; says err absent.nc
  runs 2 "$canyon" heatmap query small.yaml --at 22.3,114.17; one_line; says err small.yaml
  head -c 3000 map/map.nc >cut.nc
  runs 2 "$canyon" heatmap query cut.nc --at 22.3,114.17; one_line; says err cut.nc ;;
heatmap_bad)
  bad() { runs 2 "$canyon" heatmap small.yaml --out res "$@"; one_line; }
  runs 2 "$canyon" heatmap; one_line; says err SCENARIO
  runs 2 "$canyon" heatmap small.yaml; one_line; says err --out
  bad --layers hdpo; says err --layers hdpo "mean 'hdop'"
  bad --format tiff; says err --format geotiff
  bad --bbox 114.2,22.3,114.1,22.4; says err --bbox reversed
  bad --bbox 11,48,11.1,48.1; says err --bbox outside "the city extends"
  bad --bbox 1,2,3; says err --bbox WEST
  bad --enu-box 0,0,-5,5; says err --enu-box reversed
  bad --enu-box 0,0,5; says err --enu-box WEST
  bad --enu-box=-20000,-9,9,9; says err --enu-box beyond
  bad --area absent.geojson; says err absent.geojson
  bad --spacing 0; says err spacing
  bad --spacing 0.011 --layers all --times day/1min; says err values --large
  bad --altitude=-3; says err --altitude terrain
  bad --altitude=-300 --altitude-kind ellipsoid; says err --altitude "lowest point"
  bad --altitude high; says err --altitude high
  bad --altitude-kind sea; says err sea ellipsoid
  runs 0 "$canyon" heatmap small.yaml --out zone --enu-box=-9,-9,9,9 --times 2026-03-01T10:00:00,2026-03-01T10:05:00Z --format netcdf
  says err "2026-03-01T10:00:00 has no time zone"; [ "$(grep -c 'has no time zone' err)" -eq 1 ] || fail "Z is a zone"
  bad --times soon; says err soon
  bad --times 0/60; says err --times day/
  bad --times 60/0/10; says err --times before
  bad --times 0/60/fast; says err --times fast
  bad --times day/0.1; says err --times 861640 "longer step"
  bad --model miror; says err --model miror "'mirror'"
  bad --receiver nobody; says err nobody rover
  bad --samples 0; says err draws
  bad --tile 5000; says err --tile
  runs 2 "$canyon" heatmap small.yaml --out res --bbox 1,2,3,4 --enu-box 1,2,3,4
  runs 0 "$canyon" simulate small.yaml --out good --quiet
  sed 's/^sky.*/sky: {navigation: [good\/sky.nav]}/' small.yaml >files.yaml
  runs 2 "$canyon" heatmap files.yaml --out res --times 2026-03-09T10:00:00Z; one_line; says err 2026-03-09
  runs 2 "$canyon" heatmap files.yaml --out res --times 2026-03-01T10:00:00Z,2026-03-09T10:00:00Z --enu-box 0,0,9,9
  one_line; says err --times 2026-03-09
  sed '/^start/d' small.yaml >nostart.yaml
  runs 2 "$canyon" heatmap nostart.yaml --out res; one_line; says err start
  : >file
  runs 2 "$canyon" heatmap small.yaml --out file; one_line; says err file
  ls res/map* res/*.tif 2>/dev/null && fail "bad input left results"
  # A full disk (here: a limit on the size of files): one clear error, finished tiles intact.
  full=(heatmap small.yaml --out full --enu-box=-110,-110,110,110 --spacing 1 --tile 32 --format netcdf --keep-tiles --quiet --threads 1)
  runs 1 bash -c 'trap "" XFSZ; ulimit -f 12; exec "$0" "$@"' "$canyon" "${full[@]}"
  one_line; says err full/tiles/unit- "cannot be written"
  ls -A full/tiles | grep part && fail "temporary files left"
  # The same if the tiles fit, but the map does not.
  runs 1 bash -c 'trap "" XFSZ; ulimit -f 24; exec "$0" "$@"' "$canyon" "${full[@]}"
  one_line; says err full/map.nc "cannot be written"
  [ ! -e full/map.nc ] && [ -e full/tiles/unit-000000048.tile ] || fail "full holds $(ls full full/tiles)"
  runs 0 "$canyon" "${full[@]}"
  runs 0 "$canyon" heatmap small.yaml --out whole --enu-box=-110,-110,110,110 --spacing 1 --tile 32 --format netcdf --quiet
  cmp full/map.nc whole/map.nc || fail "other bytes after a full disk" ;;
heatmap_resume)
  # Long enough to be ended in the middle: hundreds of tiles.
  map=(heatmap small.yaml --enu-box=-110,-110,110,110 --spacing 0.5 --tile 16 --format netcdf,png --layers horizontal_error_p95,hdop --samples 32)
  runs 0 "$canyon" "${map[@]}" --out whole --threads 1 --quiet
  # started OUT: a run in the background with some finished tiles; its process is $program.
  started() {
    "$canyon" "${map[@]}" --out "$1" --threads 1 >out 2>err &
    program=$!
    for _ in $(seq 3000); do
      [ "$(ls "$1/tiles" 2>/dev/null | grep -c '\.tile$')" -ge "$2" ] && break
      kill -0 "$program" 2>/dev/null || break
      sleep 0.01
    done
  }
  tiles() { ls "$1/tiles" | grep -c '\.tile$'; }
  started killed 5; kill -KILL "$program"; wait "$program" 2>/dev/null
  [ ! -e killed/map.nc ] || fail "the run was over before it was killed"
  n=$(tiles killed); [ "$n" -ge 5 ] || fail "$n tiles"
  runs 0 "$canyon" "${map[@]}" --out killed; says err "resumed     $n of "
  diff -rq whole killed || fail "other bytes after kill -9"
  # Ctrl-C: reports what is kept, and how to continue.
  started stopped 5
  "$canyon" "${map[@]}" --out stopped >out2 2>err2; status=$?
  [ "$status" -eq 2 ] || fail "exit status $status of a second run"
  says err2 "stopped: another run uses this folder (process $program)"
  "$canyon" simulate small.yaml --out stopped --duration 1 >out2 2>err2; status=$?
  [ "$status" -eq 2 ] || fail "exit status $status of a run beside a map"
  kill -INT "$program"; wait "$program"; status=$?
  [ "$status" -eq 130 ] || { fail "exit status $status instead of 130"; cat err; }
  says err interrupted "the same command continues from there"
  n=$(tiles stopped)
  [ "$(sed -n 's/.*interrupted: \([0-9]*\) of .*/\1/p' err)" -eq "$n" ] || fail "said something else than $n tiles"
  ls -A stopped/tiles | grep part && fail "temporary files left"
  runs 0 "$canyon" "${map[@]}" --out stopped --threads 2
  diff -rq whole stopped || fail "other bytes after Ctrl-C"
  # Deleted tiles are computed again.
  runs 0 "$canyon" "${map[@]}" --out kept --keep-tiles --quiet
  rm kept/tiles/unit-000000003.tile kept/map.nc
  runs 0 "$canyon" "${map[@]}" --out kept; diff -rq whole kept || fail "other bytes after a lost tile" ;;
heatmap_planning)
  # P(error > X) with X the map's own 95 % is 5 % for many samples.
  box=(heatmap small.yaml --enu-box=-40,-8,40,8 --spacing 8 --altitude 40 --format netcdf)
  runs 0 "$canyon" "${box[@]}" --out p --samples 200 --error-limit 2.5 --alert-limit 30 --layers \
    horizontal_error_p95,horizontal_error_exceedance,protection_level,protected_availability,misleading_share
  says out horizontal_error_exceedance misleading_share
  runs 0 "$canyon" heatmap query p/map.nc --at 22.3,114.17 --json
  python3 - <<'P' || fail "the limits' layers contradict each other"
import json
v = json.load(open("out"))["values"]
assert 0 <= v["horizontal_error_exceedance"] <= 1 and v["protected_availability"] == (v["protection_level"] <= 30)
assert (v["horizontal_error_p95"] > 2.5) == (v["horizontal_error_exceedance"] > 0.05)
assert v["misleading_share"] == 0 or v["protection_level"] < 10
P
  if command -v ncdump >/dev/null; then
    ncdump -h p/map.nc >out; says out 'horizontal_error_exceedance:comment = "more than 2.5 m, of the draws with a fix"' DO-229D
    says out '--error-limit 2.5' '--alert-limit 30'
  fi
  runs 2 "$canyon" heatmap small.yaml --out bad --error-limit 0; one_line; says err error_m
  runs 2 "$canyon" heatmap small.yaml --out bad --motion driving; one_line; says err "no position filter" "--motion standing"
  # Runs: the mean over resampled cities, and their 95 %; the same bytes on any number of threads.
  sed '/^city/d' small.yaml >runs.yaml
  echo 'city: {synthetic: {blocks_east: 3, blocks_north: 3, seed: 2}, georeference: {sigma_m: 3}}' >>runs.yaml
  many=(heatmap runs.yaml --enu-box=-40,-8,40,8 --spacing 4 --tile 16 --altitude 2 --format netcdf,png
    --layers satellites_los,horizontal_error)
  runs 0 "$canyon" "${many[@]}" --runs 3 --out r --threads 1; says out "mean of 3 runs" "95 % of 3 runs"
  for f in map.nc map.png p95/map.nc p95/map.png; do [ -s r/$f ] || fail "no r/$f"; done
  [ ! -e r/tiles ] || fail "the tiles were left"
  runs 2 "$canyon" "${many[@]}" --runs 0x3 --out r3; says err "'0x3' is not a whole number in decimal digits"
  runs 0 "$canyon" "${many[@]}" --runs 03 --out r2 --threads 08 --quiet; diff -r r r2 || fail "other bytes on another number of threads"
  for seed in 1 2 3; do
    runs 0 "$canyon" "${many[@]}" --seed $seed --out one$seed --quiet
    runs 0 "$canyon" heatmap query one$seed/map.nc --at 22.3,114.17006 --json; cp out one$seed.json
  done
  runs 0 "$canyon" heatmap query r/map.nc --at 22.3,114.17006 --json; cp out mean.json
  runs 0 "$canyon" heatmap query r/p95/map.nc --at 22.3,114.17006 --json; cp out p95.json
  python3 - <<'P' || fail "the runs' map is not the mean of the runs"
import json
one = [json.load(open(f"one{s}.json"))["values"]["satellites_los"] for s in (1, 2, 3)]
mean, p95 = (json.load(open(f))["values"]["satellites_los"] for f in ("mean.json", "p95.json"))
assert abs(sum(one) / 3 - mean) < 1e-5, (one, mean)
assert p95 == min(one), (one, p95)  # of three runs this is the worst
P
  runs 2 "$canyon" "${many[@]}" --runs 0 --out bad; one_line; says err --runs
  # Samples of unknowns: their median and the bounds of intervals, in order in every cell.
  runs 0 "$canyon" "${many[@]}" --unknowns 4 --out u --threads 1
  says out "median of 4 draws of unknowns" "95 % of 4 draws of unknowns"; says err "unknown     facades: coated"
  for p in p05 p25 . p75 p95; do
    runs 0 "$canyon" heatmap query u/$p/map.nc --at 22.3,114.17006 --json; cp out u/$p/at.json
  done
  python3 - <<'P' || fail "bounds of draws are not in order, or all alike"
import json
at = [json.load(open(f"u/{p}/at.json"))["values"]["horizontal_error"] for p in ("p05", "p25", ".", "p75", "p95")]
assert at == sorted(at) and at[0] < at[-1], at
P
  runs 0 "$canyon" "${many[@]}" --unknowns 4 --fixed-unknowns facades --out k --quiet
  cmp -s u/map.nc k/map.nc && fail "--fixed-unknowns changes nothing"
  runs 2 "$canyon" "${many[@]}" --unknowns 1 --out bad; says err --unknowns
  runs 2 "$canyon" "${many[@]}" --unknowns 4 --fixed-unknowns roofs --out bad; one_line; says err --fixed-unknowns facades
  runs 2 "$canyon" "${many[@]}" --unknowns 4 --runs 4 --out bad; says err --runs --unknowns ;;
bench)
  runs 0 "$canyon" bench list
  says out 'outlier-100' 'a downtown of towers'
  # Same version, same bytes, on any number of threads.
  runs 0 "$canyon" bench make one --only open drift --threads 1 --quiet
  runs 0 "$canyon" bench make two --only open drift --threads 2 --quiet
  for file in truth fixes single imu wheels events; do cmp one/drift/$file.csv two/drift/$file.csv || fail "$file.csv depends on threads"; done
  says one/drift/events.csv 'drift,'
  says one/drift/card.yaml 'bench: 2' 'receiver: ublox-m10' 'without_fault: low'
  for file in one/drift/receiver.obs one/drift/sky.nav one/drift/scenario.yaml; do [ -s "$file" ] || fail "no $file"; done
  # A program that passes fixes on follows the drift, and exceeds a limit.
  cut -d, -f1,3,4 one/drift/fixes.csv | awk -F, '$2 != ""' >one/passed.csv
  printf '%s\n' 'limits: [{drives: [drift], followed: 0.5}, {drives: [open], p95_m: 5}]' >limits.yaml
  pass=(sh -c 'cut -d, -f1,3,4 "$1"/fixes.csv | awk -F, "\$2 != \"\"" >"$2"' sh '{drive}' '{estimate}')
  runs 1 "$canyon" bench run one --limits limits.yaml --json s.json --junit s.xml -- "${pass[@]}"
  says err "drift, mine: followed of 'drift' is 1, limit 0.5" 'scores fail'
  says out 'diverged s' '< 5 m %' 'mine'
  says s.xml 'tests=' 'failures="1"'
  python3 -c 'import json; r = json.load(open("s.json"))["results"]; m = [x for x in r if x["estimate"] == "mine" and x["drive"] == "drift"][0]; assert abs(m["events"][0]["followed"] - 1) < 0.01 and m["availability"] > 0.99 and m["within_10m"] < 1, m' ||
    fail "s.json"
  # Raw data do not contain a fault of the reported fix, so its limit does not apply to their users.
  runs 0 "$canyon" bench score one --limits limits.yaml --estimate 'raw=one/estimates/mine/{drive}.csv' --reads raw=raw,imu --quiet
  runs 2 "$canyon" bench score one --estimate m=x --reads rav; says err "there is no input 'rav'; did you mean 'raw'?"; one_line
  # Standard output has only JSON: the program's own output goes to standard error.
  runs 0 "$canyon" bench run one --json - -- sh -c 'echo talks; cp "$1"/single.csv "$2"' sh '{drive}' '{estimate}'
  python3 -m json.tool out >/dev/null || fail "--json - is not JSON"; says err talks
  says one/score.html '<img width=' 'drift'
  # An absent, empty or damaged estimate fails; the others are still scored.
  runs 1 "$canyon" bench score one --estimate none=nowhere/{drive}.csv --quiet
  says err 'drift, none: there is no nowhere/drift.csv'
  runs 1 "$canyon" bench run one --junit s.xml -- sh -c 'case $1 in *open) echo time_s,latitude_deg,longitude_deg;; *) cat "$1"/single.csv;; esac >"$2"' sh '{drive}' '{estimate}'
  says err 'open, mine: one/estimates/mine/open.csv: has no rows'; says out 'drift  mine'; says s.xml 'failures="1"'
  for how in 'kill -ABRT $$' 'exit 3' ': >/dev/null' 'mkdir "$2"' 'sleep 100'; do
    runs 1 "$canyon" bench run one --timeout 0.5 --name gone --junit s.xml --quiet -- sh -c "$how" sh '{drive}' '{estimate}'
    says err 'open, gone: '; says s.xml 'failures="2"'
  done
  says err 'took more than 0.5 s'
  runs 1 "$canyon" bench run one --name gone --quiet -- sh -c 'read answer || exit 4' sh '{drive}' '{estimate}'; says err 'ended with status 4'
  mkdir one/cut && cp one/open/card.yaml one/cut
  runs 1 "$canyon" bench score one; says err 'cut is not scored: '; says out 'drift'; rm -r one/cut
  # Names are names of files, and not those of the baselines.
  for name in a=b fixes '' ../../zz 'a b'; do runs 2 "$canyon" bench run one --name "$name" -- "${pass[@]}"; one_line; done
  runs 2 "$canyon" bench score one --estimate a=x --estimate a=y; says err "two estimates are named 'a'"; one_line
  runs 2 "$canyon" bench run nosuch -- "${pass[@]}"; [ ! -e nosuch ] || fail "bench run makes a folder"
  cp -r one 'b{estimate}'; runs 1 "$canyon" bench run 'b{estimate}' --limits limits.yaml -- "${pass[@]}"; says out 'drift  mine'
  runs 0 "$canyon" view one/drift --track passed=one/passed.csv --out seen --quiet
  python3 - <<'END' || fail "the estimate is not in the view"
import json
r = json.load(open("seen/view.json"))["receivers"]
assert [x["name"] for x in r] == ["rover", "passed"], r
assert r[1]["summary"] == r[0]["summary"] or abs(r[1]["summary"]["horizontal_p95_m"] - r[0]["summary"]["horizontal_p95_m"]) < 0.01, r
END
  runs 2 "$canyon" view one/drift --track passed --out seen2; says err "--track 'passed' has no name"; one_line
  runs 2 "$canyon" view one --track passed=one/passed.csv --out seen2; says err 'one is not a drive of a bench'
  # The spoofer pulls the fix away by the 200 m of its description; edition 1 is unchanged.
  for edition in 1 2; do
    runs 0 "$canyon" bench make pulled --only spoofing --edition $edition --quiet
    runs 0 "$canyon" bench score pulled --json s.json --quiet
    python3 -c 'import json, sys; m = next(x for x in json.load(open("s.json"))["results"] if x["estimate"] == "fixes")["largest_m"]; sys.exit(not (195 < m < 210 if sys.argv[1] == "2" else m < 60))' $edition || fail "spoofing of edition $edition"
  done
  # The user's map and track; times of the track are its own.
  cp "$root/tests/data/formats/house.osm.pbf" map.osm.pbf
  runs 0 "$canyon" new map.osm.pbf -o drive.yaml
  runs 0 "$canyon" simulate drive.yaml -o track --quiet
  runs 0 "$canyon" profiles ublox-m8t; cp out my.yaml
  runs 0 "$canyon" bench make mapped --only open outlier-100 imu-frozen --map map.osm.pbf --receiver "$PWD/my.yaml" ublox-f9p --quiet
  says err 'outlier-100-my is left out: its fault begins at 100 s'
  ! grep -q ' put' err || fail "the base is not where it reports"
  says mapped/open-my/scenario.yaml 'start: 2026-06-01'; [ -d mapped/open-ublox-f9p/base ] || fail "no base"
  runs 0 "$canyon" bench make tracked --only open --map map.osm.pbf track/epochs.csv --quiet
  for folder in mapped/open-my tracked/open; do [ "$(wc -l <$folder/truth.csv)" -gt 50 ] || fail "no drive in $folder"; done
  runs 2 "$canyon" bench make mapped --only outlier-100 --map map.osm.pbf --quiet; says err 'no drive can be made from this track'
  # A bench has the drives of one call: files of another call are removed, the user's files are kept.
  mkdir -p again && "$canyon" bench make again --only open walk --edition 1 --quiet 2>err || fail "edition 1"
  says again/open/card.yaml 'bench: 1'; echo mine >again/open/mine.csv; cp again/open/single.csv again/open/ekf.csv; cp again/open/single.csv again/open/robust.csv
  runs 0 "$canyon" bench make again --only walk --receiver ublox-f9p --quiet
  [ ! -e again/open/card.yaml ] && [ ! -e again/walk/receiver.obs ] && [ -e again/open/mine.csv ] || fail "a drive of another call is there"
  runs 0 "$canyon" bench score again; says out walk; ! grep -q open out || fail "a drive of another call is scored"
  # An interrupted drive is not kept.
  "$canyon" bench make ended --only open high --quiet 2>err & pid=$!
  until [ -e ended/high ] || ! kill -0 $pid; do sleep 0.05; done
  kill -TERM $pid; status=0; wait $pid || status=$?
  [ $status -eq 130 ] && [ ! -e ended/high/card.yaml ] && [ -e ended/open/card.yaml ] || fail "status $status, or half a drive"
  says err 'interrupted: 1 of 2 drives are in ended'
  # The same for a stopped program.
  "$canyon" bench run one --quiet -- sh -c 'sleep 300 & echo $! >sleeper; wait' sh '{drive}' '{estimate}' 2>err & pid=$!
  until [ -s sleeper ] || ! kill -0 $pid; do sleep 0.05; done
  kill -TERM $pid; status=0; wait $pid || status=$?
  [ $status -eq 130 ] && ! grep -qs '^State:.[RSD]' "/proc/$(cat sleeper)/status" || fail "status $status, or the program goes on"
  runs 2 "$canyon" bench make three --only outlyer-100
  says err "there is no drive 'outlyer-100'; did you mean 'outlier-100'?"; one_line
  runs 2 "$canyon" bench score . ; says err 'has no drives; make them: canyon bench make'
  runs 2 "$canyon" bench run one; says err 'there is no program to run'
  runs 2 "$canyon" bench run one -- true '{drive}'; says err "the program's arguments lack {estimate}"; one_line
  runs 2 "$canyon" bench run one -- ./absent.py '{drive}' '{estimate}'; says err './absent.py: No such file'
  echo 'limits: [{drives: [open/], p95_m: 1}]' >other.yaml
  runs 2 "$canyon" bench score one --limits other.yaml; says err "other.yaml: there is no drive 'open/' in the bench"; one_line
  printf 'time_s,latitude_deg,longitude_deg\n1,0.84,0.2\n' >bad.csv
  runs 1 "$canyon" bench score one --estimate bad=bad.csv; says err 'bad.csv:2: the position is' 'give degrees' ;;

study_ranks)
  sed -i '$a receivers: [{name: car}]\nduration_s: 2' small.yaml
  printf '%s\n' 'scenario: small.yaml' 'axes: [{seeds: 40}]' >study.yaml
  study=(study study.yaml --threads 1 --no-pictures)
  needs_ranks "$canyon" "${study[@]}" --out none --quiet
  runs 0 "$canyon" "${study[@]}" --out one --quiet
  for n in 2 4; do
    runs 0 "${ranks[@]}" $n "$canyon" "${study[@]}" --out on$n; says err "40 runs in"
    for f in study.nc table.csv; do cmp one/$f on$n/$f || fail "other bytes of $f on $n ranks"; done
    [ "$(cat on$n/runs/*.jsonl | wc -l)" -eq 40 ] || fail "runs were computed twice on $n ranks"
  done
  runs 2 "${ranks[@]}" 2 bash -c '"$0" "$@" --shard $((OMPI_COMM_WORLD_RANK + 1))/2' "$canyon" "${study[@]}" --out shards
  says err "the ranks of a job have different --shard"
  # Runs finished before the loss of a rank are kept; the next run computes the rest.
  finished() { cat lost/runs/*.jsonl 2>/dev/null | wc -l; }
  lose_a_rank 5 finished "$canyon" "${study[@]}" --out lost
  [ ! -e lost/study.nc ] || fail "the study was over before a rank was lost"
  n=$(finished); [ "$n" -ge 5 ] || fail "$n runs are kept"
  runs 0 "${ranks[@]}" 4 "$canyon" "${study[@]}" --out lost; says err "$((40 - n)) runs in"
  for f in study.nc table.csv; do cmp one/$f lost/$f || fail "other bytes of $f after a lost rank"; done ;;
heatmap_ranks)
  map=(heatmap small.yaml --spacing 2 --tile 16 --format netcdf,geotiff --threads 1 --quiet)
  needs_ranks "$canyon" "${map[@]}" --out none
  runs 0 "$canyon" "${map[@]}" --out one
  for n in 2 4; do
    runs 0 "${ranks[@]}" $n "$canyon" "${map[@]}" --out on$n
    [ ! -s out ] || { fail "--quiet printed something"; cat out; }
    diff -rq one on$n || fail "other bytes on $n ranks"
  done
  # A rank that is lost ends the others; its tiles are computed by the next run, on any number of ranks.
  map=(heatmap small.yaml --enu-box=-110,-110,110,110 --spacing 0.5 --tile 16 --format netcdf --layers horizontal_error_p95 --samples 32 --threads 1)
  runs 0 "$canyon" "${map[@]}" --out whole --quiet
  tiles() { ls lost/tiles 2>/dev/null | grep -c '\.tile$'; }
  lose_a_rank 5 tiles "$canyon" "${map[@]}" --out lost
  [ ! -e lost/map.nc ] || fail "the run was over before a rank was lost"
  n=$(tiles)
  runs 0 "$canyon" "${map[@]}" --out lost; says err "resumed     $n of "
  diff -rq whole lost || fail "other bytes after a lost rank"
  # Bad input ends all of them, with one cause.
  runs 2 "${ranks[@]}" 2 "$canyon" heatmap small.yaml --out bad --layers hdpo; says err "canyon: --layers" "mean 'hdop'" ;;
view)
  # The page is tested in viewer/test/; here a placeholder gets the data.
  echo '<html><body><!--canyon:data--></body></html>' >page.html; export CANYON_VIEWER=$PWD/page.html
  runs 0 "$canyon" view small.yaml --export scene.html --out v --duration 5; says err "MB, opens from disk"
  says scene.html 'id="canyon-view"' 'data-canyon-file="city.glb.gz"' 'data-canyon-file="block-0-00000.bin.gz"' 'data-canyon-file="track-0.bin.gz"'
  grep -q 'canyon:data' scene.html && fail "the place of the data is still there"
  gzip -t v/*.gz || fail "not gzip"
  [ "$(gzip -dc v/track-0.bin.gz | head -c 8)" = canyonV1 ] || fail "no chunk"
  # The same again from the folder, and from a run that wrote it next to its files.
  runs 0 "$canyon" view v --export again.html --quiet; cmp scene.html again.html || fail "other bytes from the folder"
  runs 0 "$canyon" simulate small.yaml --out res --duration 5 --view --quiet
  diff -rq -x .canyon-results v res/view || fail "simulate --view writes something else"
  block_osm >block.osm
  runs 0 "$canyon" view block.osm --out c --quiet; says c/view.json '"height_source":"height"' '"height_source":"default"' '"time":null'
  schema_holds v/view.json; schema_holds c/view.json
  # A heat map alone, in its city, over a run and over a finished one.
  runs 0 "$canyon" heatmap small.yaml --out map --enu-box -20,-20,20,20 --spacing 4 --altitude 2,10 --layers hdop,sky_view --model specular --quiet --format netcdf
  runs 0 "$canyon" view map/map.nc --out m1 --quiet; says m1/view.json '"name":"no city"' '"rows":10' '"map-values"'
  runs 0 "$canyon" view map/map.nc --city small.yaml --export map.html --out m2 --quiet
  says map.html 'data-canyon-file="map-1.bin.gz"' 'data-canyon-file="map-1-0.bin.gz"'
  runs 0 "$canyon" view small.yaml --map map/map.nc --duration 5 --out m3 --quiet
  runs 0 "$canyon" view v --map map/map.nc --city small.yaml --out m4 --quiet; diff -rq m3 m4 || fail "another map over the finished run"
  cmp m2/map-0-0.bin.gz m3/map-0-0.bin.gz || fail "other values in another view"
  schema_holds m1/view.json; schema_holds m3/view.json
  runs 2 "$canyon" view v --map map/map.nc --out m5; one_line; says err "--city"
  runs 2 "$canyon" view map/map.nc --city block.osm --out m5; one_line; says err "coordinates are not those of the city"
  runs 2 "$canyon" view small.yaml --city small.yaml --out m5; one_line; says err "--city without a heat map"
  runs 2 "$canyon" view map/map.nc --map map/map.nc --out m5; one_line; says err "--map with a map as input"

  # Films: missing programs are reported before any work.
  runs 2 "$canyon" view v --record film.jpg; one_line; says err "'.jpg' is not the ending of a film"
  runs 2 "$canyon" view v --record film.webp --record-size 801x600; one_line; says err --record-size
  runs 2 "$canyon" view v --record film.mp4; one_line; says err ffmpeg
  runs 2 env PATH=/none "$canyon" view v --record film.webp; one_line; says err Node.js
  runs 2 "$canyon" view v --export x.html --record-fps 5; says err "--record-fps requires --record"
  runs 2 "$canyon" view v --export x.html --open; one_line; says err "--open and --port serve a view"
  # A truncated view is detected before it is shown.
  cp -r v cut; truncate -s -1 cut/track-0.bin.gz; runs 2 "$canyon" view cut; one_line; says err "cut/track-0.bin.gz: is truncated or damaged"
  runs 2 "$canyon" view cut --export x.html; one_line; [ ! -e x.html ] || fail "a page of a damaged view"
  rm cut/track-0.bin.gz; runs 2 "$canyon" view cut; one_line; says err "cut/track-0.bin.gz: is missing"
  truncate -s 500 cut/view.json; runs 2 "$canyon" view cut; one_line; says err "view.json: is not a Canyon view, or is damaged"
  mkdir empty; runs 2 "$canyon" view empty; one_line; says err "empty: is a folder without a view"
  rm -r res/view; runs 2 "$canyon" view res; one_line; says err "res: is a folder without a view" --view
  runs 2 "$canyon" view small.yaml --live tcp://127.0.0.1:1 --out x; one_line; says err "--live serves a view"
  runs 2 "$canyon" view small.yaml --live nowhere; one_line; says err nowhere
  # A host provides the motion: only the scenario's city is needed.
  printf 'city: {synthetic: {seed: 3}}\nsky: {nominal: true}\nreceivers: [{name: rover}]\n' >moved.yaml
  runs 2 "$canyon" view moved.yaml --live nowhere; one_line; says err nowhere
  "$canyon" view v --quiet >address & served=$!
  until [ -s address ]; do kill -0 "$served" || fail "canyon view ended"; sleep 0.1; done
  python3 -c 'import sys, urllib.request; sys.stdout.buffer.write(urllib.request.urlopen(sys.argv[1]).read())' "$(cat address)view/view.json" |
    cmp - v/view.json || fail "serves another header"
  kill "$served"; wait "$served" || fail "canyon view did not end by itself"
  # Antennas in a finished run are put by its own scenario.
  sed 's/seed: [0-9]*/seed: 5/' small.yaml >other.yaml; cmp -s small.yaml other.yaml && fail "the same scenario"
  runs 2 "$canyon" view v --city other.yaml; one_line; says err "v: is of a run with other walls than the scenario's"
  runs 2 "$canyon" view v --city block.osm; one_line; says err "--city without a heat map or a finished run"
  runs 2 "$canyon" view nothing.yaml --export x.html; one_line
  echo hello >page.html; runs 2 "$canyon" view v --export x.html; one_line; says err "is not Canyon's viewer page"
  export CANYON_VIEWER=none.html; runs 2 "$canyon" view v --export x.html; one_line; [ ! -e x.html ] || fail "half a page" ;;
*) echo "no case '$case'"; exit 2 ;;
esac
exit "$failed"
