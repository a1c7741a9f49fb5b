#!/usr/bin/env bash
# Builds and runs the Gazebo Classic plugin: with this machine's Gazebo 11, else in a Debian 11 root (root.sh).
#
# usage: gazebo.sh test [CTEST ARGUMENT...]
#        gazebo.sh package      a Debian package of the plugins for the release with Gazebo, in CANYON_BUILD-gazebo/packages
#        gazebo.sh drive [synthetic|hongkong] [--seconds N] [--from N] [--gui]
#
# CANYON_BUILD has the built canyon program; the plugin is built in the folder of that name plus -gazebo.
set -euo pipefail

here=$(cd "$(dirname "$0")" && pwd -P)
checkout=$(cd "$here/../.." && pwd -P)
host_build=$(realpath "${CANYON_BUILD:-$checkout/build-release}")
build=$host_build-gazebo
log=$build/run.log
export CANYON_GAZEBO_BUILD=$build CANYON_GAZEBO_DATA=$build/data

say() { printf '\033[1m==> %s\033[0m\n' "$*" >&2; }

native() { pkg-config --exists 'gazebo >= 11' 'gazebo < 12' 2>/dev/null; }
# An unused port.
free_port() {
  local port
  for ((port = $1; port < $1 + 100; ++port)); do (: <"/dev/tcp/127.0.0.1/$port") 2>/dev/null || { echo "$port"; return; }; done
}
# in_gazebo CMD...: runs it where Gazebo is. A root has its own network; on the machine others may also run Gazebo.
in_gazebo() {
  if native; then
    env GAZEBO_MASTER_URI="http://127.0.0.1:$(free_port 11345)" ROS_MASTER_URI="http://127.0.0.1:$(free_port 11311)" \
      GAZEBO_IP=127.0.0.1 ROS_IP=127.0.0.1 IGN_IP=127.0.0.1 GAZEBO_MODEL_DATABASE_URI= LC_ALL=C.UTF-8 "$@"
  else
    "$here/root.sh" enter "$@"
  fi
}
with_ros() { ! native || pkg-config --exists roscpp; }

# build_plugin TESTS(ON|OFF) TARGET...: status 3 and the reason on stderr if Gazebo is not available.
build_plugin() {
  local tests=$1 reason flags; shift
  mkdir -p "$build"
  if ! native && ! reason=$("$here/root.sh" make 2>&1 >/dev/null | tee >(cat >&2) | tail -n 1); then
    echo "SKIPPED: Gazebo tests (${reason#root.sh: })" >&2
    return 3
  fi
  say "building the Gazebo plugin in $build"
  flags=(-DCMAKE_BUILD_TYPE=Release -DCMAKE_CXX_COMPILER_LAUNCHER=ccache -DCMAKE_C_COMPILER_LAUNCHER=ccache
    -DCANYON_PRECOMPILED_HEADERS=OFF    # so that each header must compile alone
    -DCANYON_BUILD_IO=OFF -DCANYON_BUILD_CLI=OFF -DCANYON_BUILD_BENCHMARKS=OFF -DCANYON_BUILD_GAZEBO=ON
    -DCANYON_BUILD_ROS="$(with_ros && echo ON || echo OFF)" -DCANYON_BUILD_TESTS="$tests" -DCANYON_PACKAGE="${packaging:-OFF}"
    -DCANYON_WARNINGS_AS_ERRORS="${CANYON_WARNINGS_AS_ERRORS:-OFF}")
  in_gazebo cmake -S "$checkout" -B "$build" -G Ninja "${flags[@]}" >"$log" 2>&1 || { tail -n 30 "$log" >&2; return 1; }
  in_gazebo cmake --build "$build" --target "$@" 2>&1 | "$checkout/cmake/progress.sh" "$log" ||
    { grep -A3 -E '^FAILED|error:|CMake Error|undefined reference' "$log" | cut -c-240 | head -n 60 >&2; return 1; }
  "$checkout/tests/gazebo/prepare.sh" "$host_build/bin/canyon" "$CANYON_GAZEBO_DATA"
}

run_tests() {
  local status=0
  build_plugin ON adapters/gazebo_classic/all || { status=$?; [ "$status" -ne 3 ] || status=0; return "$status"; }
  say "testing the Gazebo plugin"
  native || "$checkout/tests/gazebo/root_test.sh" || status=1
  cd "$build"    # ctest --test-dir needs CMake 3.20
  in_gazebo ctest -L gazebo --output-on-failure -j "$(nproc)" "$@" || status=$?
  return "$status"
}

package() {
  packaging=ON build_plugin OFF packaged || return
  cd "$build"
  in_gazebo cpack --config CPackConfig.cmake -B packages >package.log || { tail -n 20 package.log >&2; return 1; }
}

drive() {
  local city=synthetic status=0
  case "${1:-}" in
    synthetic | hongkong) city=$1; shift ;;
    '' | --*) ;;
    *) echo "gazebo: unknown city '$1'; use synthetic or hongkong" >&2; exit 2 ;;
  esac
  if [[ " $* " == *" --gui "* ]] && ! { native && [ -n "${DISPLAY:-}" ]; }; then
    echo "gazebo: --gui needs Gazebo 11 installed on this machine, and a display" >&2; exit 2
  fi
  build_plugin "$([ -e "$build/bin/gazebo_server_test" ] && echo ON || echo OFF)" MultipathSensorPlugin GNSSMultipathSensorPlugin GNSSMultipathModelPlugin CanyonDrivePlugin || exit
  [ -e "$CANYON_GAZEBO_DATA/$city" ] || { echo "gazebo: no $city world: ../shared/data/hongkong is not here" >&2; exit 2; }
  say "driving through $city"
  in_gazebo env GAZEBO_PLUGIN_PATH="$build/lib" python3 "$here/example/drive.py" "$CANYON_GAZEBO_DATA/$city" "$build" "$@"
}

case "${1:-}" in
  test) shift; run_tests "$@" ;;
  package) package ;;
  drive) shift; drive "$@" ;;
  *) sed -n 's/^# \{0,1\}//p' "$0" | sed -n '3,5p'; exit 2 ;;
esac
