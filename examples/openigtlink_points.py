#!/usr/bin/env python3
"""A host for tracked points (OpenIGTLink 2, http://openigtlink.org): the model of an organ follows them, its tumour and its CT with it.

    pip install pyigtl==0.3.4
    python3 openigtlink_points.py organ.msh --tumour 40 -30 55 8

Clients (3D Slicer's OpenIGTLinkIF, a tracker's server, a script; one or several at a time) send

    POINT "Rest"             where the tracked points are on the organ in the CT, each with a name of its own
    POINT "Seen"             where they are seen now, by the same names; one that is missing, or NaN, is not seen now

and get

    TRANSFORM "Tumour"       60 times a second: the rigid motion nearest to that of the tumour, from the CT to now
    STRING "Status"          with it: what the steps say, points seen, the largest gap and whose it is, what is wrong with a message
    IMAGE "Displacement"     twice a second: from a place now to where its tissue is in the CT, three float32 a point of a coarse grid

Messages are in mm and RAS axes, as Slicer has them, or LPS (--axes LPS). The mesh is in mm and LPS, as examples/organ_mesh.py writes it,
and so is the tumour: a sphere (x y z radius), or a text file of points (rows x y z).
"""

import argparse
import collections
import contextlib
import socket
import socketserver
import struct
import threading
import time

import numpy as np
import pyigtl
import supple
from pyigtl.messages import MessageBase

FRAME, IMAGE, FRESH = 1 / 60, 0.5, 1.0  # s: from one to the next; how long points count as seen
SPACING, MARGIN = 4.0, 24.0  # mm, of the image, and around the organ
OUTSIDE, FAR, MOST = 10.0, 1e4, 500  # mm, of points at rest from the organ, of any from the origin; and how many at most


class Clients(socketserver.ThreadingTCPServer):
    """Messages are pyigtl's, connections are not: its server sends nothing while messages come faster than every 10 ms, loses a header that
    comes in two parts, serves one client at a time, and lets it go for a message that it cannot read."""

    daemon_threads = allow_reuse_address = True

    def __init__(self, port):
        super().__init__(("", port), None)
        self.sockets, self.messages, self.wrong = set(), {}, ""
        threading.Thread(target=self.serve_forever, daemon=True).start()

    def finish_request(self, client, _):
        """All that a client sends, in a thread of its own."""
        client.setsockopt(socket.SOL_SOCKET, socket.SO_SNDTIMEO, struct.pack("ll", 0, 50_000))  # s, us: a client that does not read is let go
        client.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 1 << 23)
        self.sockets.add(client)
        with contextlib.suppress(OSError, ValueError), client.makefile("rb") as stream:
            while len(header := stream.read(MessageBase.IGTL_HEADER_SIZE)) == MessageBase.IGTL_HEADER_SIZE:
                fields = MessageBase.parse_header(header)
                if fields["body_size"] > 1 << 24:
                    self.wrong = f"{fields['device_name']}: {fields['body_size']} bytes, the client was let go"
                    break
                body, message = stream.read(fields["body_size"]), MessageBase.create_message(fields["message_type"])
                try:
                    if isinstance(message, pyigtl.PointMessage) and fields["device_name"] in ("Rest", "Seen"):
                        message.unpack(fields, body)
                        self.messages[message.device_name], self.wrong = message, ""
                except Exception as problem:  # whatever pyigtl comes across
                    self.wrong = f"{fields['device_name']}: it cannot be read: {problem}"
        self.sockets.discard(client)

    def send(self, messages):
        data = b"".join(message.pack() for message in messages)
        for client in list(self.sockets):
            try:
                client.sendall(data)
            except OSError:
                self.sockets.discard(client)
                self.shutdown_request(client)


class Organ:
    """The model: metres and the axes of the mesh within, mm and the axes of the messages outside; `scale` leads from these to those."""

    def __init__(self, mesh, tumour, scale):
        tissue = supple.Material.from_moduli(young=3000.0, poisson=0.45, density=1060.0)
        self.body, self.scale = supple.Simulation(supple.Scene(mesh, tissue, element="nodal-strain"), damping=20.0), scale
        self.tumour, self.pulls, self.is_placed = self.body.locate(tumour), None, False

    def read(self, message):
        """Places by name, and what is wrong with others."""
        places, wrong, times = {}, {}, collections.Counter(message.names)
        for name, place in zip(message.names, message.positions):
            if times[name] > 1:
                wrong[name] = f"'{name}' stands for several points"
            elif not (np.abs(place) < FAR).all():
                wrong[name] = f"'{name}' has no place: {place}"
            else:
                places[name] = self.scale * place
        return places, list(wrong.values())

    def rest(self, message):
        places, wrong = self.read(message)
        if wrong or not 3 <= len(places) <= MOST:
            raise ValueError("; ".join(wrong[:3]) or f"{len(places)} points, 3 to {MOST} are needed")
        at = np.array(list(places.values()))
        off = 1e3 * self.body.locate(at).distances
        if off.max() > OUTSIDE:
            raise ValueError(f"'{list(places)[off.argmax()]}' is {off.max():.0f} mm outside the organ: is it in mm, and in these axes?")
        pulls = self.body.pull(at, stiffness=1000.0)
        if self.pulls:
            self.pulls.release()
        self.pulls, self.names, self.at, self.is_placed = pulls, list(places), at, False
        self.targets, self.time = np.full_like(at, np.nan), 0.0

    def seen(self, message):
        if not self.pulls:
            raise ValueError('there are no points at rest: send POINT "Rest" before')
        places, wrong = self.read(message)
        wrong += [f"'{name}' is not a point of Rest" for name in places if name not in self.names]
        self.targets, self.time = np.array([places.get(name, [np.nan] * 3) for name in self.names]), time.monotonic()
        if wrong:
            raise ValueError("; ".join(wrong[:3]))

    def frame(self):
        """Moves on, and says how it went."""
        if not self.pulls:
            return 'no points at rest: send POINT "Rest"'
        count, points = np.isfinite(self.targets[:, 0]).sum(), self.body.scene.mesh.points
        if not count or time.monotonic() - self.time > FRESH:
            return f"no point is seen of {len(self.names)}, the tissue stays where it is"
        try:
            if not self.is_placed:
                self.body.set_displacements(supple.rigid_fit(self.at, self.targets)(points) - points)
            self.pulls.move(self.targets, within=FRAME if self.is_placed else 0.0)
            status = (self.body.advance(FRAME) if self.is_placed else self.body.settle(1e-4)).status
            self.is_placed = True
        except supple.Error as problem:
            self.is_placed = False  # the next frame begins anew
            return str(problem)
        gaps = 1e3 * np.linalg.norm(self.pulls.gaps, axis=1)
        return f"{status}, {count} of {len(gaps)} points seen, largest gap {gaps.max():.1f} mm at '{self.names[gaps.argmax()]}'"

    def transform(self):
        rigid, matrix = supple.rigid_fit(self.tumour.rest, self.tumour.positions), np.eye(4)
        matrix[:3, :3] = rigid.rotation * self.scale / self.scale[:, None]
        matrix[:3, 3] = rigid.translation / self.scale
        return pyigtl.TransformMessage(matrix, device_name="Tumour")

    def image(self):
        signs, now, matrix = np.sign(self.scale), self.body.positions / self.scale, np.diag([SPACING] * 3 + [1.0])
        low, high = now.min(axis=0) - MARGIN, now.max(axis=0) + MARGIN
        grid = supple.Grid(signs * low, (SPACING,) * 3, np.ceil((high - low) / SPACING).astype(int) + 1, np.diag(signs))
        matrix[:3, 3], axes = low, "lps" if signs[0] > 0 else "ras"
        return pyigtl.ImageMessage((self.body.field(grid).values * signs).astype(np.float32), matrix, axes, device_name="Displacement")


def points_of(tumour):
    """m"""
    if len(tumour) == 1:
        return 1e-3 * np.loadtxt([line.replace(",", " ") for line in open(tumour[0])], ndmin=2)
    if len(tumour) != 4:
        raise ValueError("the tumour is a file, or four numbers: x y z radius")
    *centre, radius = map(float, tumour)
    ball = np.stack(np.meshgrid(*[np.linspace(-1.0, 1.0, 7)] * 3), axis=-1).reshape(-1, 3)
    return 1e-3 * (centre + radius * ball[np.linalg.norm(ball, axis=1) <= 1.0])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("mesh")
    parser.add_argument("--scale", type=float, default=0.001, help="metres of the unit of the mesh (default: 0.001)")
    parser.add_argument("--tumour", nargs="+", required=True, help="FILE, or X Y Z RADIUS: mm, in the axes of the mesh")
    parser.add_argument("--axes", choices=["RAS", "LPS"], default="RAS", help="of the messages (default: RAS)")
    parser.add_argument("--port", type=int, default=18944)
    asked = parser.parse_args()
    signs = np.array([1.0, 1.0, 1.0] if asked.axes == "LPS" else [-1.0, -1.0, 1.0])
    try:
        organ = Organ(supple.Mesh.read(asked.mesh, scale=asked.scale), points_of(asked.tumour), 1e-3 * signs)
        organ.transform()  # that there are points enough
        if organ.tumour.distances.all():
            off = 1e3 * organ.tumour.distances.min()
            raise ValueError(f"the tumour is {off:.0f} mm outside the organ: is it in mm, and in the axes of the mesh?")
        clients = Clients(asked.port)
    except (OSError, ValueError) as problem:
        parser.error(str(problem))
    print("port", clients.server_address[1], flush=True)
    wrong, due, image = {}, time.monotonic(), 0.0
    while True:
        for name, take in (("Rest", organ.rest), ("Seen", organ.seen)):
            if message := clients.messages.pop(name, None):
                wrong[name] = ""
                try:
                    take(message)
                except ValueError as problem:
                    wrong[name] = f"{name}: {problem}"
        said = "; ".join(filter(None, [organ.frame(), *wrong.values(), clients.wrong]))
        messages = [pyigtl.StringMessage(said.encode("ascii", "replace").decode(), device_name="Status")]  # pyigtl sends no other text
        if organ.is_placed:
            messages.append(organ.transform())
            if due > image + IMAGE:
                messages.append(organ.image())
                image = due
        clients.send(messages)
        due = max(due + FRAME, time.monotonic())
        time.sleep(max(0.0, due - time.monotonic()))


if __name__ == "__main__":
    with contextlib.suppress(KeyboardInterrupt):
        main()
