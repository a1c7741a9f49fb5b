#!/usr/bin/env bash
# A Debian 11 root, which has packages of Gazebo Classic 11 and ROS 1, for machines without Gazebo.
#
# usage: root.sh make            makes the root if missing or if its packages have changed; prints its folder
#        root.sh enter CMD...    runs CMD in it, in the current folder; the status is CMD's
#
# The root is in ${CANYON_ROOTS:-${XDG_CACHE_HOME:-~/.cache}/canyon}/bullseye. Inside, the checkout and ../shared
# are read-only at the same paths, CANYON_GAZEBO_BUILD is writable; mounts, processes and the network (loopback
# only, so every port is free) are private and end with CMD. CMD is run by the calling user.
# Exit status 3, with one line on stderr: a root is not possible on this machine.
set -euo pipefail

checkout=$(cd "$(dirname "$0")/../.." && pwd -P)
roots=${CANYON_ROOTS:-${XDG_CACHE_HOME:-${HOME-}/.cache}/canyon}
root=$roots/bullseye

# Packages needed by the plugin and its tests. The stamp has this list's hash.
packages=(g++ cmake ninja-build pkg-config ccache libeigen3-dev libgeographic-dev libembree-dev libtbb-dev libboost-dev libfmt-dev
  libyaml-cpp-dev nlohmann-json3-dev zlib1g-dev libarchive-dev libcurl4-openssl-dev libgtest-dev libgmock-dev iproute2 valgrind file dpkg-dev
  gazebo gazebo-plugin-base libgazebo-dev
  libroscpp-dev libsensor-msgs-dev libgeometry-msgs-dev python3-sensor-msgs python3-geometry-msgs python3-nav-msgs
  ros-std-msgs ros-geometry-msgs ros-sensor-msgs ros-message-generation catkin python3-roslaunch python3-rostopic
  python3-rosbag librosbag-dev gpsd gpsd-clients xvfb xauth)

refuse() { echo "root.sh: $*" >&2; exit 3; }
say() { printf '\033[1m==> %s\033[0m\n' "$*" >&2; }

sudo=()
if [ "$(id -u)" -ne 0 ]; then
  command -v sudo >/dev/null || refuse "a Debian 11 root needs the right to chroot; run as root or install sudo"
  sudo=(sudo)
fi

stamp() { printf '%s\n' "${packages[@]}" | sha256sum | cut -d' ' -f1; }
made() { [ "$(cat "$root/etc/canyon-stamp" 2>/dev/null)" = "$(stamp)" ]; }

# The host's own Debian mirror first (it may be the only reachable one), then the public ones.
mirror() {
  local url
  for url in $(sed -nE 's#^(deb( .*)?|URIs:.*)[[:space:]](https?://[^ ]*/debian)/?([[:space:]].*)?$#\3#p' /etc/apt/sources.list \
    /etc/apt/sources.list.d/* 2>/dev/null | sort -u) http://deb.debian.org/debian http://archive.debian.org/debian; do
    if wget -q --tries=2 --timeout=15 -O /dev/null "$url/dists/bullseye/Release"; then echo "$url"; return; fi
  done
  return 1
}

# in_root CMD...: with network, without services; for apt only.
in_root() {
  "${sudo[@]}" unshare --mount --pid --fork --kill-child bash -c 'mount -t proc proc "$1/proc"; exec chroot "$@"' \
    bash "$1" env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LC_ALL=C.UTF-8 DEBIAN_FRONTEND=noninteractive "${@:2}"
}

make() {
  "${sudo[@]}" mkdir -p "$roots"
  exec 9<"$roots" && flock 9    # a second run waits for the first
  ! made || return 0
  "${sudo[@]}" unshare --mount --pid --net --fork --kill-child true 2>/dev/null ||
    refuse "this machine does not let us unshare namespaces, as a container without CAP_SYS_ADMIN"
  command -v debootstrap >/dev/null || refuse "debootstrap is not installed"
  local proxy log=$roots/bullseye.log new=$root
  proxy=$(apt-config dump 2>/dev/null | grep -E '^Acquire::https?::proxy ' || true)
  [ -z "$proxy" ] || { http_proxy=$(sed -n 's/.*http::proxy "\(.*\)";/\1/ip;q' <<<"$proxy"); export http_proxy; }
  "${sudo[@]}" install -m 666 /dev/null "$log"
  if [ ! -e "$root/etc/canyon-stamp" ]; then
    local from
    from=$(mirror) || refuse "no Debian archive within reach has bullseye"
    say "making a Debian 11 root with Gazebo 11 and ROS 1 in $root (once, some minutes; 3 GB)"
    new=$root.new
    "${sudo[@]}" rm -rf --one-file-system "$new" "$root"
    "${sudo[@]}" ${http_proxy:+env http_proxy="$http_proxy"} debootstrap --variant=minbase --include=ca-certificates \
      bullseye "$new" "$from" >>"$log" 2>&1 || { tail -n 5 "$log" >&2; refuse "debootstrap failed; see $log"; }
    # A root has no services and its own caches; the archive may be frozen.
    printf '#!/bin/sh\nexit 101\n' | "${sudo[@]}" install -m 755 /dev/stdin "$new/usr/sbin/policy-rc.d"
    "${sudo[@]}" install -d -m 1777 "$new/var/cache/ccache"
    printf '%s\n' "$proxy" 'Acquire::Check-Valid-Until "false";' 'Acquire::Retries "3";' 'Acquire::Languages "none";' |
      "${sudo[@]}" tee "$new/etc/apt/apt.conf.d/99canyon" >/dev/null
  fi
  say "installing Gazebo 11, ROS 1 and what the build needs"
  "${sudo[@]}" cp -L /etc/resolv.conf "$new/etc/resolv.conf"
  { in_root "$new" apt-get update -q && in_root "$new" apt-get install -qy --no-install-recommends "${packages[@]}" &&
    in_root "$new" apt-get clean; } >>"$log" 2>&1 || { tail -n 5 "$log" >&2; refuse "apt failed in the root; see $log"; }
  stamp | "${sudo[@]}" tee "$new/etc/canyon-stamp" >/dev/null
  [ "$new" = "$root" ] || "${sudo[@]}" mv "$new" "$root"
  say "the root is complete"
}

# Runs as root in its own namespaces: ROOT USER:GROUP CHECKOUT BUILD FOLDER CMD...
inside() {
  local root=$1 owner=$2 checkout=$3 build=$4 folder=$5; shift 5
  bind() { mkdir -p "$root$1" && mount --bind "$1" "$root$1"; }
  bind_read_only() { bind "$1" && mount -o remount,bind,ro "$root$1"; }
  mount -t proc proc "$root/proc"
  mount --rbind /dev "$root/dev"
  mount -t tmpfs -o mode=1777 canyon "$root/tmp"
  bind_read_only "$checkout"
  [ ! -d "$checkout/../shared" ] || bind_read_only "$(cd "$checkout/../shared" && pwd -P)"
  [ -z "$build" ] || bind "$build"
  chroot "$root" ip link set lo up
  # Job control keeps signals for CMD (SIGINT would be ignored otherwise); when this shell, the first process here,
  # ends, the kernel ends all others.
  trap 'exit 130' INT TERM
  set -m
  chroot --userspec="$owner" "$root" /usr/bin/env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/tmp LC_ALL=C.UTF-8 \
    TERM="${TERM:-dumb}" CCACHE_DIR=/var/cache/ccache CCACHE_BASEDIR="$checkout" CCACHE_NOHASHDIR=1 CCACHE_SLOPPINESS=pch_defines,time_macros CCACHE_UMASK=000 \
    GAZEBO_MASTER_URI=http://127.0.0.1:11345 GAZEBO_IP=127.0.0.1 GAZEBO_MODEL_DATABASE_URI= \
    ROS_MASTER_URI=http://127.0.0.1:11311 ROS_IP=127.0.0.1 IGN_IP=127.0.0.1 ${CANYON_GAZEBO_DATA:+CANYON_GAZEBO_DATA="$CANYON_GAZEBO_DATA"} \
    /bin/sh -c 'cd "$1" && shift && exec "$@"' sh "$folder" "$@" </dev/null &
  { wait $!; } 2>/dev/null    # without the shell's note about its end
}

case "${1:-}" in
  make) make; echo "$root" ;;
  enter)
    shift
    made || { (make) || exit; }
    exec "${sudo[@]}" unshare --mount --pid --net --fork --kill-child env CANYON_GAZEBO_DATA="${CANYON_GAZEBO_DATA:-}" \
      bash "$0" inside "$root" "$(id -u):$(id -g)" "$checkout" "${CANYON_GAZEBO_BUILD:-}" "$PWD" "$@" ;;
  inside) shift; inside "$@" ;;
  *) sed -n 's/^# \{0,1\}//p' "$0" | sed -n '1,10p'; exit 2 ;;
esac
