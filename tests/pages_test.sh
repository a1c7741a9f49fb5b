#!/usr/bin/env bash
# Tests that pages.py finds faults: a page with false blocks, each named by its line, and with true ones.
# usage: tests/pages_test.sh CANYON
set -u
root=$(cd "$(dirname "$0")/.." && pwd)
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
page=$folder/page.md wanted=()

# block WANTED LANGUAGE BEFORE TEXT: a block; WANTED is the text of its fault, "" for a true one.
block() {
  printf '%s\n\n```%s\n%s\n```\n\n' "$3" "$2" "$4" >>"$page"
  [ -z "$1" ] || wanted+=("${page##*/}:$(($(wc -l <"$page") - 1 - $(wc -l <<<"$4"))): $1")
}
block '' yaml 'Save this as `mine.yaml`:' "$(sed '/^receivers/q' "$root/examples/synthetic_drive.yaml")
  - name: car"
block '' sh '' 'canyon simulate mine.yaml --out made | tee said'
block '' sh 'A block before made it:' 'test -s made/epochs.csv && test -s said'
block 'exit status 1' sh '' 'false'
block 'exit status 3' sh '' $'canyon simulate mine.yaml --out again\nexit 3'
block 'exit status 2' '' '' 'canyon simulate absent.yaml --out again'
block 'canyon has no command drive' sh '<!-- not run: no such thing -->' 'canyon drive mine.yaml'
block '' sh '<!-- not run: it fails -->' 'false'
block '' text '' 'anything'
block "exit status 2" yaml '' 'sky: {nominally: true}'
block 'exit status 2' yaml '' 'receivers: [{name: car, profile: absent}]'
block '' yaml '' 'seed: 2'
block '<satelite> is no element' xml '' '<plugin filename="CanyonGnssSystem"><satelite/></plugin>'
block 'Expecting' json '' '{"time_s": 12'
printf 'An indented one:\n\n    canyon sky --at 100,0,0 --time 2026-06-01T08:00:00Z\n\n' >>"$page"
wanted+=("${page##*/}:$(($(wc -l <"$page") - 1)): exit status 2")
[ ! -e "$(dirname "$1")/../python/canyon" ] || { block '' python '' 'import canyon.absent' && wanted+=("page.md: python: exit status 1"); }
page=$folder/told.md
[ ! -e "$(dirname "$1")/../python/canyon" ] || { block '' '' '' $'>>> 1 + 1\n2\n>>> 1 + 2\n2' && wanted+=("told.md: python: exit status 1"); }
page=$folder/page.md
block '' cpp '' 'int f() { return canyon::absent; }' && wanted+=("page.md: cpp: exit status 1")

said=$(/usr/bin/python3 "$root/tests/pages.py" "$1" "$folder"/*.md)
status=$?
[ "$status" -eq 1 ] || { echo "$said"; echo "exit status $status"; exit "$status"; }
failed=0
for fault in "${wanted[@]}"; do grep -qF "$fault" <<<"$said" || { echo "not found: $fault"; failed=1; }; done
grep -q '^ *4 run  .*2 sh, 2 yaml' <<<"$said" || { echo "true blocks do not run"; failed=1; }
[ "$failed" -eq 0 ] && echo "all of ${#wanted[@]} planted faults were found" || echo "$said"
exit "$failed"
