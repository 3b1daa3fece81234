"""Writes path.csv for `ferrodrive group follow`: three joint angles in degrees, a row for each 10 ms, from rest to rest."""

import math

PERIOD_S = 0.010
TIME_S = 4.0


def share(time_s):
    """0 to 1 with speed and acceleration of zero at both ends (quintic)."""
    s = time_s / TIME_S
    return s * s * s * (10 - 15 * s + 6 * s * s)


with open("path.csv", "w", encoding="ascii", newline="\n") as file:
    file.write("t_s,1.angle_deg,2.angle_deg,3.angle_deg\n")
    for row in range(round(TIME_S / PERIOD_S) + 1):
        time_s = row * PERIOD_S
        angle = math.tau * share(time_s)
        joints = 30 * math.sin(angle), 15 * math.sin(2 * angle), 20 * (1 - math.cos(angle)) / 2
        # Not -0.0.
        file.write(",".join([f"{time_s:.2f}", *(f"{round(value, 5) + 0.0:.5f}" for value in joints)]) + "\n")
