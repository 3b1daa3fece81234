#!/bin/busybox sh
# The first program of the guest: it takes over the host's files, read-only, sets the CAN interfaces up, runs the checks and
# ends the machine. Failures before the checks run are reported on the console.
bb=/bin/busybox
fail() { $bb echo "GUEST-FAILED: $*"; $bb poweroff -f; $bb sleep 60; }

$bb mount -t proc proc /proc
$bb mount -t devtmpfs dev /dev
for module in $($bb cat /modules/order); do
  $bb insmod /modules/$module || $bb echo "no module $module"
done

# The host's root under an overlay in memory: what programs write is discarded.
share=trans=virtio,version=9p2000.L,msize=512000
$bb mount -t 9p -o ro,$share,cache=loose root /lower || fail "the host's files are not shared"
$bb mount -t tmpfs -o size=80%,mode=755 upper /upper
$bb mkdir /upper/files /upper/work
$bb mount -t overlay -o lowerdir=/lower,upperdir=/upper/files,workdir=/upper/work overlay /new || fail "no overlay"
$bb mkdir -p /new/proc /new/sys /new/dev /new/run /new/tmp
$bb mount -t sysfs sys /new/sys
$bb mount -t tmpfs run /new/run
$bb mkdir -p /new/run/control
$bb mount -t 9p -o $share,cache=none control /new/run/control || fail "no control share"
$bb mount -o move /dev /new/dev
$bb mount -o move /proc /new/proc
$bb mkdir -p /new/dev/pts /new/dev/shm
$bb mount -t devpts devpts /new/dev/pts
$bb mount -t tmpfs shm /new/dev/shm
$bb cp /bin/busybox /new/run/busybox
exec $bb switch_root /new /run/busybox sh /run/control/main.sh
