"""What runs on a host in these tests: says who it is, then sends back what it gets."""

import os
import socket
import sys
import threading

PORT = 7000


def datagrams(udp: socket.socket) -> None:
    while True:
        data, sender = udp.recvfrom(2048)
        udp.sendto(data, sender)


def main() -> None:
    udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    udp.bind(("0.0.0.0", PORT))
    threading.Thread(target=datagrams, args=(udp,), daemon=True).start()
    server = socket.create_server(("0.0.0.0", PORT))
    sys.stdout.write(f"{socket.gethostname()} {len(os.listdir('/dev/shm'))}\n")
    sys.stdout.flush()
    while True:
        connection, _ = server.accept()
        while data := connection.recv(2048):
            connection.sendall(data)


if __name__ == "__main__":
    sys.exit(main())
