import eds

eds.COMMON.into("mjoint")
