r"""Pressurised tube with helical fibres, static, finite strain, 3-D (SI units).

Solves: tube 10 mm < r < 15 mm, 0 < z < 20 mm, held at z = 0, free at z = 20 mm and
outside, follower pressure p inside. Exponential matrix + two fibre families + their
coupling (all isochoric) + d (J-1)^2. Fibre angle +60 deg inside to -60 deg outside.
Q2 displacements on second-order hexahedra, pure displacement form, Newton, LU.

Install (Debian 12): apt-get install --no-install-recommends python3-dolfinx \
                     libopenblas0-serial       (the plain BLAS makes it 6 times slower)
Written for and run with DOLFINx 0.5.2 (Debian 1:0.5.2-2+b1), PETSc 3.18, Python 3.11.
Run:  OMP_NUM_THREADS=1 python3 tube_dolfinx.py P NR NT NZ [GRADE] [STEPS] [QDEG]
      e.g. python3 tube_dolfinx.py 3000 4 16 12        (about 30 s, 0.5 GB, one core)
           python3 tube_dolfinx.py 3000 12 16 24       (about 10 min, a few GB)
P in Pa; NR, NT, NZ are element counts through the wall, around and along. GRADE (default
2; 1 is uniform) packs elements towards both ends and both sides, for the
stress peak at the held end. STEPS (even, 6): load increments. QDEG: quadrature (6).
Prints a table for P/2 and P: d_radius is the growth of the distance from the axis (spread:
its range over the circle), u.e_r the displacement along the reference radius, both means;
a positive twist turns from +x to +y.
"""
import sys, time
import numpy as np
import basix, ufl
from mpi4py import MPI
from petsc4py import PETSc
from dolfinx import fem, mesh, __version__

t_start = time.time()
p_max, (nr, nt, nz) = float(sys.argv[1]), map(int, sys.argv[2:5])
grade, steps, qdeg = list(map(int, sys.argv[5:])) + [2, 6, 6][len(sys.argv[5:]):]
ri, ro, length = 0.010, 0.015, 0.020
a, b, d = 2000.0, 8.0, 1e5
af, bf, a_s, bs, afs, bfs = 18472.0, 16.026, 2481.0, 11.12, 216.0, 11.436


def spread(n):
    """Ends and middles of n elements on 0..1, packed towards 0 and 1."""
    e = np.linspace(-1, 1, n + 1)
    e = (1 + np.sign(e) * (1 - (1 - abs(e))**grade)) / 2
    return np.append(np.column_stack([e[:-1], (e[:-1] + e[1:]) / 2]).ravel(), 1.0)


# Second-order hexahedra: every geometry node lies on the true cylinders.
q2 = basix.create_element(basix.ElementFamily.P, basix.CellType.hexahedron, 2,
                          basix.LagrangeVariant.gll_warped)
loc = np.rint(2 * q2.points).astype(int)              # 27 local grid offsets 0..2
ic, jc, kc = (m.reshape(-1, 1) for m in np.mgrid[:nr, :nt, :nz])
I, J, K = 2 * ic + loc[:, 0], (2 * jc + loc[:, 1]) % (2 * nt), 2 * kc + loc[:, 2]
cells = ((I * 2 * nt + J) * (2 * nz + 1) + K).astype(np.int64)
gi, gj, gk = np.mgrid[:2 * nr + 1, :2 * nt, :2 * nz + 1].reshape(3, -1)
gr, gt, gz = ri + (ro - ri) * spread(nr)[gi], np.pi * gj / nt, length * spread(nz)[gk]
dom = mesh.create_mesh(MPI.COMM_SELF, cells,
                       np.column_stack([gr * np.cos(gt), gr * np.sin(gt), gz]),
                       ufl.Mesh(ufl.VectorElement("Lagrange", "hexahedron", 2)))
V = fem.VectorFunctionSpace(dom, ("Lagrange", 2))
u, v, du = fem.Function(V), ufl.TestFunction(V), ufl.TrialFunction(V)

# Boundary parts: the held end, and the inner side as facet tag 1.
held = fem.dirichletbc(np.zeros(3), fem.locate_dofs_geometrical(
    V, lambda x: np.isclose(x[2], 0, atol=1e-9)), V)
inner = mesh.locate_entities_boundary(dom, 2, lambda x: np.hypot(x[0], x[1]) < ri + 1e-6)
tags = mesh.meshtags(dom, 2, np.sort(inner), np.ones(len(inner), dtype=np.int32))
quad = {"quadrature_degree": qdeg}
dx, ds = ufl.dx(metadata=quad), ufl.ds(domain=dom, subdomain_data=tags, metadata=quad)

# Directions from the reference position at each quadrature point.
X, N = ufl.SpatialCoordinate(dom), ufl.FacetNormal(dom)
r = ufl.sqrt(X[0]**2 + X[1]**2)
s0, et = ufl.as_vector([X[0] / r, X[1] / r, 0]), ufl.as_vector([-X[1] / r, X[0] / r, 0])
alpha = np.pi / 3 * (1 - 2 * (r - ri) / (ro - ri))
f0 = ufl.cos(alpha) * et + ufl.sin(alpha) * ufl.as_vector([0, 0, 1])

# Energy and residual; the pressure term is the load on the deformed inner side.
F = ufl.Identity(3) + ufl.grad(u)
Jd = ufl.det(F)
C, g = F.T * F, Jd**(-2.0 / 3.0)
I1, I8 = g * ufl.tr(C), g * ufl.inner(f0, C * s0)


def fibre(ai, bi, n):
    e = g * ufl.inner(n, C * n) - 1
    # a hair below 0, so that the first tangent (at u = 0) already has the fibres in it
    return ufl.conditional(ufl.gt(e, -1e-10), ai / (2 * bi) * (ufl.exp(bi * e**2) - 1), 0.0)


psi = (a / (2 * b) * (ufl.exp(b * (I1 - 3)) - 1) + d * (Jd - 1)**2 + fibre(af, bf, f0)
       + fibre(a_s, bs, s0) + afs / (2 * bfs) * (ufl.exp(bfs * I8**2) - 1))
p = fem.Constant(dom, 0.0)
res = ufl.derivative(psi * dx, u, v) + p * ufl.inner(Jd * ufl.inv(F).T * N, v) * ds(1)
opt = {"cffi_extra_compile_args": ["-O2", "-march=native"]}
R, K_ = (fem.form(w, jit_params=opt) for w in (res, ufl.derivative(res, u, du)))
A, rhs, inc = fem.petsc.create_matrix(K_), fem.petsc.create_vector(R), fem.Function(V)
ksp = PETSc.KSP().create(MPI.COMM_SELF)
ksp.setOperators(A)
ksp.setType("preonly")
ksp.pc.setType("lu")
ksp.pc.setFactorSolverType("mumps")


def residual():
    rhs.set(0.0)
    fem.petsc.assemble_vector(rhs, R)
    fem.petsc.set_bc(rhs, [held], u.vector, -1.0)
    return rhs.norm()


def newton():
    """Newton steps, halved while they don't help, until the residual is 1e-8 of the first."""
    norm = first = residual()
    for it in range(40):
        if norm < 1e-8 * first:
            return it
        A.zeroEntries()
        fem.petsc.assemble_matrix(A, K_, [held])
        A.assemble()
        ksp.solve(rhs, inc.vector)
        u_old, old = u.x.array.copy(), norm
        for t in (1.0, 0.5, 0.25, 0.12, 0.06):
            u.x.array[:] = u_old - t * inc.x.array
            norm = residual()
            if norm < old:
                break
    raise RuntimeError("Newton did not converge; use more STEPS")


x0 = V.tabulate_dof_coordinates()


def row(side, z):
    """Means over the nodes of one circle, in mm and degrees."""
    m = np.isclose(np.hypot(x0[:, 0], x0[:, 1]), side) & np.isclose(x0[:, 2], z)
    assert m.sum() == 2 * nt
    w = u.x.array.reshape(-1, 3)[m]
    q, h = x0[m, 0] + 1j * x0[m, 1], w[:, 0] + 1j * w[:, 1]      # x + i y
    dr, er_, ang = abs(q + h) - side, (h * q.conj()).real / side, np.angle(1 + h / q, deg=True)
    return 1e3 * dr.mean(), 1e3 * er_.mean(), 1e3 * w[:, 2].mean(), ang.mean(), 1e3 * np.ptp(dr)


print(f"# dolfinx {__version__}, mesh {nr} x {nt} x {nz}, {3 * len(x0)} unknowns, "
      f"quadrature degree {qdeg}")
print("# p[Pa]  side   z[mm]  d_radius[mm]  u.e_r[mm]   u_z[mm]   twist[deg]  spread[mm]")
for k in range(1, steps + 1):
    p.value = p_max * k / steps
    its = newton()
    if k in (steps // 2, steps):
        for z, name, side in ((z, *s) for z in (.01, .02) for s in (("inner", ri), ("outer", ro))):
            print("%7.1f  %s  %5.1f  %11.5f  %10.5f %10.5f %10.4f   %.1e"
                  % ((p.value, name, 1e3 * z) + row(side, z)))
print(f"# last Newton count {its}, {time.time() - t_start:.0f} s")
