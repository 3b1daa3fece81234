"""Two axes that begin and end together, on a virtual bus; virtual time, so that it is over at once.

    python examples/group_of_two.py
"""

import ferrodrive

world = ferrodrive.World()                      # or Network("socketcand://127.0.0.1:29536/can0")
world.add("m4230e17b50", node=1)
world.add("zlim42c", node=2)
with ferrodrive.Network(world) as network:
    for node in (1, 2):
        network.wait_for(node)                  # it boots, as a real one: about a second
    network.sleep(1)
    axes = [
        ferrodrive.Axis(1, "m4230e17b50", mode="ip", velocity_rpm=20, range_deg=(-180, 180)),
        ferrodrive.Axis(2, "zlim42c", mode="pv", velocity_rpm=30),
    ]
    with network.group(axes) as group:
        group.move([90, -45], within=3)         # degrees
        print(group.state()["axes"])
