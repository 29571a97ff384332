"""A free TCP port of this machine for a server of one's own."""
import random
import socket


def free_port():
    """Below those that Linux gives to outgoing connections, so that none gets it before its server listens."""
    for _ in range(1000):
        port = random.SystemRandom().randint(15000, 32000)
        with socket.socket() as probe:
            try:
                probe.bind(("127.0.0.1", port))
                return port
            except OSError:
                pass
    raise RuntimeError("no free port")
