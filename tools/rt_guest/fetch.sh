#!/usr/bin/env bash
# fetch.sh ARCH [FOLDER]: Debian's PREEMPT_RT kernel for ARCH (arm64 or amd64) and the packages of that architecture which
# the cross build and the guest need, unpacked into FOLDER (default: ${XDG_CACHE_HOME:-~/.cache}/wasp/rt_guest/ARCH).
#   FOLDER/vmlinuz     the kernel; it has all a flight needs built in
#   FOLDER/modules/    what jobs need besides: NAME.ko with those it depends on, NAME.list in the order to load them
#   FOLDER/version     its package
#   FOLDER/root/       libraries, headers, stress-ng, busybox
# Any user may run it: apt works on lists and folders of its own, nothing is installed and no maintainer script runs.
# Package sources are those of this machine.
set -euo pipefail

arch=${1:?usage: fetch.sh arm64|amd64 [FOLDER]}
folder=${2:-${XDG_CACHE_HOME:-${HOME:-/tmp}/.cache}/wasp/rt_guest/$arch}
guest_packages=(busybox-static stress-ng)
modules=(softdog i6300esb vivid)              # two watchdogs, and a camera without a camera
module_folders=(drivers/watchdog drivers/media)  # where they and theirs are
case $arch in
  arm64) guest_packages+=(libc6-dev libeigen3-dev libfftw3-dev libhwy-dev libpng-dev libtoml11-dev libcli11-dev
                          libfmt-dev nlohmann-json3-dev) ;;
  amd64) ;;
  *) echo "fetch.sh: no architecture '$arch' here; arm64 or amd64" >&2; exit 2 ;;
esac

mkdir -p "$folder"
exec 9>"$folder/lock"
flock 9
wanted="linux-image-rt-$arch ${guest_packages[*]} ${modules[*]}"
if [[ -r $folder/ready && $(<"$folder/ready") == "$wanted" ]]; then exit 0; fi

for tool in apt-get dpkg-deb tar readelf; do
  command -v "$tool" >/dev/null || { echo "fetch.sh: '$tool' is missing; the guest is made from Debian packages" >&2; exit 3; }
done
work=$folder/work
rm -rf "$work" "$folder/root" "$folder/ready"
mkdir -p "$work"/lists/partial "$work"/archives/partial "$work"/kernel
: >"$work/status"
apt_options=(-qq -o Dir::State::lists="$work/lists" -o Dir::Cache="$work" -o Dir::Cache::archives="$work/archives"
  -o Dir::State::status="$work/status" -o APT::Architecture="$arch" -o APT::Architectures="$arch" -o Debug::NoLocking=1
  -o APT::Install-Recommends=0 -o APT::Sandbox::User=root)

fail() { tail -n 15 "$work/log" >&2; echo "fetch.sh: $1" >&2; exit 4; }

# A source that fails (another vendor's, without this architecture) does not matter while Debian's answer.
apt-get "${apt_options[@]}" update >"$work/log" 2>&1 || true
kernel=$(apt-cache "${apt_options[@]}" depends "linux-image-rt-$arch" 2>>"$work/log" |
  awk '/Depends: linux-image/ {print $2; exit}') || true
[[ -n $kernel ]] || fail "the package sources of this machine offer no linux-image-rt-$arch"
apt-get "${apt_options[@]}" --yes --download-only install "${guest_packages[@]}" >>"$work/log" 2>&1 ||
  fail "cannot download ${guest_packages[*]} for $arch"
(cd "$work/kernel" && apt-get "${apt_options[@]}" download "$kernel") >>"$work/log" 2>&1 || fail "cannot download $kernel"

mkdir -p "$folder"/root/usr/{bin,sbin,lib}
for name in bin sbin lib; do ln -s "usr/$name" "$folder/root/$name"; done
for package in "$work"/archives/*.deb; do
  dpkg-deb --fsys-tarfile "$package" | tar -x --keep-directory-symlink --no-same-owner -C "$folder/root" \
    --exclude './usr/share/doc' --exclude './usr/share/man' --exclude './usr/share/locale'
done
dpkg-deb --fsys-tarfile "$work"/kernel/*.deb | tar -x --no-same-owner -C "$work/kernel" --wildcards './boot/vmlinuz-*' \
  "${module_folders[@]/#/./lib/modules/*/kernel/}"
mv "$work"/kernel/boot/vmlinuz-* "$folder/vmlinuz"

# list_module NAME: the files of what it depends on, then its own, each once.
list_module() {
  local file name
  file=$(find "$work/kernel/lib/modules" -name "${1//[-_]/[-_]}.ko*" | head -n 1)
  [[ -n $file ]] || return 0  # built in
  case $file in *.xz) xz -d "$file"; file=${file%.xz} ;; esac
  for name in $(readelf -p .modinfo "$file" | sed -n 's/.* depends=//p' | tr ',' ' '); do list_module "$name"; done
  cp "$file" "$folder/modules/"
  basename "$file"
}
rm -rf "$folder/modules"
mkdir "$folder/modules"
for module in "${modules[@]}"; do
  list_module "$module" | awk '!seen[$0]++' >"$folder/modules/$module.list"
done
echo "$kernel" >"$folder/version"
rm -rf "$work"
echo "$wanted" >"$folder/ready"
