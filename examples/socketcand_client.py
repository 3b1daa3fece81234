"""A client of `ferrodrive sim --drive zlac8030l@4 --serve socketcand://127.0.0.1:29536`, with python-can: enables the drive and turns it."""

import time

import can

bus = can.Bus(interface="socketcand", host="127.0.0.1", port=29536, channel="can0", tcp_tune=True)


def ask(*data):
    """Send an SDO request to node 4 and return the answer; None while the drive boots."""
    bus.send(can.Message(arbitration_id=0x604, data=data, is_extended_id=False))
    while message := bus.recv(timeout=0.5):
        if message.arbitration_id == 0x584 and message.data[1:4] == bytes(data[1:4]):  # for this object
            return bytes(message.data)
    return None


# It boots for about a second, and then checks its supply and sensors: statusword 6041h, not ready to switch on.
while not (answer := ask(0x40, 0x41, 0x60, 0x00, 0, 0, 0, 0)) or answer[4] & 0x4F == 0:
    time.sleep(0.05)

for request in (
    (0x2F, 0x60, 0x60, 0x00, 0x03, 0, 0, 0),  # profile velocity mode
    (0x2B, 0x40, 0x60, 0x00, 0x06, 0, 0, 0),  # enable: shutdown,
    (0x2B, 0x40, 0x60, 0x00, 0x07, 0, 0, 0),  # switch on,
    (0x2B, 0x40, 0x60, 0x00, 0x0F, 0, 0, 0),  # enable operation
    (0x23, 0xFF, 0x60, 0x00, 0x64, 0, 0, 0),  # 100 r/min
):
    print(ask(*request).hex(" "))  # 60 ..: done
bus.shutdown()
