"""PDOs of the ZL drives, set up by canopen-python's own PDO classes."""

import time


def set_up(bench, pdo, variables, **parameters):
    """Maps variables with the library: COB-ID off (bit 31), parameters, mapping, COB-ID on."""
    bench.node.tpdo.read()
    bench.node.rpdo.read()
    pdo.clear()
    for index in variables:
        pdo.add_variable(index)
    for name, value in parameters.items():
        setattr(pdo, name, value)
    pdo.enabled = True
    pdo.save()


def start(bench):
    bench.nmt(0x01)
    time.sleep(0.1)


def syncs(bench, count):
    """Sends SYNCs, 20 ms apart."""
    for _ in range(count):
        bench.network.sync.transmit()
        time.sleep(0.02)
    time.sleep(0.05)


def gaps(frames):
    """The times between frames, in seconds of the simulator."""
    times = [frame.timestamp for frame in frames]
    return [later - earlier for earlier, later in zip(times, times[1:])]
