#!/usr/bin/env bash
# Tests adapters/gazebo_classic/root.sh, on a machine with a root.
# usage: tests/gazebo/root_test.sh
set -u
root_sh=$(cd "$(dirname "$0")/../../adapters/gazebo_classic" && pwd -P)/root.sh
checkout=$(cd "$(dirname "$0")/../.." && pwd -P)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
failed=0
fail() { echo "FAILED: $*"; failed=1; }
# expect STATUS WHAT CMD...: output goes to files out and err.
expect() {
  local want=$1 what=$2 status; shift 2
  timeout 60 "$@" >"$work/out" 2>"$work/err"; status=$?
  [ "$status" -eq "$want" ] || { fail "$what: exit status $status instead of $want"; cat "$work/out" "$work/err"; }
}
says() { grep -qF -- "$2" "$work/$1" || { fail "$1 does not say '$2':"; cat "$work/$1"; }; }

export CANYON_GAZEBO_BUILD=$work CANYON_GAZEBO_DATA=$work/data
expect 0 "a complete root is kept" "$root_sh" make
[ ! -s "$work/err" ] || fail "a complete root is worked on again: $(cat "$work/err")"
expect 7 "the status is the command's" "$root_sh" enter sh -c 'exit 7'
expect 139 "a crash is a crash" "$root_sh" enter sh -c 'kill -SEGV $$'
cd "$checkout" || exit 1
expect 0 "Gazebo 11 is there, in the folder we came from" "$root_sh" enter sh -c 'pwd; gzserver --version; true'
says out "$checkout"
says out "version 11."
expect 0 "arguments keep their words" "$root_sh" enter printf '<%s>' 'a b' '' '$HOME'
says out '<a b><><$HOME>'
expect 0 "the checkout is read-only, the build folder is not" "$root_sh" enter \
  sh -c '! touch "$1/run" 2>/dev/null && touch "$2/made"' sh "$checkout" "$work"
[ -O "$work/made" ] || fail "files do not belong to the caller"
expect 0 "the network is loopback alone" "$root_sh" enter sh -c 'ip -o link | cut -d" " -f2'
[ "$(cat "$work/out")" = lo: ] || fail "there are other links: $(cat "$work/out")"
expect 0 "the environment is Gazebo's" "$root_sh" enter env
says out "CANYON_GAZEBO_DATA=$work/data"
! grep -q "^CANYON_GAZEBO_BUILD=" "$work/out" || fail "the caller's environment leaks in"

# Background processes of a command end with it: a lock on a file is free again at once.
expect 0 "a command may leave others running" "$root_sh" enter \
  sh -c 'flock "$1" sh -c "echo held; exec sleep 600" >"$1.said" & until grep -q held "$1.said" 2>/dev/null; do :; done' sh "$work/lock"
expect 0 "they end with it" flock --timeout 10 "$work/lock" true

if [ "$(id -u)" -eq 0 ]; then
  export CANYON_ROOTS=$work/none
  expect 3 "no archive within reach" unshare --net "$root_sh" make
  says err "no Debian archive within reach"
  [ ! -e "$work/none/bullseye" ] || fail "there is half a root"
  mkdir -p "$work/theirs" && chmod 755 "$work" && chmod 777 "$work/theirs"
  expect 3 "no rights and no sudo" env CANYON_ROOTS="$work/theirs" PATH=/usr/bin:/bin \
    setpriv --reuid 65534 --regid 65534 --clear-groups bash -c 'command() { [ "$2" != sudo ] && builtin command "$@"; }
      export -f command; exec "$0" make' "$root_sh"
  says err "run as root or install sudo"
fi
[ "$failed" -eq 0 ] && echo "root_test: all as promised"
exit "$failed"
