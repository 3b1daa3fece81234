import eds

eds.COMMON.into("zlim42c")
