# Sourced by fly and check: installs what is missing, configures and builds. Idempotent; quiet when there is nothing to do.

missing_packages() {
  local package condition
  while read -r package condition; do
    [[ -z $package || $package == \#* ]] && continue
    if [[ $condition == \?* ]] && command -v "${condition#\?}" >/dev/null 2>&1; then continue; fi
    dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null | grep -qx installed || echo "$package"
  done <"$here/scripts/packages.txt"
}

install_packages() {
  local packages sudo=() log="$here/build/apt.log"
  mapfile -t packages < <(missing_packages)
  ((${#packages[@]} == 0)) && return 0
  echo "installing Debian packages: ${packages[*]}"
  if ((EUID != 0)); then
    command -v sudo >/dev/null || { echo "error: these packages are missing, and only root (or sudo) can install them" >&2; return 3; }
    sudo=(sudo)
  fi
  mkdir -p "$here/build"
  "${sudo[@]}" apt-get update -qq || echo "warning: apt-get update failed; trying with the lists at hand" >&2
  DEBIAN_FRONTEND=noninteractive "${sudo[@]}" apt-get install -y -qq --no-install-recommends "${packages[@]}" >"$log" 2>&1 ||
    { tail -n 20 "$log" >&2; echo "error: apt-get install failed; the whole output is in $log" >&2; return 3; }
}

# build TARGET...: Release into build/, at most two jobs.
build() {
  mkdir -p "$here/build"
  if ! cmake -S "$here" -B "$here/build" -G Ninja -DCMAKE_BUILD_TYPE=Release >"$here/build/configure.log" 2>&1; then
    tail -n 30 "$here/build/configure.log" >&2
    echo "error: configuring failed; the whole output is in build/configure.log" >&2
    return 4
  fi
  NINJA_STATUS='[%f/%t, %es] ' cmake --build "$here/build" -j 2 --target "$@" || { echo "error: the build failed" >&2; return 4; }
}
