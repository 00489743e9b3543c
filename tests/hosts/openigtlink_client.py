"""A client of examples/openigtlink.cpp by another implementation of the protocol (pyigtl, PyPI):

    python3 tests/hosts/openigtlink_client.py PATH/TO/openigtlink

It brings the ball from outside onto the lobe, jumps into the body, goes on, and leaves. What comes back is held against the geometry of
the ball: no point of the surface may be inside it. Ends with 1 where something is wrong.
"""

import struct
import subprocess
import sys
import time

import numpy as np
import pyigtl
from pyigtl import messages

RADIUS, DEEP = 10.0, 6.0  # mm


class Surface(messages.MessageBase):
    """POLYDATA with points and triangles, which pyigtl 0.3.4 only sends."""

    def _unpack_content(self, content):
        counts = struct.unpack(">10I", content[:40])
        points, polygons = counts[0], counts[5]
        at = 40 + 12 * points
        self.points = np.frombuffer(content[40:at], dtype=">f4").reshape(-1, 3).astype(float)
        at += counts[2] + counts[4]
        cells = np.frombuffer(content[at : at + counts[6]], dtype=">u4").reshape(polygons, 4)
        assert (cells[:, 0] == 3).all(), "not triangles"
        self.triangles = cells[:, 1:].astype(int)


messages.message_type_to_class_constructor["POLYDATA"] = Surface


def check(what, holds):
    print(("ok: " if holds else "WRONG: ") + what)
    if not holds:
        sys.exit(1)


class Client:
    def __init__(self, port):
        self.link = pyigtl.OpenIGTLinkClient("127.0.0.1", port)
        self.frames = 0

    def put(self, at):
        matrix = np.eye(4)
        matrix[:3, 3] = at
        self.link.send_message(pyigtl.TransformMessage(matrix, device_name="Instrument"))

    def frame(self):
        """Points of the surface, mm; force, N; the status in words."""
        surface = self.link.wait_for_message("Tissue", timeout=5)
        reaction = self.link.wait_for_message("Reaction", timeout=5)
        check("messages come", surface is not None and reaction is not None) if not surface or not reaction else None
        self.frames += 1
        self.surface = surface
        force, _, words = reaction.string.split(",", 2)
        return surface.points, np.array([float(part) for part in force.split()[:3]]), words.strip()

    def move(self, start, end, seconds):
        begin = time.monotonic()
        while (share := (time.monotonic() - begin) / seconds) < 1.0:
            self.put(start + share * (end - start))
            answer = self.frame()
        self.put(end)
        for _ in range(60):
            answer = self.frame()
        return answer


def main():
    host = subprocess.Popen([sys.argv[1], "--port", "0"], stdout=subprocess.PIPE, text=True)
    try:
        client = Client(int(host.stdout.readline().split()[-1]))
        rest, force, words = client.frame()
        triangles = client.surface.triangles
        check(f"{len(rest)} points in {np.ptp(rest, axis=0).round(1)} mm, {len(triangles)} triangles", len(rest) > 1000)
        check("the surface is closed", len(triangles) == 2 * len(rest) - 4)
        corners = rest[triangles]
        volume = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6.0
        check(f"its outside is outside: {volume / 1e3:.1f} cm^3", volume > 1e5)
        check("nothing moves without a ball", not force.any() and words == "done")

        top = rest[rest[:, 2].argmax()]
        above, deep = (top + [0.0, 0.0, RADIUS + way] for way in (2.0, -DEEP))
        start, frames = time.monotonic(), client.frames
        points, force, words = client.move(above, deep, 1.0)
        rate = (client.frames - frames) / (time.monotonic() - start)
        inside = RADIUS - np.linalg.norm(points - deep, axis=1)
        moved = np.linalg.norm(points - rest, axis=1)
        check(f"pressed: {moved.max():.2f} mm, {force[2]:.3f} N up, {rate:.0f} frames a second", moved.max() > 0.5 * DEEP)
        check(f"no point is inside the ball by more than {inside.max():.4f} mm", inside.max() < 0.05)
        check("it pushes the ball up", force[2] > 0.05 and force[2] > 3 * abs(force[:2]).max() and words == "done")

        client.put(rest.mean(axis=0))
        words = {words for _, _, words in (client.frame() for _ in range(10))}
        check(f"a jump into the body is refused or told: {sorted(words)}", bool(words - {"done"}))

        client.move(deep, above, 0.5)
        # A second is enough where nothing else computes.
        for _ in range(300):
            points, force, words = client.frame()
            back = np.linalg.norm(points - rest, axis=1).max()
            if is_back := back < 0.05 and not force.any() and words == "done":
                break
        check(f"it comes back to {back:.3f} mm, without force", is_back)
        client.link.stop()
        time.sleep(0.2)
    finally:
        host.terminate()
    print("host:", host.stdout.read().strip())


main()
