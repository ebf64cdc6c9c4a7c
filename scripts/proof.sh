# Sourced by check for --proof: the tests of the real-time code under RealtimeSanitizer, a flight of the same build, and
# ThreadSanitizer over channels and rings. docs/contract.md says what each of them sees.

# sanitize FOLDER "CMAKE OPTIONS" TARGET...: configures and builds the targets there.
sanitize() {
  local folder=$1 options=$2
  shift 2
  mkdir -p "$folder"
  # shellcheck disable=SC2086  # options are words
  cmake -S "$here" -B "$folder" -G Ninja -DCMAKE_BUILD_TYPE=RelWithDebInfo $options >"$folder/configure.log" 2>&1 ||
    { tail -n 30 "$folder/configure.log" >&2; echo "error: configuring $folder failed" >&2; return 4; }
  NINJA_STATUS='[%f/%t, %es] ' cmake --build "$folder" -j 2 --target "$@"
}

# The flight process from the sanitized build, everything about it from the ordinary one. What counts is that it lived
# and flew its mission: deadlines missed on a busy host are not the sanitizer's business.
fly_under_realtime_sanitizer() {
  local folder=$here/build-rtsan/flight
  build wasp-guard wasp-fly wasp-sim wasp-record wasp-report || return
  mkdir -p "$folder"
  ln -sfn "$here/config" "$here/build-rtsan/config"
  cp "$here/build-rtsan/wasp" "$here"/build/wasp-{guard,fly,sim,record,report} "$folder/"
  "$folder/wasp-fly" --no-rt --seconds 20 --out "$here/build-rtsan/out" | tee "$folder/fly.log" || true
  grep -q '^ok *flight process exit code' "$folder/fly.log" && grep -q '^ok *mission flown' "$folder/fly.log"
}

prove() {
  local reader
  reader=$(command -v llvm-symbolizer-22 || command -v addr2line)
  echo "== RealtimeSanitizer: tests"
  export RTSAN_OPTIONS="suppressions=$here/tests/proof/rtsan_suppressions.txt:external_symbolizer_path=$reader"
  sanitize "$here/build-rtsan" "-DCMAKE_C_COMPILER=clang-22 -DCMAKE_CXX_COMPILER=clang++-22 -DWASP_SANITIZE=realtime" \
    test_rt test_shm test_vision test_control test_scheduling wasp
  ctest --test-dir "$here/build-rtsan" --output-on-failure -j 2 \
    -R '^(rt|shm|vision|control|scheduling)\.' -E 'MallocGuard'
  echo "== RealtimeSanitizer: a flight in the simulator"
  fly_under_realtime_sanitizer
  echo "== ThreadSanitizer: channels and rings"
  sanitize "$here/build-tsan" "-DWASP_SANITIZE=thread" test_rt test_shm
  ctest --test-dir "$here/build-tsan" --output-on-failure -j 2 -R '^(rt|shm)\.'
}
