#!/bin/busybox sh
# The first process of the guest: file systems, then the jobs listed in /wasp/jobs one after the other, then power off.
# Everything lies in memory: nothing here waits for a device. It speaks to the host in lines that begin with "@wasp".
export PATH=/wasp/bin:/usr/bin:/bin HOME=/tmp
/bin/busybox mkdir -p /proc /sys /dev /tmp /usr/bin /etc
/bin/busybox --install -s /usr/bin
mount -t proc proc /proc
mount -t sysfs sys /sys
mount -t devtmpfs dev /dev
mkdir -p /dev/pts /dev/shm
mount -t devpts pts /dev/pts
mount -t tmpfs shm /dev/shm
mount -t tmpfs tmp /tmp
chmod 1777 /tmp /dev/shm
ln -sf busybox /bin/sh
printf 'root:x:0:0::/:/bin/sh\nnobody:x:65534:65534::/:/bin/sh\n' >/etc/passwd
exec </dev/null >/dev/console 2>&1
. /wasp/jobs.sh

say "up $(uname -r) realtime=$(cat /sys/kernel/realtime 2>/dev/null || echo 0)"
while read -r line; do
  run_job $line
done </wasp/jobs
say "end"
sync
echo o >/proc/sysrq-trigger
sleep 60
