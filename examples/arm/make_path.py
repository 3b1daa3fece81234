"""Writes path.csv: three joint angles in degrees, a row for each 10 ms, from rest to rest."""

import math

PERIOD_S = 0.010
TIME_S = 4.0


def share(time_s):
    """0 to 1 with speed and acceleration of zero at both ends (quintic)."""
    s = time_s / TIME_S
    return s * s * s * (10 - 15 * s + 6 * s * s)


with open("path.csv", "w", encoding="ascii", newline="\n") as file:
    file.write("joint1_deg,joint2_deg,joint3_deg\n")
    for row in range(1, round(TIME_S / PERIOD_S) + 1):
        angle = math.tau * share(row * PERIOD_S)
        joints = 30 * math.sin(angle), 15 * math.sin(2 * angle), 20 * (1 - math.cos(angle)) / 2
        file.write(",".join(f"{value:.5f}" for value in joints) + "\n")
