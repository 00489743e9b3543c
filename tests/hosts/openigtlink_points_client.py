"""A client of examples/openigtlink_points.py, which plays a tracker:

    python3 tests/hosts/openigtlink_points_client.py

It sends points at rest, moves them rigidly and then by a bend, some of them missing, sends what is wrong in many ways, leaves and comes
back. What the host sends is held against the motion that was played. Ends with 1 where something is wrong.
"""

import os
import pathlib
import socket
import struct
import subprocess
import sys
import time

import numpy as np
import pyigtl
import supple

ROOT = pathlib.Path(__file__).parents[2]
RAS = np.array([-1.0, -1.0, 1.0])
TUMOUR, RADIUS = np.array([20.0, 0.0, 32.0]), 8.0  # mm, LPS
random = np.random.default_rng(5)


def check(what, holds):
    print(("ok: " if holds else "WRONG: ") + what)
    if not holds:
        sys.exit(1)


def off(a, b):
    """Mean distance, mm."""
    return np.linalg.norm(a - b, axis=1).mean()


class Client:
    def __init__(self, port):
        self.link = pyigtl.OpenIGTLinkClient("127.0.0.1", port)

    def put(self, name, points):
        self.link.send_message(pyigtl.PointMessage(list(points.values()), list(points), device_name=name))

    def latest(self, name, timeout=3.0):
        self.link.incoming_messages.pop(name, None)
        return self.link.wait_for_message(name, timeout)

    def status(self, wanted="", seconds=3.0):
        """The first status that has these words, or the last one."""
        begin, words = time.monotonic(), ""
        while time.monotonic() < begin + seconds:
            message = self.latest("Status")
            words = message.string if message else "nothing comes"
            if wanted in words:
                break
        return words

    def told(self, what, wanted):
        words = self.status(wanted)
        check(f"{what}: {words}", wanted in words)

    def play(self, motion, seconds, rest, missing=0.0):
        """Points along a motion of shares from 0 to 1, then at its end; the tumour's largest mean distance on the way, mm."""
        begin, worst = time.monotonic(), 0.0
        while (share := (time.monotonic() - begin) / seconds) < 1.5:
            share = min(share, 1.0)
            seen = {name: motion(at[None], share)[0] for name, at in rest.items() if share == 1.0 or random.random() >= missing}
            self.put("Seen", seen)
            matrix = self.latest("Tumour").matrix
            worst = max(worst, off(moved(matrix, BALL), motion(BALL, share)))
        return worst

    def leads_back(self, motion, allowed):
        """The image, from places now to places in the CT; at the surface it is limited by the grid."""
        image = self.latest("Displacement")
        inside, all_nodes = (off(from_image(image, motion(at)), at) for at in (BALL, NODES))
        what = f"the field of {image.image.shape} points leads back to the CT"
        what += f": {inside:.3f} mm off in the tumour, {all_nodes:.2f} mm at all nodes"
        check(what, image.world_coordinate_system == "ras" and inside < allowed and all_nodes < allowed + 1.0)


def processor_seconds(process):
    """What it has used: on a machine that does other work as well, time on the clock says nothing."""
    of = pathlib.Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(of[11]) + int(of[12])) / os.sysconf("SC_CLK_TCK")


def moved(matrix, points):
    return points @ matrix[:3, :3].T + matrix[:3, 3]


def turned(points, share):
    """By 40 degrees about an oblique axis, and 70 mm away."""
    axis, angle = np.array([1.0, 2.0, -1.0]) / np.sqrt(6.0), np.radians(40.0) * share
    cross = np.cross(np.eye(3), axis)
    turn = np.eye(3) - np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross
    return points @ turn.T + share * np.array([40.0, -30.0, 50.0])


def bent(points, share):
    """From where that ends: ends of the organ go up by as much as 19 mm, in the axes at rest."""
    x, y, z = points.T
    return turned(np.column_stack([x, y + share * 0.05 * x, z + share * 0.0025 * x * x]), 1.0)


def from_image(image, points):
    """Where the tissue at these places is in the CT, by linear interpolation."""
    index = np.linalg.solve(image.ijk_to_world_matrix, np.column_stack([points, np.ones(len(points))]).T)[:3].T
    low = np.floor(index).astype(int)
    found = np.zeros_like(points)
    for corner in np.ndindex(2, 2, 2):
        weight = np.prod(np.where(corner, index - low, 1.0 - index + low), axis=1)
        found += weight[:, None] * image.image[tuple((low + corner).T[::-1])]
    return points + found


mesh = supple.Mesh.read(ROOT / "meshes" / "lobe.msh")
NODES = 1e3 * RAS * mesh.points.astype(float)
surface, chosen = NODES[np.unique(mesh.boundary())], [0]
for _ in range(13):
    chosen.append(int(np.linalg.norm(surface[:, None] - surface[chosen], axis=2).min(axis=1).argmax()))
POINTS = {f"P{n}": at for n, at in enumerate(surface[chosen])}
BALL = random.normal(size=(100, 3))
BALL = RAS * TUMOUR + RADIUS * BALL / np.linalg.norm(BALL, axis=1)[:, None] * random.random((100, 1)) ** (1 / 3)


def wrong_messages(client, port):
    """Each is told, and the host goes on."""
    P = POINTS
    before = client.latest("Tumour").matrix
    seen = {name: turned(at[None], 1.0)[0] for name, at in P.items()}
    for what, changed, words in [
        ("a place that is NaN", seen | {"P3": [np.nan, 0.0, 0.0]}, "'P3' has no place"),
        ("a place beyond reason", seen | {"P4": [1e30, 0.0, 0.0]}, "'P4' has no place"),
        ("an unknown name", seen | {"Q": [0.0, 0.0, 0.0]}, "'Q' is not a point of Rest"),
        ("no known name", {"Q": [0.0, 0.0, 0.0]}, "no point is seen of 14"),
    ]:
        client.put("Seen", changed)
        client.told(what, words)
    client.link.send_message(pyigtl.PointMessage([*seen.values(), [0.0, 0.0, 0.0]], [*seen, "P5"], device_name="Seen"))
    client.told("a name twice", "'P5' stands for several points")
    client.put("Rest", {name: P[name] for name in ("P0", "P1")})
    client.told("two points at rest, once there are others", "Rest: 2 points, 3 to 500 are needed")

    message = pyigtl.PointMessage([0.0, 0.0, 0.0], ["x"], device_name="Seen").pack()
    with socket.create_connection(("127.0.0.1", port)) as other:
        other.sendall(message[:58] + b"\xff" * 136)
        client.told("a name in no known alphabet", "cannot be read")
        other.sendall(message[:30])
        time.sleep(0.05)
        other.sendall(message[30:])
        client.told("a header in two parts", "'x' is not a point of Rest")
        other.sendall(struct.pack("> H 12s 20s II Q Q", 1, b"POINT", b"Seen", 0, 0, 1 << 60, 0))
        other.settimeout(5.0)
        while other.recv(1 << 16):
            pass
        client.told("a message of 2^60 bytes", "bytes, the client was let go")
    with socket.create_connection(("127.0.0.1", port)) as other:
        other.sendall(b"GET / HTTP/1.1\r\n" + bytes(range(256)))
    client.put("Seen", seen)
    client.told("after all that", "ok, 14 of 14 points seen")
    time.sleep(0.3)
    shift = off(moved(client.latest("Tumour").matrix, BALL), moved(before, BALL))
    check(f"the tumour is {shift:.3f} mm from before", shift < 0.1)


def main():
    host = subprocess.Popen(
        [sys.executable, ROOT / "examples" / "openigtlink_points.py", ROOT / "meshes" / "lobe.msh", "--scale", "1", "--port", "0",
         "--tumour", *map(str, [*TUMOUR, RADIUS])],
        stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    try:
        port = int(host.stdout.readline().split()[-1])
        client, P = Client(port), POINTS
        client.told("before anything", 'send POINT "Rest"')
        client.put("Seen", P)
        client.told("seen before rest", "Seen: there are no points at rest")
        for what, names, change, words in [
            ("two points at rest", ["P0", "P1"], {}, "3 to 500 are needed"),
            ("a point without a place", list(P), {"P2": [np.nan, 0.0, 0.0]}, "'P2' has no place"),
            ("points in other axes", list(P), {name: RAS * at for name, at in P.items()}, "mm outside the organ"),
        ]:
            client.put("Rest", {name: P[name] for name in names} | change)
            client.told(what, words)
        client.put("Rest", P)
        client.told("points at rest", "no point is seen of 14")
        client.put("Seen", {name: P[name] for name in ("P0", "P1")})
        client.told("two points seen", "2 of 14 points are seen, at least 3 are needed")
        check("no transform before enough is seen", client.latest("Tumour", 0.2) is None)

        start = {name: turned(at[None], 0.5)[0] for name, at in P.items()}
        client.put("Seen", start)
        client.told("seen far away", "ok, 14 of 14 points seen")
        away = off(moved(client.latest("Tumour").matrix, BALL), turned(BALL, 0.5))
        check(f"the tumour is {away:.3f} mm from where it is, of {off(BALL, turned(BALL, 0.5)):.1f} mm", away < 0.1)

        begin, frames = processor_seconds(host.pid), 60
        for _ in range(frames):
            client.put("Seen", start)
            client.latest("Tumour")
        spent = (processor_seconds(host.pid) - begin) / frames
        check(f"a frame takes {1e3 * spent:.1f} ms of the processor", spent < 1.0 / 60.0)
        worst = client.play(lambda points, share: turned(points, 0.5 + 0.5 * share), 3.0, P, missing=0.3)
        end = off(moved(client.latest("Tumour").matrix, BALL), turned(BALL, 1.0))
        check(f"moved rigidly, 30 % missing: {worst:.2f} mm off on the way, {end:.3f} mm at its end", worst < 2.0 and end < 0.1)
        client.leads_back(lambda points: turned(points, 1.0), 0.02)
        wrong_messages(client, port)

        worst = client.play(bent, 2.0, P, missing=0.3)
        rigid = supple.rigid_fit(list(P.values()), bent(np.array(list(P.values())), 1.0))
        truth = bent(BALL, 1.0)
        own, others = off(moved(client.latest("Tumour").matrix, BALL), truth), off(rigid(BALL), truth)
        check(f"bent: {worst:.2f} mm off on the way, {own:.2f} mm at its end, a rigid fit of the points {others:.2f} mm", own < 0.25 * others)
        client.leads_back(lambda points: bent(points, 1.0), 1.0)

        client.told("no points for a second", "no point is seen of 14, the tissue stays where it is")
        stays = client.latest("Tumour").matrix
        client.link.stop()
        time.sleep(0.3)
        clients = [Client(port), Client(port)]
        for client in clients:
            again = client.latest("Tumour")
            check("after another connection it goes on", again is not None and np.allclose(again.matrix, stays, atol=1e-4))
        clients[1].put("Seen", {name: at for name, at in P.items()})
        clients[0].told("a jump by 80 mm and 40 degrees, seen by another client", "ok, 14 of 14")
        clients[1].play(lambda points, share: points, 1.0, P)
        home = off(moved(clients[0].latest("Tumour").matrix, BALL), BALL)
        check(f"back at rest: {home:.3f} mm off", home < 0.1)
        check("the host runs", host.poll() is None)
        for client in clients:
            client.link.stop()
    finally:
        host.terminate()


main()
