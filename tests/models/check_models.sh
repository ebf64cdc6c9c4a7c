#!/usr/bin/env bash
# Model-checks the broadcast ring with SPIN: the ring as it is has no error in any reachable state, every BROKEN_ variant
# has one. Usage: check_models.sh [-D options of the model, e.g. -DMESSAGES=6]. Exit code 77 without spin.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
command -v spin > /dev/null || { echo "spin is not installed"; exit 77; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"

# Prints the number of errors and of states of one variant.
search() {
  spin -a "$@" "$here/broadcast_ring.pml" > spin.txt || { cat spin.txt; exit 1; }
  "${CC:-cc}" -O2 -w -DSAFETY -DCOLLAPSE -o pan pan.c
  ./pan -m1000000 > pan.txt
  ! grep -qE 'max search depth too small|out of memory' pan.txt || { cat pan.txt; exit 1; }
  errors=$(sed -n 's/.*errors: \([0-9]*\).*/\1/p' pan.txt)
  states=$(sed -n 's/ *\([0-9]*\) states, stored.*/\1/p' pan.txt)
  echo "errors $errors, states $states: ${*:-as it is}"
}

failed=0
for slots in 2 3; do
  search -DSLOTS=$slots "$@"
  [[ $errors == 0 ]] || { failed=1; grep -A3 'assertion' pan.txt || true; }
done
for variant in $(grep -oE 'BROKEN_[A-Z]+(_[A-Z]+)+' "$here/broadcast_ring.pml" | sort -u); do
  search "-D$variant" "$@"
  [[ $errors != 0 ]] || { failed=1; echo "$variant was not found wanting"; }
done
exit $failed
