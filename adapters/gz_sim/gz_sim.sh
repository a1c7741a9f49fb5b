#!/usr/bin/env bash
# Drives the example in Gazebo Sim with the systems of a build.
#
# usage: gz_sim.sh BUILD [synthetic|hongkong] [--seconds N] [--from N] [--gui]
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd -P)
build=$(realpath "$1"); shift
city=synthetic
case "${1:-}" in
  synthetic | hongkong) city=$1; shift ;;
  '' | --*) ;;
  *) echo "gazebo: unknown city '$1'; use synthetic or hongkong" >&2; exit 2 ;;
esac
if [[ " $* " == *" --gui "* && -z "${DISPLAY:-}${WAYLAND_DISPLAY:-}" ]]; then
  echo "gazebo: --gui needs a display" >&2; exit 2
fi
[ -e "$build/data/$city" ] || "$here/../../tests/gazebo/prepare.sh" "$build/bin/canyon" "$build/data"
[ -e "$build/data/$city" ] || { echo "gazebo: no $city world: ../shared/data/hongkong is not here" >&2; exit 2; }
printf '\033[1m==> driving through %s in Gazebo Sim\033[0m\n' "$city" >&2
exec /usr/bin/python3 "$here/example/drive.py" "$build/data/$city" "$build" "$@"
