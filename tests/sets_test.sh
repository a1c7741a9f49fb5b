#!/usr/bin/env bash
# Tests that each row of tests/sets.txt that names tests has at least one, and that it has the row's label.
# usage: tests/sets_test.sh BUILD [CTEST]
set -u
sets=$(cd "$(dirname "$0")" && pwd)/sets.txt
cd "$1" || exit 2
failed=0
while read -r label names what; do
  [ "$names" = - ] && continue
  "${2:-ctest}" -N -L "^$label\$" -R "^($names)\$" | grep -c 'Test *#' >/dev/null ||
    { echo "tests/sets.txt: no test '$names' with the label '$label' ($what)"; failed=1; }
done < <(grep -v '^#' "$sets")
exit "$failed"
