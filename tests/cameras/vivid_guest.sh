#!/usr/bin/env bash
# vivid_guest.sh SOURCE BUILD: wasp-camera of this build on vivid, V4L2's test driver, in Debian's amd64 PREEMPT_RT kernel in
# the emulator, on virtual time: rate, sequence, time stamps, dropped buffers, damaged frames, a broken queue, unplugging.
# Exit code 77: the guest cannot be had here (CTest: skipped).
set -euo pipefail
source_dir=$1 build=$2
here=$source_dir/tests/cameras
work=$build/vivid_guest
mkdir -p "$work"
for tool in qemu-system-x86_64 cpio python3; do
  command -v "$tool" >/dev/null || { echo "not available here: '$tool' is missing"; exit 77; }
done
cache=${XDG_CACHE_HOME:-${HOME:-/tmp}/.cache}/wasp/rt_guest/amd64
"$source_dir/tools/rt_guest/fetch.sh" amd64 "$cache" || { echo "not available here: the guest's kernel cannot be had"; exit 77; }
[[ -s $cache/modules/vivid.list ]] || { echo "not available here: this kernel has no vivid"; exit 77; }

stage=$(mktemp -d)
trap 'rm -rf --one-file-system "$stage"' EXIT
chmod 755 "$stage"
mkdir -p "$stage"/{bin,wasp/bin,wasp/config}
add_program() {
  install -m 755 "$1" "$2"
  local library
  while read -r library; do
    [[ -e $stage$library ]] || install -D -m 755 "$library" "$stage$library"
  done < <(ldd "$1" | grep -o '/[^ ]*')
}
add_program "$build/wasp-camera" "$stage/wasp/bin/wasp-camera"
add_program "$build/lib/wasp_v4l2_control" "$stage/wasp/bin/wasp_v4l2_control"
install -m 755 "$cache/root/bin/busybox" "$stage/bin/busybox" 2>/dev/null || install -m 755 "$cache/root/usr/bin/busybox" "$stage/bin/busybox"
cp -r "$cache/modules" "$stage/wasp/modules"
cp "$source_dir/config/wasp.toml" "$stage/wasp/config/"
install -m 755 "$here/vivid_init.sh" "$stage/init"
(cd "$stage" && find . | cpio --create --format=newc --owner=0:0 --quiet) >"$work/initrd"

timeout 1500 qemu-system-x86_64 -machine q35 -cpu max -smp 1 -accel tcg,thread=single,tb-size=256 -icount shift=1,sleep=off \
  -m 768 -nodefaults -no-reboot -display none -monitor none -serial stdio -kernel "$cache/vmlinuz" -initrd "$work/initrd" \
  -append "console=ttyS0,115200 tsc=reliable no_timer_check quiet loglevel=1 panic=-1 rdinit=/init" >"$work/console.txt" </dev/null ||
  { tail -n 20 "$work/console.txt"; echo "the guest failed"; exit 1; }
exec python3 "$here/vivid_verdict.py" "$work/console.txt"
