#!/usr/bin/env bash
# pack.sh ROOT BUILD CLIP CONFIG JOBS INITRD: packs an initial memory file system for one boot of the guest.
#   ROOT    unpacked packages of the guest's architecture (fetch.sh)
#   BUILD   folder with wasp, wasp-guard, wasp-sim, wasp-top and wasp-faults of that architecture
#   CLIP    recording to replay      CONFIG  folder of TOML files      JOBS  list of jobs (jobs.sh)
# Libraries are found as the loader would: what a program names as needed, and what that needs in turn.
set -euo pipefail
here=$(cd "$(dirname "$(readlink -f "$0")")" && pwd)
root=$1 build=$2 clip=$3 config=$4 jobs=$5 initrd=$6

stage=$(mktemp -d)
trap 'rm -rf --one-file-system "$stage"' EXIT
chmod 755 "$stage"
mkdir -p "$stage"/{bin,lib,wasp/bin,wasp/config}

find_library() {
  local folder
  for folder in "$root"/usr/lib/*-linux-gnu "$root"/usr/lib "$root"/lib64 /usr/lib/"$(uname -m)"-linux-gnu; do
    [[ -e $folder/$1 ]] && { readlink -f "$folder/$1"; return; }
  done
  echo "pack.sh: library $1 is not in $root" >&2
  return 1
}

add_libraries_of() {
  local name file
  while read -r name; do
    [[ -e $stage/lib/$name ]] && continue
    file=$(find_library "$name")
    install -m 755 "$file" "$stage/lib/$name"
    add_libraries_of "$file"
  done < <(readelf -d "$1" | sed -n 's/.*(NEEDED).*\[\(.*\)\]/\1/p')
}

add_program() {
  local loader
  install -m 755 "$1" "$2"
  add_libraries_of "$1"
  loader=$(readelf -l "$1" | sed -n 's/.*program interpreter: \(.*\)]/\1/p')
  [[ -z $loader || -e $stage$loader ]] && return
  install -D -m 755 "$(find_library "$(basename "$loader")")" "$stage$loader"
}

add_program "$root/usr/bin/busybox" "$stage/bin/busybox"
add_program "$root/usr/bin/stress-ng" "$stage/bin/stress-ng"
for program in wasp wasp-guard wasp-sim wasp-top wasp-faults; do add_program "$build/$program" "$stage/wasp/bin/$program"; done
cp -r "$clip" "$stage/wasp/clip"
cp -r "$(dirname "$root")/modules" "$stage/wasp/modules"
cp "$config"/*.toml "$stage/wasp/config/"
cp "$jobs" "$stage/wasp/jobs"
install -m 755 "$here/init.sh" "$stage/init"
install -m 644 "$here/jobs.sh" "$stage/wasp/jobs.sh"
(cd "$stage" && find . | cpio --create --format=newc --owner=0:0 --quiet) >"$initrd"
