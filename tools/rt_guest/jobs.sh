# What the guest can be asked to do; sourced by init.sh. A line of /wasp/jobs is: flight NAME SECONDS rt|other idle|stress
# or: rights NAME, or: faults NAME REGEX [OPTIONS], or: watchdog NAME MODULE.

say() { echo "@wasp $*"; }

run_job() {
  kind=$1
  shift
  case $kind in
    flight) flight "$@" ;;
    rights) rights "$@" ;;
    faults) faults "$@" ;;
    watchdog) watchdog "$@" ;;
    *) say "error no job '$kind'" ;;
  esac
}

# A line now and then while a job runs: the host shows progress and knows that the guest lives. Virtual time.
tick_of_life() {
  elapsed=0
  while sleep "$2"; do
    elapsed=$((elapsed + $2))
    say "tick $1 $elapsed"
  done
}

# Processor, memory, files, pipes between processes and timers at once, all at ordinary priority. /tmp is memory: no
# host disk is involved. The switchers make sure that an ordinary thread has to wait its turn.
start_stress() {
  stress-ng --temp-path /tmp --cpu 4 --vm 2 --vm-bytes 16m --hdd 1 --hdd-bytes 4m --io 1 --switch 4 --timer 1 --quiet \
    >/tmp/stress.log 2>&1 &
  stress=$!
}

# load_module NAME: with what it depends on.
load_module() {
  while read -r file; do insmod "/wasp/modules/$file"; done <"/wasp/modules/$1.list"
}

# wait_until COMMAND...: half a minute of virtual time at most.
wait_until() {
  left=600
  until "$@" || [ $left = 0 ]; do
    usleep 50000
    left=$((left - 1))
  done
}

# The autopilot of a job: a simulated vehicle at the other end of a pseudo-terminal.
start_vehicle() {
  printf '[autopilot]\nendpoint = "serial:/tmp/%s.tty:921600"\n' "$name" >"$name.toml"
  options="--instance $name --config /wasp/config/wasp.toml --config /wasp/config/guest.toml --config $name.toml"
  wasp-sim --instance "$name" --tty-link "/tmp/$name.tty" --no-camera >"$name.sim.log" 2>&1 &
  sim=$!
  wait_until [ -e "/tmp/$name.tty" ]
}

# What real time takes is granted to root, and refused by name to anybody else.
rights() {
  name=$1
  say "start $name"
  cd /tmp
  wasp flight --check-rights >"$name.log" 2>&1
  root=$?
  su -s /bin/sh nobody -c 'exec wasp flight --check-rights' >"$name.user.log" 2>&1
  user=$?
  start_vehicle
  chmod 666 "$(readlink "$name.tty")"
  su -s /bin/sh nobody -c "exec wasp flight $options --replay /wasp/clip" >"$name.flight.log" 2>&1
  flight=$?
  kill $sim
  wait
  sed "s/^/@wasp log $name /" "$name.log" "$name.user.log" "$name.flight.log"
  named=$(grep -c 'missing right' "$name.user.log")
  refusals=$(grep -c 'refusing to arm' "$name.flight.log")
  say "result $name 0 {\"root\":$root,\"user\":$user,\"user_rights_missing\":$named," \
    "\"user_flight\":$flight,\"user_flight_refusals\":$refusals}"
  rm -rf /dev/shm/* "$name".*
}

# Faults done for real, their answers measured on the wire; nobody else needs this machine's clock.
faults() {
  name=$1 only=$2
  shift 2
  say "start $name"
  cd /tmp
  {
    wasp-faults --replay /wasp/clip --own-machine --only "$only" "$@" --out "/tmp/$name" --json "$name.json" 2>&1
    echo $? >"$name.code"
  } | while IFS= read -r line; do say "log $name $line"; done
  for log in "$name"/*/flight.txt; do sed "s/^/@wasp log $name /" "$log"; done
  say "result $name $(cat "$name.code") $(tr -d '\n' <"$name.json")"
  rm -rf /dev/shm/* "$name" "$name".*
}

# The board's own watchdog: fed in flight, disarmed by an orderly end; then the guardian is killed, and the board must
# start again. Nothing comes after this job: the emulator ends where a board would boot.
watchdog() {
  name=$1 state=/sys/class/watchdog/watchdog0/state
  say "start $name"
  cd /tmp
  load_module "$2"
  start_vehicle
  printf '[guardian]\nwatchdog = "/dev/watchdog"\n' >"$name.dog.toml"
  fly="wasp guard $options --config $name.dog.toml --replay /wasp/clip --preload"
  $fly --seconds 8 >"$name.log" 2>&1 &
  guard=$!
  wait_until grep -qs "mission:" "$name.log"
  fed=0
  for second in 1 2 3 4 5; do # the device would have bitten after two
    sleep 1
    [ "$(cat $state)" = active ] && fed=$((fed + 1))
  done
  limit=$(cat /sys/class/watchdog/watchdog0/timeout)
  wait $guard
  code=$?
  after=$(cat $state)
  sleep 5
  sed "s/^/@wasp log $name /" "$name.log"
  say "result $name 0 {\"flight\":$code,\"limit_s\":$limit,\"active_s\":$fed,\"after\":\"$after\",\"outlived_s\":5}"
  $fly --seconds 60 >"$name.log" 2>&1 &
  guard=$!
  wait_until grep -qs "mission:" "$name.log"
  sleep 3
  say "last $name"
  kill -9 $guard
  alive=0
  while [ $alive -lt 10000 ]; do
    usleep 20000
    alive=$((alive + 20))
    say "alive $name $alive"
  done
}

flight() {
  name=$1 seconds=$2 policy=$3 load=$4
  say "start $name"
  cd /tmp
  start_vehicle
  tick_of_life "$name" $((seconds > 600 ? 20 : 5)) &
  ticker=$!
  [ "$policy" = other ] && options="$options --no-rt"
  wasp flight $options --replay /wasp/clip --preload --seconds "$seconds" >"$name.log" 2>&1 &
  flight=$!
  stress=
  wait_until grep -qs "mission:" "$name.log" # armed: what comes before is not measured
  [ "$load" = stress ] && start_stress
  wait $flight
  code=$?
  kill $ticker $stress
  wasp-top --instance "$name" --once --json >"$name.json" 2>>"$name.log"
  kill $sim
  wait
  sed "s/^/@wasp log $name /" "$name.log" "$name.sim.log"
  [ -s /tmp/stress.log ] && sed "s/^/@wasp log $name /" /tmp/stress.log
  say "result $name $code $(cat "$name.json")"
  rm -rf /dev/shm/* "$name".* /tmp/stress.log
}
