#!/usr/bin/env bash
# The files of a reader of the pages, with the names used in pages: maps, recordings, paths. Started by tests/pages.py.
# usage: tests/pages_files.sh CANYON FOLDER
set -euo pipefail
canyon=$1 root=$(cd "$(dirname "$0")/.." && pwd)
cd "$2"
cp -rL "$root/examples" .
ln -s "$root"/{adapters,packaging,profiles,tests} .
cases=tests/data/cases

# A map of one house, and a drive next to it: the satellites of the day, observations, the truth and a track.
cp tests/data/formats/house.osm.pbf map.osm.pbf
cp $cases/osm-roof-angle/roof.osm map.osm
cp map.osm kowloon.osm
cp map.osm nishishinjuku.osm
gzip -c map.osm >moscow.osm.gz
cat >drive.yaml <<'END'
city: {osm: map.osm.pbf}
sky: {nominal: true}
start: 2026-06-01T08:00:00Z
trajectory: {waypoints: [{east_m: -80, north_m: -20}, {east_m: 80, north_m: -20}], speed_mps: 8, height_above_terrain_m: 1.5}
receivers: [{name: car}]
outputs: {rinex_navigation: true, rinex_observation: true, gpx: true}
END
"$canyon" simulate drive.yaml --out first --quiet
mv first/sky.nav day.rnx
mv first/receiver.obs drive.obs
mv first/epochs.csv truth.csv
mv first/track.gpx track.gpx
rm -r first
for name in first scenario city synthetic_drive; do cp examples/synthetic_drive.yaml $name.yaml; done
printf '%s\n' recordings: '  - {name: house, class: mass market, scenario: drive.yaml, obs: drive.obs, truth: truth.csv}' >recordings.yaml
"$canyon" profiles ublox-m10 >mine.yaml

# City models: a house of CityGML, one of COLLADA, and a tile of it at 13.4 E, 52.5 N.
cp $cases/world-parts-missing/adv.gml 53392642_bldg_6697_op2.gml
mkdir LoD2_33_tiles hongkong urbannav-tst-20190428
cp $cases/world-parts-missing/adv.gml LoD2_33_tiles/LoD2_33_390_5820.gml
sed -e 's|</geometry>|&<geometry id="t"><mesh><source id="tp"><float_array id="ta" count="12">-90 -90 0 90 -90 0 90 90 0 -90 90 0</float_array><technique_common><accessor source="#ta" count="4" stride="3"><param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source><vertices id="tv"><input semantic="POSITION" source="#tp"/></vertices><polylist count="1"><input semantic="VERTEX" source="#tv" offset="0"/><vcount>4</vcount><p>0 1 2 3</p></polylist></mesh></geometry>|' \
  -e 's|<instance_geometry|<translate>0 12 0</translate>&|; s|</node>|&<node id="terrain" name="terrain"><instance_geometry url="#t"/></node>|' \
  $cases/mesh-concave-face/face6.dae >hongkong/buildings.dae
"$canyon" city build city.yaml -o city.canyon --quiet
"$canyon" city build drive.yaml -o tile.glb --quiet
cat >tileset.json <<'END'
{"asset": {"version": "1.0"}, "geometricError": 10, "root": {"geometricError": 0, "refine": "REPLACE",
 "transform": [-0.231747948, 0.972775717, 0, 0, -0.771756, -0.183857, 0.608761, 0, 0.592188, 0.141079, 0.793353, 0, 3784977.4, 901712.4, 5036806.6, 1],
 "boundingVolume": {"sphere": [0, 0, 10, 200]}, "content": {"uri": "tile.glb"}}}
END

# A map of errors, and a route over it.
"$canyon" heatmap examples/synthetic_drive.yaml --out . --spacing 16 --model specular --layers horizontal_error,hdop --quiet
awk 'BEGIN {print "time,latitude,longitude,height"; for (i = 0; i < 60; ++i)
  printf "2026-06-01T08:00:%02dZ,%.7f,114.1700000,%d\n", i, 22.298 + i * 5e-5, 30}' >route.csv

# Paths in formats of other programs, around the middle of the synthetic city.
awk 'BEGIN {OFS = ","; print "stamp [ms],N [rad],E [rad],alt_m" >"motion.csv"; print "timestamp,lat,lon,alt_ellipsoid" >"flight_vehicle_global_position_0.csv"
  for (i = 0; i < 20; ++i) {
    phi = 22.3 * atan2(0, -1) / 180; lambda = (114.169 + i * 7e-5) * atan2(0, -1) / 180; n = 6378137 / sqrt(1 - 0.00669437999 * sin(phi) ^ 2) + 2
    printf "%d,%.10f,%.10f,2\n", i * 1000, phi, lambda >"motion.csv"
    printf "%d,%.9f,%.9f,2\n", i * 1000000, 22.3, 114.169 + i * 7e-5 >"flight_vehicle_global_position_0.csv"
    printf "%.1f,%.3f,%.3f,%.3f\n", i, n * cos(phi) * cos(lambda), n * cos(phi) * sin(lambda), n * 0.99330562 * sin(phi) >"circle.csv"}}'

# A day of the drive of UrbanNav: satellites, and the reference path.
sed 's/start:.*/start: 2019-04-28T12:58:00Z/; s/nominal: true/nominal: true, systems: [GPS, BeiDou]/' drive.yaml >tst.yaml
"$canyon" simulate tst.yaml --out tst --quiet
cp tst/sky.nav urbannav-tst-20190428/hksc1180.19n
cp tst/sky.nav urbannav-tst-20190428/hksc1180.19b
awk 'BEGIN {for (i = 0; i < 20; ++i) printf "2051,%d,22.2981000,%.8f,6\n", 46701 + i, 114.179 + i * 1e-5}' >urbannav-tst-20190428/groundTruth_TST.csv
rm -r tst tst.yaml
