"""The simulator's servers and its world commands."""

import servers

servers.COMMON.into("zlim42c")
