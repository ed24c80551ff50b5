#!/usr/bin/env python3
"""Makes the visual meshes of the Panda arm, its hand and the props (OBJ, meters, smooth normals) and the counter's oak
texture. Standard library only.

Shells are signed distance functions (negative inside), blended smoothly and turned into triangles by surface nets; turned
and swept parts are built directly. Run it from anywhere; it overwrites robots/panda/meshes, the props' meshes and
props/base_cabinet/oak.png.
"""
import math
import pathlib
import random
import struct
import zlib

MODELS = pathlib.Path(__file__).resolve().parent.parent


# ---- signed distances ------------------------------------------------------------------------------------------------
def tapered(a, b, ra, rb):
    """Returns a capsule from a to b whose radius goes from ra to rb."""
    d = [b[i] - a[i] for i in range(3)]
    length2 = sum(x * x for x in d)

    def f(x, y, z):
        px, py, pz = x - a[0], y - a[1], z - a[2]
        t = min(1.0, max(0.0, (px * d[0] + py * d[1] + pz * d[2]) / length2))
        return math.hypot(px - t * d[0], py - t * d[1], pz - t * d[2]) - (ra + t * (rb - ra))

    return f


def cylinder(axis, center, half, radius, rounding):
    """Returns a cylinder along a coordinate axis with rounded edges."""
    i, j, k = axis, (axis + 1) % 3, (axis + 2) % 3

    def f(*p):
        q = [p[n] - center[n] for n in range(3)]
        u = math.hypot(q[j], q[k]) - radius + rounding
        v = abs(q[i]) - half + rounding
        return min(max(u, v), 0.0) + math.hypot(max(u, 0.0), max(v, 0.0)) - rounding

    return f


def box(center, half, rounding):
    def f(x, y, z):
        u = abs(x - center[0]) - half[0] + rounding
        v = abs(y - center[1]) - half[1] + rounding
        w = abs(z - center[2]) - half[2] + rounding
        outside = math.hypot(max(u, 0.0), max(v, 0.0), max(w, 0.0))
        return min(max(u, v, w), 0.0) + outside - rounding

    return f


def blend(k, *parts):
    """Returns the union with fillets of size k."""

    def f(x, y, z):
        d = parts[0](x, y, z)
        for part in parts[1:]:
            e = part(x, y, z)
            h = max(k - abs(d - e), 0.0) / k
            d = min(d, e) - h * h * k * 0.25
        return d

    return f


def common(a, b):
    """Returns the intersection, with sharp edges."""
    return lambda *p: max(a(*p), b(*p))


def without(a, b):
    return lambda *p: max(a(*p), -b(*p))


def half_space(axis, sign, offset):
    """Returns the half-space in which sign * coordinate < sign * offset."""
    return lambda *p: sign * (p[axis] - offset)


# ---- meshes: (vertices, normals, triangles) --------------------------------------------------------------------------
def surface(f, low, high, h, smooth=None):
    """Returns the triangles of f = 0 inside the box low..high, with cells of size h; edges and corners of f stay sharp.

    smooth: the shape before it was cut, from which normals are computed, so that shading does not change toward a cut.
    """
    low = [x - h for x in low]
    n = [int(math.ceil((high[i] - low[i]) / h)) + 2 for i in range(3)]
    xs, ys, zs = ([low[i] + h * k for k in range(n[i])] for i in range(3))
    value = [[[f(x, y, z) for z in zs] for y in ys] for x in xs]
    corners = [(i, j, k) for i in (0, 1) for j in (0, 1) for k in (0, 1)]
    edges = [(a, b) for a in corners for b in corners if a < b and sum(abs(a[i] - b[i]) for i in range(3)) == 1]
    vertices, normals, index, planes = [], [], {}, {}

    def normal(g, p, e=1e-4):
        x, y, z = p
        return unit((g(x + e, y, z) - g(x - e, y, z), g(x, y + e, z) - g(x, y - e, z), g(x, y, z + e) - g(x, y, z - e)))

    def crossing(a, b):
        """Returns the point on the surface between two grid points, and the normal there."""
        if (a, b) not in planes:
            p, q = ([low[0] + h * c[0], low[1] + h * c[1], low[2] + h * c[2]] for c in (a, b))
            inside = value[a[0]][a[1]][a[2]] < 0
            for _ in range(12):
                m = [(u + v) / 2 for u, v in zip(p, q)]
                if (f(*m) < 0) == inside:
                    p = m
                else:
                    q = m
            planes[a, b] = m, normal(f, m)
        return planes[a, b]

    for i in range(n[0] - 1):
        for j in range(n[1] - 1):
            for k in range(n[2] - 1):
                cell = {c: value[i + c[0]][j + c[1]][k + c[2]] < 0 for c in corners}
                if sum(cell.values()) in (0, 8):
                    continue
                found = [
                    crossing((i + a[0], j + a[1], k + a[2]), (i + b[0], j + b[1], k + b[2]))
                    for a, b in edges
                    if cell[a] != cell[b]
                ]
                p = [sum(c[m] for c, _ in found) / len(found) for m in range(3)]
                for _ in range(40):  # to where the tangent planes at the crossings meet
                    step = [0.0] * 3
                    for c, g in found:
                        s = sum(g[m] * (c[m] - p[m]) for m in range(3)) / len(found)
                        step = [step[m] + s * g[m] for m in range(3)]
                    p = [p[m] + step[m] for m in range(3)]
                corner = [low[0] + h * i, low[1] + h * j, low[2] + h * k]
                p = [min(corner[m] + h, max(corner[m], p[m])) for m in range(3)]
                index[i, j, k] = len(vertices)
                vertices.append(p)
                normals.append(normal(smooth or f, p))
    triangles = []
    for i in range(1, n[0] - 1):
        for j in range(1, n[1] - 1):
            for k in range(1, n[2] - 1):
                here = value[i][j][k] < 0
                for axis, there in enumerate((value[i + 1][j][k], value[i][j + 1][k], value[i][j][k + 1])):
                    if here == (there < 0):
                        continue
                    u, v = (axis + 1) % 3, (axis + 2) % 3
                    quad = []
                    for du, dv in ((1, 1), (0, 1), (0, 0), (1, 0)):
                        c = [i, j, k]
                        c[u] -= du
                        c[v] -= dv
                        quad.append(index[tuple(c)])
                    if not here:
                        quad.reverse()
                    a, b, c, d = quad
                    if distance2(vertices[a], vertices[c]) <= distance2(vertices[b], vertices[d]):
                        triangles += [(a, b, c), (a, c, d)]
                    else:
                        triangles += [(a, b, d), (b, c, d)]
    return vertices, normals, triangles


def turned(axis, center, profile, slices):
    """Revolves a profile of (radius, height) points, listed so that the outside is on its right when height points up
    and radius to the right; None between points starts a new smooth group. Heights count along the axis from center."""
    i, j, k = axis, (axis + 1) % 3, (axis + 2) % 3
    vertices, normals, triangles = [], [], []
    groups, group = [], []
    for point in list(profile) + [None]:
        if point is None:
            groups.append(group)
            group = [group[-1]] if group else []
        else:
            group.append(point)
    for group in groups:
        if len(group) < 2:
            continue
        start = len(vertices)
        flat = [(group[m + 1][1] - group[m][1], group[m][0] - group[m + 1][0]) for m in range(len(group) - 1)]
        flat = [(x / math.hypot(x, y), y / math.hypot(x, y)) for x, y in flat]
        for m, (r, height) in enumerate(group):
            a, b = flat[max(0, m - 1)], flat[min(len(flat) - 1, m)]
            nr, nh = a[0] + b[0], a[1] + b[1]
            size = math.hypot(nr, nh)
            for s in range(slices):
                angle = 2 * math.pi * s / slices
                c, d = math.cos(angle), math.sin(angle)
                p, q = [0.0] * 3, [0.0] * 3
                p[i], p[j], p[k] = center[i] + height, center[j] + r * c, center[k] + r * d
                q[i], q[j], q[k] = nh / size, nr / size * c, nr / size * d
                vertices.append(p)
                normals.append(q)
        for m in range(len(group) - 1):
            for s in range(slices):
                a = start + m * slices + s
                b = start + m * slices + (s + 1) % slices
                if group[m][0] > 0:
                    triangles.append((a, b, b + slices))
                if group[m + 1][0] > 0:
                    triangles.append((a, b + slices, a + slices))
    return vertices, normals, triangles


def tube(axis, center, radius, half, slices=24):
    """Returns the side of a cylinder, which is visible in the seam between two shells."""
    return turned(axis, center, [(radius, -half), (radius, half)], slices)


def rounded_box(half, radius, steps=2):
    """Returns a box with round edges and flat faces."""
    core = [h - radius for h in half]
    arc = [math.tan(math.pi / 4 * (s / steps - 1)) for s in range(steps + 1)]
    line = [(-1, t) for t in arc] + [(1, -t) for t in reversed(arc)]
    vertices, normals, triangles = [], [], []
    for axis in range(3):
        for sign in (1, -1):
            i, j, k = axis, (axis + 1) % 3, (axis + 2) % 3
            start, n = len(vertices), len(line)
            for side_u, u in line:
                for side_v, v in line:
                    out = [0.0] * 3
                    out[i], out[j], out[k] = float(sign), u, v
                    out = unit(out)
                    p = [0.0] * 3
                    p[i] = sign * core[i] + radius * out[i]
                    p[j] = side_u * core[j] + radius * out[j]
                    p[k] = side_v * core[k] + radius * out[k]
                    vertices.append(p)
                    normals.append(out)
            for a in range(n - 1):
                for b in range(n - 1):
                    c = start + a * n + b
                    faces = [(c, c + n, c + n + 1), (c, c + n + 1, c + 1)]
                    triangles += faces if sign > 0 else [f[::-1] for f in faces]
    return vertices, normals, triangles


def swept(path, ring):
    """Sweeps a closed ring of ((u, v), (nu, nv)) along a path in a plane z = const: u is sideways, v is up."""
    vertices, normals, triangles = [], [], []
    for m, p in enumerate(path):
        a, b = path[max(0, m - 1)], path[min(len(path) - 1, m + 1)]
        t = unit((b[0] - a[0], b[1] - a[1], 0.0))
        side = (t[1], -t[0])
        for (u, v), (nu, nv) in ring:
            vertices.append([p[0] + u * side[0], p[1] + u * side[1], p[2] + v])
            normals.append([nu * side[0], nu * side[1], nv])
    n = len(ring)
    for m in range(len(path) - 1):
        for s in range(n):
            a, b = m * n + s, m * n + (s + 1) % n
            triangles += [(a, b + n, b), (a, a + n, b + n)]
    for first, order in ((0, 1), ((len(path) - 1) * n, -1)):  # ends, hidden in the wall
        triangles += [(first, first + s, first + s + 1)[::order] for s in range(1, n - 1)]
    return vertices, normals, triangles


def rounded_rectangle(half_u, half_v, r):
    """Returns a rectangle for swept(), with corners of radius r."""
    ring = []
    for s in range(12):
        quarter = s // 3
        a = math.pi / 2 * (quarter + (s % 3) / 2)
        n = (math.cos(a), math.sin(a))
        u = math.copysign(half_u - r, 1 if quarter in (0, 3) else -1)
        v = math.copysign(half_v - r, 1 if quarter < 2 else -1)
        ring.append(((u + r * n[0], v + r * n[1]), n))
    return ring


def moved(mesh, rotation, offset):
    """Rotates by a matrix (rows) and shifts."""

    def apply(p):
        return [sum(rotation[r][c] * p[c] for c in range(3)) for r in range(3)]

    v, n, t = mesh
    return [[x + o for x, o in zip(apply(p), offset)] for p in v], [apply(p) for p in n], t


def joined(*meshes):
    vertices, normals, triangles = [], [], []
    for v, n, t in meshes:
        start = len(vertices)
        vertices += v
        normals += n
        triangles += [tuple(start + x for x in f) for f in t]
    return vertices, normals, triangles


def unit(v):
    size = math.hypot(*v) or 1.0
    return [x / size for x in v]


def distance2(a, b):
    return sum((x - y) ** 2 for x, y in zip(a, b))


def write(path, mesh):
    vertices, normals, triangles = mesh
    path.parent.mkdir(parents=True, exist_ok=True)
    lines = ["# made by make_meshes.py"]
    lines += ["v %.5f %.5f %.5f" % tuple(p) for p in vertices]
    lines += ["vn %.3f %.3f %.3f" % tuple(p) for p in normals]
    lines += ["f " + " ".join(f"{x + 1}//{x + 1}" for x in t) for t in triangles]
    path.write_text("\n".join(lines) + "\n")
    print(f"{path.relative_to(MODELS)}: {len(vertices)} vertices, {len(triangles)} triangles")


# ---- Panda -----------------------------------------------------------------------------------------------------------
CELL = 0.0155  # cell size of the grid for the arm's shells, m
R_COLUMN, R_BARREL = 0.055, 0.055
GAP = 0.003  # m, half width of the dark seam between two links


def barrel_cap(axis, center, sign, radius):
    """Returns the round cover at the end of a joint housing: a dark ring and the white lid in it."""
    ring = [(radius + 0.004, -0.002), (radius + 0.004, 0.0015), None, (radius + 0.003, 0.002), (radius - 0.001, 0.002)]
    lid = [(radius, 0), (radius - 0.003, 0.004), (radius * 0.5, 0.0055), (0, 0.006)]
    if sign < 0:
        ring, lid = ([(p[0], -p[1]) if p else None for p in reversed(x)] for x in (ring, lid))
    return turned(axis, center, ring, 24), turned(axis, center, lid, 24)


def shoulder():
    """Links 1 and 2: a column along -z that turns into half of the joint housing along -y."""
    column = cylinder(2, (0, 0, -0.12), 0.07, R_COLUMN, 0.004)
    housing = cylinder(1, (0, -0.053, 0), 0.05, R_BARREL, 0.01)
    neck = tapered((0, 0, -0.10), (0, -0.04, -0.015), R_COLUMN, 0.045)
    shell = blend(0.04, column, neck, housing)
    other = cylinder(1, (0, 0.097, 0), 0.1, R_BARREL + 2 * GAP, 0.0)
    cut = without(common(shell, half_space(2, -1, -0.19 + GAP)), other)
    groove, lid = barrel_cap(1, (0, -0.1035, 0), -1, 0.037)
    light = joined(surface(cut, (-0.075, -0.12, -0.2), (0.075, 0.075, 0.075), CELL, shell), lid)
    dark = joined(groove, tube(2, (0, 0, -0.19), R_COLUMN - 0.004, 0.012), tube(1, (0, 0, 0), R_BARREL - 0.004, 0.01))
    return light, dark


def elbow():
    """Links 3 and 4: a column along -z and, 82.5 mm in front of it, half of the joint housing along +y."""
    column = tapered((0, 0, -0.2), (0, 0, -0.05), R_COLUMN, R_COLUMN)
    housing = cylinder(1, (0.0825, 0.053, 0), 0.05, 0.052, 0.01)
    neck = tapered((0.005, 0, -0.055), (0.075, 0.045, 0), 0.053, 0.046)
    shell = blend(0.04, column, neck, housing)
    other = cylinder(1, (0.0825, -0.097, 0), 0.1, 0.052 + 2 * GAP, 0.0)
    cut = without(common(shell, half_space(2, -1, -0.124 + GAP)), other)
    groove, lid = barrel_cap(1, (0.0825, 0.1035, 0), 1, 0.035)
    light = joined(surface(cut, (-0.075, -0.075, -0.135), (0.15, 0.12, 0.075), CELL, shell), lid)
    dark = joined(groove, tube(2, (0, 0, -0.124), R_COLUMN - 0.004, 0.012), tube(1, (0.0825, 0, 0), 0.048, 0.01))
    return light, dark


def base():
    column = tapered((0, 0, 0.0), (0, 0, 0.2), 0.07, 0.05)
    foot = box((-0.055, 0, 0.015), (0.075, 0.085, 0.028), 0.022)
    back = tapered((-0.095, 0, 0.02), (0, 0, 0.08), 0.045, 0.05)
    shell = blend(0.045, foot, back, column)
    cut = common(common(shell, half_space(2, -1, 0.0)), half_space(2, 1, 0.143 - GAP))
    light = surface(cut, (-0.155, -0.11, -0.01), (0.09, 0.11, 0.155), CELL, shell)
    plug = box((-0.138, 0, 0.032), (0.012, 0.034, 0.02), 0.004)
    dark = joined(tube(2, (0, 0, 0.14), R_COLUMN - 0.004, 0.012), surface(plug, (-0.155, -0.04, 0.005), (-0.12, 0.04, 0.06), 0.01))
    return light, dark


def forearm():
    """Link 5: round at the elbow, then a flat strut beside the wrist (+y) that carries half of its housing."""
    top = tapered((0, 0, -0.33), (0, 0, -0.225), R_COLUMN, 0.053)
    slope = tapered((0, 0.005, -0.22), (0, 0.07, -0.135), 0.05, 0.032)
    strut = box((0, 0.082, -0.085), (0.042, 0.021, 0.1), 0.018)
    housing = cylinder(1, (0, 0.083, 0), 0.027, 0.052, 0.01)
    shell = blend(0.035, top, slope, strut, housing)
    cut = common(shell, half_space(2, -1, -0.26 + GAP))
    groove, lid = barrel_cap(1, (0, 0.1105, 0), 1, 0.035)
    light = joined(surface(cut, (-0.075, -0.075, -0.275), (0.075, 0.125, 0.07), CELL, shell), lid)
    dark = joined(groove, tube(1, (0, 0.054, 0), 0.046, 0.01))
    return light, dark


def wrist():
    """Link 6: housing about the wrist axis (z) and, 88 mm in front, the head that carries joint 7 (-y is outwards)."""
    housing = cylinder(2, (0, 0, 0.0), 0.052, 0.05, 0.012)
    arm = tapered((0, 0, 0), (0.088, 0.015, 0), 0.041, 0.041)
    head = cylinder(1, (0.088, 0.016, 0), 0.062, 0.049, 0.012)
    shell = blend(0.022, housing, arm, head)
    cut = common(shell, half_space(1, -1, -0.042 + GAP))
    lid_top = barrel_cap(1, (0.088, 0.0785, 0), 1, 0.035)
    lid_side = barrel_cap(2, (0, 0, 0.0525), 1, 0.033)
    light = joined(surface(cut, (-0.07, -0.07, -0.07), (0.155, 0.095, 0.07), CELL, shell), lid_top[1], lid_side[1])
    dark = joined(lid_top[0], lid_side[0], tube(1, (0.088, -0.042, 0), 0.041, 0.012))
    return light, dark


def flange():
    """Link 7: a ring with the connector's bump toward the hand's long side, and the metal flange."""
    ring = cylinder(2, (0, 0, 0.068), 0.026 - GAP, 0.045, 0.008)
    bump = tapered((0.024, 0.024, 0.064), (0.032, 0.032, 0.07), 0.021, 0.016)
    light = surface(blend(0.02, ring, bump), (-0.06, -0.06, 0.035), (0.075, 0.075, 0.1), 0.01)
    metal = [(0.0315, 0.08), (0.0315, 0.107), None, (0, 0.107)]
    return light, turned(2, (0, 0, 0), metal, 24)


def hand():
    bar = box((0, 0, 0.046), (0.0305, 0.1015, 0.0205), 0.011)
    crown = box((0, 0, 0.038), (0.029, 0.062, 0.032), 0.016)
    collar = cylinder(2, (0, 0, 0.012), 0.012, 0.04, 0.003)
    shell = blend(0.014, bar, crown, collar)
    cut = common(shell, half_space(2, 1, 0.0635))
    return surface(cut, (-0.05, -0.115, -0.01), (0.05, 0.115, 0.075), 0.0092, shell)


def finger():
    block = box((0, 0.0155, 0.009), (0.0102, 0.0105, 0.0125), 0.003)
    blade = tapered((0, 0.0145, 0.018), (0, 0.0085, 0.04), 0.008, 0.006)
    tip = box((0, 0.0075, 0.0435), (0.0088, 0.0042, 0.0105), 0.003)
    shell = blend(0.008, block, blade, tip)
    return surface(shell, (-0.016, -0.003, -0.01), (0.016, 0.033, 0.062), 0.0045)


# ---- pot -------------------------------------------------------------------------------------------------------------
def pot_body():
    outside = [(0, -0.1366), (0.163, -0.1366), None, (0.169, -0.1345), (0.1735, -0.1295), (0.176, -0.1215), None, (0.176, 0.066), None,
               (0.1785, 0.0685), (0.1795, 0.0715), (0.178, 0.0742), (0.175, 0.075), (0.1725, 0.0735), (0.172, 0.07), None,
               (0.172, -0.118), None, (0.167, -0.127), (0.157, -0.131), None, (0, -0.131)]
    return turned(2, (0, 0, 0), outside, 48)


def pot_handle(side, middle):
    """Loop handle; its bar is 34 mm wide and 28 mm high, centered at y = middle side."""
    corner = 0.026
    path = [(0.075, 0.158), (0.075, middle - corner)]
    path += [(0.075 - corner + corner * math.cos(a), middle - corner + corner * math.sin(a)) for a in (math.pi / 10 * x for x in range(1, 5))]
    path += [(0.049, middle)]
    path += [(-x, y) for x, y in reversed(path)]
    mesh = swept([(x, y, 0.041) for x, y in path], rounded_rectangle(0.0172, 0.0142, 0.006))
    return mesh if side > 0 else moved(mesh, ((-1, 0, 0), (0, -1, 0), (0, 0, 1)), (0, 0, 0))


# ---- valve -----------------------------------------------------------------------------------------------------------
def valve_wheel():
    """Hand-wheel about z: rim, five spokes and hub; origin in the rim's middle."""
    rim = [(0.0255 + 0.0055 * math.cos(a), 0.007 * math.sin(a)) for a in (math.pi / 8 * k for k in range(-8, 9))]
    hub = [(0, -0.006), None, (0.0075, -0.006), (0.0085, -0.005), (0.0085, 0.006), (0.0075, 0.007), None, (0, 0.007)]
    spoke = turned(0, (0.015, 0, 0), [(0.0028, -0.008), (0.0028, 0.008)], 10)
    spokes = []
    for k in range(5):
        c, d = math.cos(2 * math.pi / 5 * k), math.sin(2 * math.pi / 5 * k)
        spokes.append(moved(spoke, ((c, -d, 0), (d, c, 0), (0, 0, 1)), (0, 0, 0)))
    return joined(turned(2, (0, 0, 0), rim, 40), turned(2, (0, 0, 0), hub, 20), *spokes)


def valve_body():
    """Globe valve with two pipe ends along y; origin on the wheel's axis, at the height of its foot."""
    globe = tapered((0, -0.03, 0.052), (0, 0.03, 0.052), 0.036, 0.036)
    pipe = cylinder(1, (0, 0, 0.052), 0.1, 0.024, 0.0)
    neck = cylinder(2, (0, 0, 0.075), 0.03, 0.022, 0.003)
    shell = surface(common(blend(0.02, globe, pipe, neck), half_space(2, 1, 0.102)), (-0.04, -0.105, 0.01), (0.04, 0.105, 0.105), 0.0085)
    ends = [flange_disc(1, (0, side * 0.103, 0.052), 0.008, 0.046, 0.031) for side in (-1, 1)]
    return joined(shell, flange_disc(2, (0, 0, 0.1), 0.005, 0.03, 0.023), *ends)


def flange_disc(axis, center, half, radius, bolt_circle):
    """Disc with rounded edges and six bolts through it."""
    disc = [(0, -half), None, (radius - 0.002, -half), (radius, 0.002 - half), (radius, half - 0.002), (radius - 0.002, half),
            None, (0, half)]
    bolt = [(0, -half - 0.004), None, (0.004, -half - 0.004), (0.004, half + 0.004), None, (0, half + 0.004)]
    meshes = [turned(axis, center, disc, 32)]
    for k in range(6):
        place = list(center)
        place[(axis + 1) % 3] += bolt_circle * math.cos(math.pi / 3 * (k + 0.5))
        place[(axis + 2) % 3] += bolt_circle * math.sin(math.pi / 3 * (k + 0.5))
        meshes.append(turned(axis, place, bolt, 6))
    return joined(*meshes)


# ---- cardboard -------------------------------------------------------------------------------------------------------
def cardboard(size=128):
    """Tileable image of brown kraft liner: fibers and the faint shadows of the corrugation beneath."""
    draw = random.Random(5)
    rows = []
    for y in range(size):
        row = bytearray([0])
        for x in range(size):
            shade = 1 + 0.012 * math.sin(2 * math.pi * x / 8) + draw.uniform(-0.025, 0.025)
            row += bytes(int(max(0, min(255, c * shade))) for c in (196, 158, 112))
        rows.append(row)
    for _ in range(90):
        x, y, tone = draw.randrange(size), draw.randrange(size), draw.choice((0.9, 1.07))
        for step in range(draw.randrange(3, 9)):
            at = 1 + 3 * ((x + step) % size)
            for c in range(3):
                rows[y][at + c] = min(255, int(rows[y][at + c] * tone))
    return png(size, rows)


# ---- counter ---------------------------------------------------------------------------------------------------------
def oak(size=256, staves=8):
    """Tileable image of glued oak staves that run along its rows."""
    draw = random.Random(7)
    rows = []
    for stave in range(staves):
        joints = sorted(draw.randrange(size) for _ in range(2))
        tones = [draw.uniform(-0.07, 0.07) for _ in range(2)]
        grain = [draw.uniform(-0.025, 0.025) for _ in range(size // staves)]
        for y, line in enumerate(grain):
            row = bytearray([0])
            for x in range(size):
                between = joints[0] <= x < joints[1]
                shade = 1 + tones[between] + line + 0.012 * math.sin(2 * math.pi * (x / size * (2 + stave % 3) + 0.07 * y))
                if y == 0 or x in joints:
                    shade -= 0.09
                row += bytes(int(max(0, min(255, c * shade))) for c in (203, 172, 132))
            rows.append(bytes(row))

    return png(size, rows)


def png(size, rows):
    """Encodes a square RGB image as PNG. Each of the rows must begin with the filter type 0."""

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", size, size, 8, 2, 0, 0, 0)
    data = zlib.compress(b"".join(bytes(row) for row in rows), 9)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", data) + chunk(b"IEND", b"")


def main():
    panda = MODELS / "robots/panda/meshes"
    shells = {"base": base, "shoulder": shoulder, "elbow": elbow, "forearm": forearm, "wrist": wrist, "flange": flange}
    for name, make in shells.items():
        light, dark = make()
        write(panda / f"{name}_light.obj", light)
        write(panda / f"{name}_dark.obj", dark)
    write(panda / "hand.obj", hand())
    write(panda / "finger.obj", finger())
    pot = MODELS / "props/pot/meshes"
    write(pot / "body.obj", pot_body())
    write(pot / "handles.obj", joined(pot_handle(1, 0.234), pot_handle(-1, 0.246)))
    (MODELS / "props/base_cabinet/oak.png").write_bytes(oak())
    write(MODELS / "props/valve/meshes/body.obj", valve_body())
    write(MODELS / "props/valve/meshes/wheel.obj", valve_wheel())
    (MODELS / "props/cardboard_box/cardboard.png").write_bytes(cardboard())
    write(MODELS / "props/cube/meshes/cube.obj", rounded_box((0.02, 0.02, 0.02), 0.0025))
    write(MODELS / "props/rod/meshes/rod.obj", rounded_box((0.02, 0.1, 0.02), 0.003))


if __name__ == "__main__":
    main()
