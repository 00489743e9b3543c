"""The paper's bar as a NiftySim model, to time the same motion there: clamped at z = 0 and lifted by a force of 0.07 N at each
of its four free corners, neo-Hookean, 3e-5 s a step.

    python3 -m venv /tmp/nifty && /tmp/nifty/bin/pip install meshio==5.3.5
    supple simulate benches/bar.toml --out /tmp/bar
    /tmp/nifty/bin/python benches/niftysim.py /tmp/bar/frame_0000.vtu >bar.xml
    niftysim -x bar.xml -v -t

NiftySim (https://sourceforge.net/projects/niftysim) has to be built from its sources. Its constants are shear and bulk modulus,
2 c and 2 d here.
"""

import sys

import meshio


def lines(rows):
    return "\n".join(" ".join(map(str, row)) for row in rows)


def constraint(kind, axis, nodes, newton=None):
    magnitudes = "" if newton is None else f'<Magnitudes Type="UNIFORM">{newton}</Magnitudes>'
    shape = "" if newton is None else ' LoadShape="STEP"'
    return (
        f'  <Constraint Type="{kind}" DOF="{axis}"{shape} NumNodes="{len(nodes)}">\n'
        f"    <Nodes>{' '.join(map(str, nodes))}</Nodes>{magnitudes}\n  </Constraint>"
    )


def main():
    mesh = meshio.read(sys.argv[1])
    points, tets = mesh.points, mesh.cells_dict["tetra"]
    least, most = points.min(axis=0), points.max(axis=0)
    close = 1e-6
    held = [n for n, p in enumerate(points) if abs(p[2] - least[2]) < close]
    corners = [
        n
        for n, p in enumerate(points)
        if abs(p[2] - most[2]) < close
        and all(min(abs(p[a] - least[a]), abs(p[a] - most[a])) < close for a in (0, 1))
    ]
    assert len(held) == 81 and len(corners) == 4, "not the paper's bar at rest"
    print(
        f"""<?xml version="1.0" encoding="utf-8"?>
<Model>
  <Nodes NumNodes="{len(points)}" DOF="3">
{lines(points)}
  </Nodes>
  <Elements NumEls="{len(tets)}" Type="T4">
{lines(tets)}
  </Elements>"""
    )
    for axis in range(3):
        print(constraint("Fix", axis, held))
    print(constraint("Force", 2, corners, 0.07))
    print(
        """  <ElementSet Size="all">
    <Material Type="NH"><ElasticParams NumParams="2">1000 30000</ElasticParams></Material>
    0
  </ElementSet>
  <SystemParams>
    <TimeStep>3e-5</TimeStep>
    <TotalTime>0.3</TotalTime>
    <DampingCoeff>20</DampingCoeff>
    <Density>1000</Density>
  </SystemParams>
</Model>"""
    )


main()
