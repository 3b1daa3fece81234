"""PDOs, their mapping and their transmission types."""

from zl import pdo

pdo.COMMON.into("zlac8030l")
