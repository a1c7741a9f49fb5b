#!/usr/bin/env python3
"""Compares Canyon's reflections of the first order with this script's own image method.

    reflections.py CANYON [--places N] [--seed S] [--mesh FILE.dae]

Without --mesh the street has random boxes of concrete, glass, brick and metal, by the seed; with it, the mesh's
triangles are read here (COLLADA, Z up, metres). Antennas stand at N random places outdoors. Each path of one mirror that
found by either program must be found by the other, with the same excess path and the same field: Fresnel coefficients of a half
space by ITU-R P.2040-3, of circular waves. Prints the differences; exits with 1 if one exceeds its limit.
"""
import argparse
import json
import math
import random
import subprocess
import sys
import tempfile
import xml.etree.ElementTree
from pathlib import Path

try:
    import numpy as np
except ImportError:
    print("numpy is missing")
    sys.exit(77)

MOST_EXCESS_M, MOST_FIELD_DB = 0.01, 0.5
REACH_M, FLATTEST = 300.0, math.cos(1.5533430342749532)  # propagation.max_range_m, max_incidence_deg: Canyon's defaults
F_GHZ = 1.57542
ORIGIN = (22.3, 114.17)
# ITU-R P.2040-3, table 3: a, b, c, d.
P2040 = {"concrete": (5.24, 0, .0462, .7822), "glass": (6.31, 0, .0036, 1.3394), "brick": (3.91, 0, .0238, .16), "metal": (1, 0, 1e7, 0),
         "stone": (7.074, 0, .0055, .9262), "wood": (1.99, 0, .0047, 1.0718), "plaster": (2.73, 0, .0085, .9395)}
# Points where only one program has a path, since an end of the path or a ray is this close to an edge.
EDGE_M = 0.02


def circular(material, cosine):
    """Fields of a wave of right-hand polarisation in right and left-hand polarisation, after a mirror."""
    a, b, c, d = P2040[material]
    eta = a * F_GHZ**b - 1j * c * F_GHZ**d / (2 * math.pi * F_GHZ * 1e9 * 8.8541878128e-12)
    w = np.sqrt(eta - (1 - cosine**2))
    across, along = (cosine - w) / (cosine + w), (eta * cosine - w) / (eta * cosine + w)
    return abs(across + along) / 2, abs(across - along) / 2


def boxes(seed):
    """Triangles [n, 3, 3] of boxes along streets, and their materials."""
    draw = random.Random(seed)
    corners, materials = [], []
    for east in range(-120, 121, 40):
        for north in range(-120, 121, 40):
            lo = np.array([east + draw.uniform(2, 8), north + draw.uniform(2, 8), 0])
            hi = np.array([east + draw.uniform(24, 34), north + draw.uniform(24, 34), draw.uniform(6, 60)])
            turn = draw.uniform(-0.15, 0.15)
            rotation = np.array([[math.cos(turn), -math.sin(turn), 0], [math.sin(turn), math.cos(turn), 0], [0, 0, 1]])
            middle = (lo + hi) / 2
            at = [middle + rotation @ (np.array([(lo, hi)[i][0], (lo, hi)[j][1], (lo, hi)[k][2]]) - middle) for i in (0, 1) for j in (0, 1) for k in (0, 1)]
            quads = [(0, 4, 5, 1), (4, 6, 7, 5), (6, 2, 3, 7), (2, 0, 1, 3), (1, 5, 7, 3), (0, 2, 6, 4)]
            material = draw.choice(sorted(P2040))
            for q in quads:
                corners += [[at[q[0]], at[q[1]], at[q[2]]], [at[q[0]], at[q[2]], at[q[3]]]]
                materials += [material] * 2
    return np.array(corners), materials


def enu(latitude_deg, longitude_deg):
    """Rows: local east, north and up, in the Earth's axes."""
    a, b = math.radians(latitude_deg), math.radians(longitude_deg)
    return np.array([[-math.sin(b), math.cos(b), 0], [-math.sin(a) * math.cos(b), -math.sin(a) * math.sin(b), math.cos(a)],
                     [math.cos(a) * math.cos(b), math.cos(a) * math.sin(b), math.sin(a)]])


def write_obj(path, triangles, materials):
    with open(path, "w") as out:
        for t in triangles.reshape(-1, 3):
            out.write("v %.9f %.9f %.9f\n" % tuple(t))
        for i, material in enumerate(materials):
            if i % 12 == 0:
                out.write(f"o building_{i // 12}\nusemtl {material}\n")
            out.write(f"f {3 * i + 1} {3 * i + 2} {3 * i + 3}\n")


def read_collada(path):
    """Triangles of <triangles> of all geometries, unchanged: for a mesh without transforms in nodes."""
    root = xml.etree.ElementTree.parse(path).getroot()
    ns = {"c": root.tag[1:root.tag.index("}")]}
    all_triangles = []
    for mesh in root.iterfind(".//c:mesh", ns):
        arrays = {s.get("id"): np.array(s.find("c:float_array", ns).text.split(), float).reshape(-1, 3) for s in mesh.iterfind("c:source", ns)
                  if s.find("c:float_array", ns) is not None and s.find(".//c:accessor", ns).get("stride") == "3"}
        vertices = {v.get("id"): v.find("c:input[@semantic='POSITION']", ns).get("source")[1:] for v in mesh.iterfind("c:vertices", ns)}
        for block in mesh.iterfind("c:triangles", ns):
            inputs = block.findall("c:input", ns)
            stride = 1 + max(int(i.get("offset")) for i in inputs)
            vertex = next(i for i in inputs if i.get("semantic") == "VERTEX")
            p = np.array(block.find("c:p", ns).text.split(), int).reshape(-1, stride)[:, int(vertex.get("offset"))]
            all_triangles.append(arrays[vertices[vertex.get("source")[1:]]][p].reshape(-1, 3, 3))
    return np.concatenate(all_triangles)


class Scene:
    def __init__(self, triangles):
        self.a = triangles[:, 0]
        self.e1, self.e2 = triangles[:, 1] - self.a, triangles[:, 2] - self.a
        normal = np.cross(self.e1, self.e2)
        length = np.linalg.norm(normal, axis=1)
        self.sound = length > 1e-9
        self.n = normal / np.where(self.sound, length, 1)[:, None]

    def hits(self, origin, way, far):
        """Distance of the segment's nearest obstacle, in lengths of `way` (inf: none). Moller and Trumbore, all triangles."""
        h = np.cross(way, self.e2)
        det = np.einsum("ij,ij->i", self.e1, h)
        with np.errstate(all="ignore"):
            inv = 1 / det
            s = origin - self.a
            u = np.einsum("ij,ij->i", s, h) * inv
            q = np.cross(s, self.e1)
            v = (q @ way) * inv
            t = np.einsum("ij,ij->i", self.e2, q) * inv
            hit = (np.abs(det) > 1e-12) & (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0) & (t < far)
        return t[hit].min() if hit.any() else math.inf

    def blocked(self, origin, to, skip_m=1e-4):
        way = to - origin
        length = np.linalg.norm(way)
        unit = way / length
        return self.hits(origin + skip_m * unit, unit, length - 2 * skip_m) < math.inf

    def at(self, point):
        """Triangles with the point in their plane."""
        return np.flatnonzero(np.abs(np.einsum("ij,ij->i", point - self.a, self.n)) < 1e-3)

    def near_edge(self, i, point):
        corners = (self.a[i], self.a[i] + self.e1[i], self.a[i] + self.e2[i])
        for p, q in zip(corners, corners[1:] + corners[:1]):
            along = q - p
            share = np.clip(np.dot(point - p, along) / max(np.dot(along, along), 1e-12), 0, 1)
            if np.linalg.norm(point - p - share * along) < EDGE_M:
                return True
        return False

    def reflections(self, antenna, satellite):
        """(excess [m], point, cosine of incidence, triangle) of each path of one mirror."""
        height = np.einsum("ij,ij->i", antenna - self.a, self.n)
        n = np.where((height < 0)[:, None], -self.n, self.n)
        height = np.abs(height)
        image = antenna - 2 * height[:, None] * n
        way = satellite - image
        length = np.linalg.norm(way, axis=1)
        unit = way / length[:, None]
        cosine = np.einsum("ij,ij->i", unit, n)
        with np.errstate(divide="ignore", invalid="ignore"):
            point = image + (height / cosine)[:, None] * unit
        r = point - self.a
        d11, d12, d22 = (np.einsum("ij,ij->i", x, y) for x, y in ((self.e1, self.e1), (self.e1, self.e2), (self.e2, self.e2)))
        r1, r2 = np.einsum("ij,ij->i", r, self.e1), np.einsum("ij,ij->i", r, self.e2)
        with np.errstate(divide="ignore", invalid="ignore"):
            det = d11 * d22 - d12 * d12
            u, v = (d22 * r1 - d12 * r2) / det, (d11 * r2 - d12 * r1) / det
        inside = (u >= 0) & (v >= 0) & (u + v <= 1) & self.sound & (height > 1e-6) & (cosine > FLATTEST)
        inside &= np.linalg.norm(point - antenna, axis=1) <= REACH_M
        inside &= (n[:, 2] < 0.7) | (point[:, 2] > 1)  # the ground's reflections are off
        found = []
        for i in np.flatnonzero(inside):
            if any(np.linalg.norm(point[i] - f[1]) < 1e-3 for f in found):
                continue  # walls of two parts of a building are one mirror
            out = point[i] + unit[i] * 3000
            if self.blocked(antenna, point[i], 1e-3) or self.blocked(point[i], out, 1e-3):
                continue
            found.append((length[i] - np.linalg.norm(satellite - antenna), point[i], cosine[i], i))
        return found


def shadow_edge(scene, antenna, point, satellite):
    """Whether a slightly shifted ray of the two hits another surface: the point is at a shadow's edge."""
    answers = set()
    unit = (satellite - point) / np.linalg.norm(satellite - point)
    for shift in np.vstack([np.zeros(3), np.eye(3), -np.eye(3)]) * EDGE_M:
        answers.add((scene.blocked(antenna + shift, point + shift, 2 * EDGE_M), scene.blocked(point + shift, point + shift + unit * 3000, 2 * EDGE_M)))
    return len(answers) > 1


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("canyon")
    parser.add_argument("--places", type=int, default=60)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--mesh", type=Path)
    args = parser.parse_args()
    triangles, materials = (read_collada(args.mesh), None) if args.mesh else boxes(args.seed)
    scene = Scene(triangles)
    draw = random.Random(args.seed + 1000)
    low, high = triangles.reshape(-1, 3).min(0), triangles.reshape(-1, 3).max(0)
    excess_off, field_off, lost, edges, counted = [], [], [], 0, 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        mesh = args.mesh.resolve() if args.mesh else folder / "street.obj"
        if not args.mesh:
            write_obj(mesh, triangles, materials)
        scenario = folder / "scenario.yaml"
        # Two antennas, one for each polarisation; the other is 200 dB weaker.
        scenario.write_text(
            f"city: {{mesh: {mesh}, origin: {{latitude_deg: {ORIGIN[0]}, longitude_deg: {ORIGIN[1]}, height_m: 0}}, facades: {{mix: as_given}}}}\n"
            "sky: {nominal: true, systems: [GPS, Galileo]}\nstart: 2026-06-01T08:00:00Z\nshadowing: {enabled: false}\n"
            "trajectory: {speed_mps: 1, waypoints: [{east_m: 0, north_m: 0, up_m: 2}, {east_m: 9, north_m: 0, up_m: 2}]}\n"
            "propagation: {model: specular, reflection_order: 1, ground_reflection: false, diffraction: {enabled: false}, diffuse: {enabled: false}}\n"
            "receivers:\n" + "".join(
                f"  - {{name: {hand}, profile: ublox-m8t, elevation_mask_deg: 0, signal: {{antenna_rows: [[-90, {rhcp}, {lhcp}], [90, {rhcp}, {lhcp}]], strength: {{slabs: false}}}}}}\n"
                for hand, rhcp, lhcp in (("right", 0, -200), ("left", -100, 0))))
        done = 0
        while done < args.places:
            antenna = np.array([draw.uniform(low[0] + 20, high[0] - 20), draw.uniform(low[1] + 20, high[1] - 20), 1.5 + draw.random() * 10])
            if scene.hits(antenna, np.array([0, 0, 1.0]), 2000) < math.inf:
                continue  # below a roof
            done += 1
            told = {}
            for hand in ("right", "left"):
                out = subprocess.run([args.canyon, "trace", scenario, "--enu", ",".join(f"{x:.6f}" for x in antenna), "--receiver", hand, "--json"],
                                     stdout=subprocess.PIPE, text=True, check=True).stdout
                told[hand] = json.loads(out)
            here = np.array(told["right"]["enu_m"])
            for right, left in zip(told["right"]["satellites"], told["left"]["satellites"]):
                azimuth, elevation = math.radians(right["azimuth_deg"]), math.radians(right["elevation_deg"])
                unit = np.array([math.cos(elevation) * math.sin(azimuth), math.cos(elevation) * math.cos(azimuth), math.sin(elevation)])
                # The angles are relative to the antenna's horizon, the mesh to that of its origin.
                unit = enu(*ORIGIN) @ enu(told["right"]["latitude_deg"], told["right"]["longitude_deg"]).T @ unit
                satellite = here + right["range_m"] * unit
                own = scene.reflections(here, satellite)
                theirs = [(p, q) for p, q in zip(right["paths"], left["paths"]) if p["kind"] == "reflected"]
                for excess, point, cosine, i in own:
                    counted += 1
                    match = [pair for pair in theirs if np.linalg.norm(np.array(pair[0]["point_enu_m"]) - point) < 0.5]
                    if not match:
                        if scene.near_edge(i, point) or shadow_edge(scene, here, point, satellite):
                            edges += 1
                        else:
                            lost.append(("Canyon misses", right["sat"], here, point))
                        continue
                    theirs.remove(match[0])
                    excess_off.append(abs(match[0][0]["excess_path_m"] - excess))
                    co, cross = circular(materials[i] if materials is not None else match[0][0]["material"], cosine)
                    # The loss is relative to the direct path, which is 100 dB weaker in the left-hand antenna.
                    for path, field, direct_db in ((match[0][0], co, 0), (match[0][1], cross, -100)):
                        if field > 1e-3:
                            field_off.append(abs(direct_db - path["loss_db"] - 20 * math.log10(field)))
                for path, _ in theirs:
                    point = np.array(path["point_enu_m"])
                    if any(scene.near_edge(i, point) for i in scene.at(point)) or shadow_edge(scene, here, point, satellite):
                        edges += 1
                    else:
                        lost.append(("Canyon alone has", right["sat"], here, point))
    excess_off, field_off = np.array(excess_off), np.array(field_off)
    print(f"{args.places} places, {counted} reflections; {edges} at edges are one program's alone, {len(lost)} others")
    print(f"excess path  median {np.median(excess_off):.5f} m, worst {excess_off.max():.5f} m")
    print(f"field        median {np.median(field_off):.3f} dB, worst {field_off.max():.3f} dB, both polarisations")
    for what, satellite, at, point in lost[:10]:
        print(f"{what} a reflection of {satellite} at {np.round(at, 2)}, mirror at {np.round(point, 2)}")
    bad = excess_off.max() > MOST_EXCESS_M or field_off.max() > MOST_FIELD_DB or lost or counted < 3 * args.places
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
