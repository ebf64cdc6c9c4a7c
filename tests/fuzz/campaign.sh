#!/usr/bin/env bash
# The long counts: ten million executions of the MAVLink parser, one million of each other target, in one job at nice 10.
# Usage: campaign.sh [TARGET COUNT]...   logs and what was learnt stay in build/fuzz/campaign; exit code 1 on a finding.
set -euo pipefail
here=$(cd "$(dirname "$(readlink -f "$0")")" && pwd)
build=$here/../../build/fuzz
out=$build/campaign
mkdir -p "$out"

# run TARGET COUNT: prints one line; a finding stays as $out/TARGET.crash-... (or oom-, timeout-, leak-).
run() {
  local target=$1 count=$2 n s options=()
  [[ -f $here/$target.dict ]] && options+=("-dict=$here/$target.dict")
  [[ $target == vrml ]] && options+=(-detect_leaks=0) && export ASAN_OPTIONS=detect_leaks=0  # Coin leaks
  mkdir -p "$out/$target"
  nice -n 10 "$build/fuzz_$target" -runs="$count" -seed=1 -malloc_limit_mb=256 -rss_limit_mb=2048 -timeout=300 \
    -artifact_prefix="$out/$target." "${options[@]}" "$out/$target" "$here/corpus/$target" >"$out/$target.log" 2>&1 ||
    { echo "$target: FOUND, see $out/$target.log"; return 1; }
  read -r n s < <(sed -n 's/^Done \([0-9]*\) runs in \([0-9]*\) second.*/\1 \2/p' "$out/$target.log")
  echo "$target: $n executions in $s s, nothing found$(sed -n 's/^reader died/; reader died/p' "$out/$target.log")"
}

(($# > 0)) || set -- mavlink 10000000 $(for seeds in "$here"/corpus/*/; do
  name=$(basename "$seeds"); [[ $name == mavlink ]] || echo "$name 1000000"; done)
failed=0
while (($# > 0)); do
  run "$1" "${2:-1000000}" || failed=1
  shift $(($# > 1 ? 2 : 1))
done
exit $failed
