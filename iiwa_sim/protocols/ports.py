"""The names of the protocols and their usual ports. Imports nothing else."""

MAX_PORT = 65535
IIWA = "iiwa"
KRC4 = "krc4"
DEFAULT_PROTOCOL = IIWA
DEFAULT_PORTS = {
    IIWA: 30000,
    KRC4: 54600,  # the usual port of KUKA's EKI
}
