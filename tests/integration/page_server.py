#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""What plumbline view serves, and what it refuses: page_server.py PROGRAM WORK"""
import http.client
import os
import socket
import subprocess
import sys
import time
from pathlib import Path


def check(condition, message):
    if not condition:
        raise AssertionError(message)


class View:
    """A server of a small cloud, at a port that is free."""

    def __init__(self, program, cloud, *options):
        self.process = subprocess.Popen([program, "view", cloud, "--http", "127.0.0.1:0", "-q", *options],
                                        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.address = self.process.stdout.readline().strip()
        if not self.address.startswith("http://127.0.0.1:"):
            raise AssertionError(f"it tells no address: {self.process.stderr.read()}")
        self.port = int(self.address.split(":")[2].split("/")[0])

    def get(self, path="/", method="GET", **headers):
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=20)
        connection.putrequest(method, path, skip_host="Host" in headers)
        for name, value in headers.items():
            connection.putheader(name, value)
        connection.endheaders()
        answer = connection.getresponse()
        return answer.status, answer.read(), dict(answer.getheaders())

    def raw(self):
        return socket.create_connection(("127.0.0.1", self.port), timeout=20)

    def descriptors(self):
        return len(os.listdir(f"/proc/{self.process.pid}/fd"))

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.terminate()
        check(self.process.wait(20) == 0, "it does not end in order")


def serves(view):
    status, page, headers = view.get()
    check(status == 200 and page.startswith(b"<!DOCTYPE html>") and b"pv-scene" in page, f"the page: {status}")
    check("connect-src 'self'" in headers["Content-Security-Policy"], "no policy")
    port = view.port
    for name, wanted in ((f"127.0.0.1:{port}", 200), (f"localhost:{port}", 200), ("example.org", 403),
                         (f"example.org:{port}", 403), ("127.0.0.1:1", 403), ("", 403)):
        check(view.get(Host=name)[0] == wanted, f"Host {name!r}: not {wanted}")
    for origin, wanted in ((f"http://localhost:{port}", 200), ("http://example.org", 403), ("null", 403)):
        check(view.get(Origin=origin)[0] == wanted, f"Origin {origin!r}: not {wanted}")
    for path in ("/../etc/passwd", "/..%2f..%2fetc/passwd", "/page/../../etc/passwd", "/other", "//", "/%00"):
        status, body, _ = view.get(path)
        check(status in (400, 403, 404) and b"root:" not in body, f"{path}: {status}")
    for method in ("POST", "PUT", "DELETE"):
        check(view.get(method=method)[0] in (400, 404, 405), method)


def two_hosts(view):
    """A second name behind the right one is no way round the check of names."""
    for names, wanted in ((["127.0.0.1"], b"200"), (["127.0.0.1", "example.org"], b"400"),
                          (["example.org", "127.0.0.1"], b"400"), (["127.0.0.1", "127.0.0.1"], b"400")):
        request = view.raw()
        hosts = "".join(f"Host: {name}:{view.port}\r\n" for name in names)
        request.sendall(f"GET / HTTP/1.1\r\n{hosts}\r\n".encode())
        check(request.recv(4096).split(b" ")[1] == wanted, f"Host {names}: not {wanted}")
        request.close()


def asks_for_its_token(program, cloud):
    with View(program, cloud, "--http-token", "secret") as view:
        check(view.address.endswith("/?token=secret"), view.address)
        for path, wanted in (("/", 401), ("/?token=", 401), ("/?token=secre", 401), ("/?token=secret2", 401),
                             ("/?token=secret", 200), ("/events", 401)):
            check(view.get(path)[0] == wanted, f"{path}: not {wanted}")
        check(view.get(Authorization="Bearer secret")[0] == 200, "Bearer")

    with View(program, cloud, "--http-token", "a&b#c d+e") as view:
        check(view.address.endswith("/?token=a%26b%23c%20d%2Be"), view.address)
        check(view.get(view.address[view.address.index("/?"):])[0] == 200, "the address that it prints does not open")


def warns_of_others(program, cloud):
    """Told before the page is made, if others than this machine reach it and nothing is asked for."""
    for host, options, warned in (("0.0.0.0", (), True), ("0.0.0.0", ("--http-token", "secret"), False),
                                  ("127.0.0.1", (), False), ("localhost", (), False)):
        process = subprocess.Popen([program, "view", cloud, "--http", f"{host}:0", *options],
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        process.stdout.readline()
        process.terminate()
        told = "everybody who reaches this address" in process.communicate()[1]
        check(told == warned, f"{host} {options}: {'a' if told else 'no'} warning")


def streams(view):
    """Eight streams, no more; a page comes all the same, at once."""
    request = f"GET /events HTTP/1.1\r\nHost: 127.0.0.1:{view.port}\r\n\r\n".encode()
    open_ones = []
    for _ in range(8):
        stream = view.raw()
        stream.sendall(request)
        check(b"text/event-stream" in stream.recv(4096), "no stream")
        open_ones.append(stream)
    check(view.get("/events")[0] == 503, "a ninth stream is not refused")
    before = time.monotonic()
    check(view.get()[0] == 200, "no page beside the streams")  # all of which are open and stay so
    took = time.monotonic() - before
    for stream in open_ones:
        stream.close()
    for _ in range(100):  # who has gone is found out with the next beat
        time.sleep(0.1)
        late = view.raw()
        late.sendall(request)
        if b"200 OK" in late.recv(4096):
            return took
        late.close()
    raise AssertionError("streams that were closed are not free again")


def crowds(view):
    """Slow and silent clients do not keep others out; sockets beyond the limit are closed unread."""
    idle = [view.raw() for _ in range(200)]
    time.sleep(0.2)
    most = view.descriptors()
    check(most <= 64, f"{most} descriptors")
    closed = 0
    for one in idle:
        one.settimeout(0.01)
        try:
            closed += one.recv(1) == b""
        except ConnectionError:
            closed += 1
        except OSError:
            pass
    check(closed >= 160, f"{closed} of 200 were closed")
    deadline = time.monotonic() + 10
    while time.monotonic() < deadline:  # those that say nothing go after a second
        try:
            if view.get()[0] == 200:
                break
        except OSError:
            time.sleep(0.1)
    else:
        raise AssertionError("silent clients keep others out")
    for one in idle:
        one.close()

    trickle = view.raw()
    taken = 0
    try:
        for letter in b"GET / HTTP/1.1\r\nX: " + 400 * b"a":
            trickle.sendall(bytes([letter]))
            taken += 1
            time.sleep(0.05)
    except ConnectionError:
        pass
    check(taken < 400, "a request that trickles is waited for")

    for _ in range(10000):  # without waiting for any
        one = socket.socket()
        one.setblocking(False)
        one.connect_ex(("127.0.0.1", view.port))
        one.close()
    check(view.get()[0] == 200, "after 10 000 connections it serves no more")
    check(view.descriptors() <= 64, "descriptors are lost")


def main():
    program, work = sys.argv[1], Path(sys.argv[2])
    work.mkdir(parents=True, exist_ok=True)
    cloud = work / "cloud.xyz"
    cloud.write_text("".join(f"{x / 10} {y / 10} {(x + y) % 3 / 50}\n" for x in range(60) for y in range(60)))
    with View(program, cloud) as view:
        serves(view)
        two_hosts(view)
        took = streams(view)
        crowds(view)
    asks_for_its_token(program, cloud)
    warns_of_others(program, cloud)
    for wrong in ("127.0.0.1:99999", "127.0.0.1:x", ":"):
        done = subprocess.run([program, "view", cloud, "--http", wrong], capture_output=True, text=True)
        check(done.returncode == 2 and "HOST:PORT" in done.stderr, f"--http {wrong}: {done.returncode} {done.stderr}")
    print(f"a page beside eight streams took {1000 * took:.0f} ms; refused what is to be refused")


if __name__ == "__main__":
    main()
