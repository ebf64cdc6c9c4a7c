#!/bin/busybox sh
# The first process of the guest (vivid_guest.sh): wasp camera on vivid, the kernel's own test driver of V4L2. What the
# host judges stands in lines "@wasp NAME JSON".
export PATH=/wasp/bin:/usr/bin:/bin HOME=/tmp
/bin/busybox mkdir -p /proc /sys /dev /tmp /usr/bin
/bin/busybox --install -s /usr/bin
mount -t proc proc /proc
mount -t sysfs sys /sys
mount -t devtmpfs dev /dev
mkdir -p /dev/shm
mount -t tmpfs shm /dev/shm
mount -t tmpfs tmp /tmp
exec </dev/null >/dev/console 2>&1

plug() {
  while read -r file; do
    case $file in vivid.ko) insmod /wasp/modules/vivid.ko n_devs=1 node_types=0x1 ;; *) insmod "/wasp/modules/$file" 2>/dev/null ;; esac
  done </wasp/modules/vivid.list
}
# camera NAME OPTIONS...: in the background; finish NAME hands its figures to the host.
camera() {
  name=$1
  shift
  wasp-camera --driver v4l2 --instance "$name" --json "$@" >"/tmp/$name.json" 2>"/tmp/$name.log" &
  camera=$!
}
finish() {
  wait $camera
  sed "s/^/@log $1 /" "/tmp/$1.log"
  echo "@wasp $1 $(cat "/tmp/$1.json")"
}
# control NUMBER VALUE: of vivid's, from its class' base.
control() { wasp_v4l2_control /dev/video0 $((0x00f0f000 + $1)) "$2"; }

cd /tmp
plug
echo "@wasp list $(wasp-camera --list --json)"
camera grey --width 320 --height 180 --rate 60 --seconds 5
finish grey
control 24 1 # stamps of the start of exposure from here on: those of the end lie ahead of the frame's arrival
camera yuyv --rate 25 --pixel-format YUYV --seconds 5
finish yuyv

camera drops --rate 25 --seconds 6
sleep 2
control 64 30 # percent of the buffers are dropped
sleep 3
control 64 0
finish drops

camera errors --rate 25 --seconds 9
sleep 2
control 66 1 # DQBUF error: a damaged frame
sleep 1
control 70 1 # queue error: EIO from here on, until it is opened anew
finish errors

camera unplug --rate 25 --seconds 8
sleep 2
control 65 1 # disconnect
sleep 1
rmmod vivid
sleep 1
plug
finish unplug
echo "@wasp end {}"
echo o >/proc/sysrq-trigger
sleep 60
