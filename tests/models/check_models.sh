#!/usr/bin/env bash
# Model-checks the broadcast ring and its bell with SPIN: as they are they have no error in any reachable state, every
# BROKEN_ variant has one. Usage: check_models.sh [-D options of the ring, e.g. -DMESSAGES=6]. Exit code 77 without spin.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
command -v spin > /dev/null || { echo "spin is not installed"; exit 77; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"

# search MODEL OPTIONS...: prints the number of errors and of states of one variant.
search() {
  local model=$1
  shift
  spin -a "$@" "$here/$model.pml" > spin.txt || { cat spin.txt; exit 1; }
  "${CC:-cc}" -O2 -w -DSAFETY -DCOLLAPSE -o pan pan.c
  ./pan -m1000000 > pan.txt
  ! grep -qE 'max search depth too small|out of memory' pan.txt || { cat pan.txt; exit 1; }
  errors=$(sed -n 's/.*errors: \([0-9]*\).*/\1/p' pan.txt)
  states=$(sed -n 's/ *\([0-9.e+]*\) states, stored.*/\1/p' pan.txt)
  echo "$model: errors $errors, states $states: ${*:-as it is}"
}

failed=0
must_hold() {
  search "$@"
  [[ $errors == 0 ]] || { failed=1; grep -A3 'assertion' pan.txt || true; }
}
must_fail() {
  search "$@"
  [[ $errors != 0 ]] || { failed=1; echo "$2 was not found wanting"; }
}
variants_of() { grep -oE 'BROKEN_[A-Z]+(_[A-Z]+)+' "$here/$1.pml" | sort -u; }

for slots in 2 3; do
  must_hold broadcast_ring -DSLOTS=$slots "$@"
  must_hold broadcast_ring -DSLOTS=$slots -DMESSAGES=4 -DREWINDS=1 "$@"   # history, read again before and after a death
done
must_hold broadcast_ring -DSLOTS=2 -DMESSAGES=3 -DREADERS=2 "$@"
must_hold bell -DREADERS=1 -DMESSAGES=3 -DDEATHS=2 -DREADER_DEATHS=2
must_hold bell -DREADERS=2 -DMESSAGES=2 -DDEATHS=1   # without bounds so low: 30 million states, minutes
for model in broadcast_ring bell; do
  options=()
  [[ $model == broadcast_ring ]] && options=("$@")
  for variant in $(variants_of $model); do must_fail $model "-D$variant" "${options[@]}"; done
done
exit $failed
