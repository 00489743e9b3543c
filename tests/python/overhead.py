"""What Python adds to exact steps of the lobe at ten steps a call, over the same calls in C, from runs in turn:

    python3 tests/python/overhead.py INCLUDE LIBRARY

with the folder of supple.h and a libsupple.so. Needs a C compiler. Prints the median ratio; ends with 1 above 5 %.
"""

import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

import supple

ROOT = pathlib.Path(__file__).parents[2]
PAIRS, CALLS = 101, 50


def main():
    include, library = (pathlib.Path(word).absolute() for word in sys.argv[1:3])
    mesh = supple.Mesh.read(ROOT / "meshes" / "lobe.msh")
    liver = supple.Material("exponential", a=1500.0, b=8.023, d=40000.0, density=1060.0)
    scene = supple.Scene(mesh, liver, fixed=mesh.points[:, 1] > 0.03)
    simulation = supple.Simulation(scene, step=1e-4, damping=20.0, gravity=(0.0, 0.0, -9.81))
    with tempfile.TemporaryDirectory() as folder:
        header, program = pathlib.Path(folder, "lobe_mesh.h"), pathlib.Path(folder, "overhead")
        subprocess.run([sys.executable, ROOT / "tools" / "mesh_to_c.py", ROOT / "meshes" / "lobe.msh", header], check=True)
        source = ROOT / "tests" / "python" / "overhead.c"
        flags = ["-O2", f"-I{folder}", f"-I{include}", "-o", program]
        subprocess.run(["cc", source, library, *flags, f"-Wl,-rpath,{library.parent}", "-lm"], check=True)
        other = subprocess.Popen([program], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        ratios, times = [], []
        for _ in range(PAIRS):
            start = time.perf_counter()
            for _ in range(CALLS):
                simulation.take(10)
            here = 1e6 * (time.perf_counter() - start) / CALLS
            other.stdin.write("\n")
            other.stdin.flush()
            there = float(other.stdout.readline())
            ratios.append(here / there)
            times.append(there)
        other.stdin.close()
    more = 100.0 * (statistics.median(ratios) - 1.0)
    print(f"ten steps: {statistics.median(times):.1f} us in C, {more:+.2f} % in Python")
    sys.exit(more > 5.0)


main()
