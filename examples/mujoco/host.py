"""A host without a library: SDO, PDO and SYNC through an adapter of the world. It is copied with the world, so that a snapshot has it."""

class Host:
    """An adapter, and what is said through it. All of it moves a world by itself or through `wait`."""

    def __init__(self, world, wait=None):
        self.world = world
        self.adapter = world.add_probe()
        self.wait = wait or world.run_for
        #: The last bytes of each identifier.
        self.heard = {}

    def send(self, identifier, data=b""):
        self.world.send(self.adapter, (identifier, False, False, len(data), bytes(data)))

    def hear(self):
        """Takes what has arrived."""
        while (got := self.world.poll(self.adapter)) is not None:
            _, (identifier, _, _, _, data) = got
            self.heard[identifier] = data

    def write(self, node, index, subindex, value, size):
        """An expedited download (CiA 301, 7.2.4.3.3)."""
        command = 0x23 | (4 - size) << 2
        self.heard.pop(0x580 + node, None)
        payload = value.to_bytes(size, "little", signed=value < 0)
        self.send(0x600 + node, bytes([command, index & 0xFF, index >> 8, subindex]) + payload.ljust(4, b"\0"))
        for _ in range(200):
            self.wait(0.001)
            self.hear()
            if answer := self.heard.get(0x580 + node):
                if answer[0] == 0x80:
                    code = int.from_bytes(answer[4:], "little")
                    raise RuntimeError(f"node {node} refuses {index:04X}h:{subindex:02X}: {code:08X}h")
                return
        raise TimeoutError(f"node {node} does not answer")

    def map_pdo(self, node, communication, mapping, cob_id, objects, kind=1):
        """Maps `objects` (index, sub-index, bits) into a PDO of transmission type `kind` (CiA 301, 7.5.2.35 to 38)."""
        self.write(node, communication, 1, 0x8000_0000 | cob_id, 4)
        self.write(node, mapping, 0, 0, 1)
        for place, (index, subindex, bits) in enumerate(objects, 1):
            self.write(node, mapping, place, index << 16 | subindex << 8 | bits, 4)
        self.write(node, mapping, 0, len(objects), 1)
        self.write(node, communication, 2, kind, 1)
        self.write(node, communication, 1, cob_id, 4)
