import eds

eds.COMMON.into("zlac8030l")
