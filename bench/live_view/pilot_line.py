"""The line between a page and its server, as a relay that reads the pilot's commands, can be cut without either end being told, and can be narrow."""
import collections
import json
import socket
import threading
import time


class Narrow(threading.Thread):
    """One way of a line, for all connections: pieces leave in the order in which they came, so many bytes a second; WAITING bytes wait at most."""

    WAITING, PIECE = 1 << 16, 4096

    def __init__(self, bytes_per_s):
        super().__init__(daemon=True)
        self.bytes_per_s, self.carried, self.waiting = bytes_per_s, 0, 0
        self.pieces, self.changed = collections.deque(), threading.Condition()
        self.start()

    def carry(self, data, target):
        with self.changed:
            self.changed.wait_for(lambda: self.waiting < self.WAITING)
            self.pieces.append((data, target))
            self.waiting += len(data)
            self.changed.notify_all()

    def run(self):
        free_at = time.monotonic()
        while True:
            with self.changed:
                self.changed.wait_for(lambda: self.pieces)
                data, target = self.pieces.popleft()
            free_at = max(free_at, time.monotonic()) + len(data) / self.bytes_per_s
            time.sleep(max(0, free_at - time.monotonic()))
            try:
                target.sendall(data)
            except OSError:
                pass  # its connection has ended
            with self.changed:
                self.waiting -= len(data)
                self.carried += len(data)
                self.changed.notify_all()


class Line:
    """Relays connections of 127.0.0.1 to a port. `inputs`: when a velocity passed and when its input was made (monotonic, s)."""

    def __init__(self, port, bytes_per_s=0):
        self.port, self.is_cut, self.inputs, self.sockets = port, False, [], []
        self.up, self.down = (Narrow(bytes_per_s), Narrow(bytes_per_s)) if bytes_per_s else (None, None)
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.url = f"http://127.0.0.1:{self.listener.getsockname()[1]}/"
        threading.Thread(target=self._accept, daemon=True).start()

    def close(self):
        for one in [self.listener, *self.sockets]:
            one.close()

    def _accept(self):
        while True:
            try:
                client = self.listener.accept()[0]
                server = socket.create_connection(("127.0.0.1", self.port))
            except OSError:
                return
            for one in (client, server):
                one.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self.sockets += [client, server]
            threading.Thread(target=self._relay, args=(client, server, self.up, PilotReader(self.inputs)), daemon=True).start()
            threading.Thread(target=self._relay, args=(server, client, self.down), daemon=True).start()

    def _relay(self, source, target, narrow, reader=None):
        try:
            while data := source.recv(narrow.PIECE if narrow else 1 << 16):
                if self.is_cut:
                    continue
                if reader:
                    reader.read(data)
                if narrow:
                    narrow.carry(data, target)
                else:
                    target.sendall(data)
        except OSError:
            pass
        for one in (source, target):
            try:
                one.shutdown(socket.SHUT_RDWR)
            except OSError:
                pass


class PilotReader:
    """Finds the velocities in what a browser sends on /pilot."""

    def __init__(self, inputs):
        self.inputs, self.bytes, self.is_pilot = inputs, b"", None

    def read(self, data):
        if self.is_pilot is False:
            return
        self.bytes += data
        if self.is_pilot is None:
            if b"\r\n\r\n" not in self.bytes:
                return
            head, self.bytes = self.bytes.split(b"\r\n\r\n", 1)
            self.is_pilot = head.startswith(b"GET /pilot")
        while self.is_pilot and (message := self._next()) is not None:
            if message.get("kind") == "velocity":
                now = time.monotonic()
                self.inputs.append((now, now - message["age_ms"] / 1000))

    def _next(self):
        """The next whole message: masked, shorter than 64 kB; {} for one that is no text."""
        if len(self.bytes) < 2:
            return None
        size, at = self.bytes[1] & 127, 2
        if size == 126:
            size, at = int.from_bytes(self.bytes[2:4], "big"), 4
        if len(self.bytes) < at + 4 + size:
            return None
        mask, content = self.bytes[at:at + 4], self.bytes[at + 4:at + 4 + size]
        is_text, self.bytes = self.bytes[0] & 15 == 1, self.bytes[at + 4 + size:]
        return json.loads(bytes(byte ^ mask[i % 4] for i, byte in enumerate(content))) if is_text else {}
