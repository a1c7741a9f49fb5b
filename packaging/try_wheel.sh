#!/usr/bin/env bash
# Installs a bundled wheel in a root of a Debian release that has nothing but Python and NumPy, and runs the demo, a scenario, a
# heat map and Python's first page in it, with times. Where the wheel is of another Python, the command alone. As root.
# usage: packaging/try_wheel.sh WHEEL RELEASE ROOT     RELEASE: bookworm, trixie, ...; ROOT is made where it is not there
set -euo pipefail
wheel=$(realpath "$1") release=$2 root=$3
if ! [ -e "$root/etc/debian_version" ]; then
  debootstrap --variant=minbase "$release" "$root" http://deb.debian.org/debian >/dev/null
fi
root=$(realpath "$root")
[ -e "$root/usr/bin/python3" ] || chroot "$root" apt-get install -qy --no-install-recommends python3 python3-venv python3-numpy >/dev/null
rm -rf "$root/try" && mkdir "$root/try" && cp "$wheel" "$root/try/"
mount -t proc proc "$root/proc"    # the loader asks it where a program stands
trap 'umount "$root/proc"' EXIT
cat >"$root/try/try.sh" <<'END'
set -euo pipefail
cd /try
step() { local start=$(date +%s.%N); echo "== $*"; timeout 300 "$@" >>log 2>&1 || { tail -n 5 log; exit 1; }; date +%s.%N | awk -v s="$start" '{printf "   %.1f s\n", $1 - s}'; }
echo "Debian $(cat /etc/debian_version), $(python3 --version), $(ls *.whl)"
step python3 -m venv --system-site-packages venv
if [[ $(ls *.whl) == *-cp$(python3 -c 'import sys; print("%d%d" % sys.version_info[:2])')-* ]]; then
  step venv/bin/pip install --no-index --no-deps ./*.whl
  python=venv/bin/python canyon=venv/bin/canyon
else
  echo "the wheel is of another Python: the command alone"
  step python3 -m zipfile -e ./*.whl apart
  chmod +x apart/canyon/bundle/bin/canyon
  printf '#!/bin/sh\nexec python3 -c "import sys; sys.path.insert(0, \\"/try/apart/canyon\\"); import _command; _command.main()" "$@"\n' >command && chmod +x command
  python= canyon=./command
fi
step $canyon --version
step $canyon demo -o demo
ls demo/track.png demo/heatmap/hdop.tif demo/demo.html
cat >drive.yaml <<'YAML'
city: {synthetic: {seed: 7}}
sky: {nominal: true}
start: 2026-01-01T08:00:00Z
trajectory:
  waypoints: [{east_m: -228, north_m: 0}, {east_m: 0, north_m: 0}, {east_m: 0, north_m: 228}]
  speed_mps: 8
  height_above_terrain_m: 1.5
receivers: [{name: car, profile: ublox-m10}]
seed: 1
YAML
step $canyon simulate drive.yaml -o drive
step $canyon heatmap drive.yaml -o map --spacing 10
ls drive/*.csv map
if [ -n "$python" ]; then
  step $python -c "
import canyon
run = canyon.simulate('demo/demo.yaml')
print(run.summary['horizontal_p95_m'], run.epochs['error_east_m'][:3])
run.write('drive.obs')"
fi
tail -n 3 log
END
env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/try LC_ALL=C.UTF-8 chroot "$root" bash /try/try.sh
