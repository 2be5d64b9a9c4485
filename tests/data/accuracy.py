#!/usr/bin/env python3
"""Makes accuracy.json from accuracy_inputs.json: light space, warp and fit with 50 digits and more, from stored unit vectors and vertices.

Written from the equations, with no look at the library's code: n, f and the centre of projection are not formed here either, but
nothing else is rearranged, and so many digits need no care. Needs mpmath.
"""
import json
import os
import random

from mpmath import mp, mpf, sqrt

# The excess of the damped rule is sqrt(1 + 1e-44) - 1 in the hardest row.
mp.dps = 100
HERE = os.path.dirname(os.path.abspath(__file__))


def vec(v):
    return [mpf(x) for x in v]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def scaled(a, s):
    return [x * s for x in a]


def unit(a):
    return scaled(a, 1 / sqrt(dot(a, a)))


def frame(forward, up, to_light):
    """X, Y, Z and the sine; Y is the stored vector, unit to one rounding."""
    v, y = vec(forward), vec(to_light)
    across = cross(v, y)
    sine = sqrt(dot(across, across))
    x = unit(across if sine > 0 else cross(vec(up), y))
    return x, y, cross(y, x), sine


def fixed_axes(y):
    y = unit(y)
    half_way = [y[0], y[1] + 1, y[2]]
    length = dot(half_way, half_way)
    mirror = 2 * half_way[0] / length if length else mpf(0)
    x = [c - mirror * h for c, h in zip([mpf(1), mpf(0), mpf(0)], half_way)]
    return x, cross(y, x)


def excess(rule, near, far, d, s):
    return {
        "extent": lambda: sqrt(1 + d * s / near) - 1,
        "damped": lambda: sqrt(1 + d * s * s / near) - 1,
        "view depth": lambda: d * s / (near + sqrt(near * far)),
        "depth": lambda: s * (sqrt(1 + d / near) - 1),
    }[rule]()


def extremes(values):
    values = list(values)
    return min(values), max(values)


def solve(case):
    x, y, z, sine = frame(case["forward"], case["up"], case["to_light"])
    y = unit(y)
    body = [vec(q) for q in case["vertices"]]
    origin, eye, forward = vec(case["origin"]), vec(case["eye"]), vec(case["forward"])
    to_eye = [a - b for a, b in zip(eye, origin)]
    z0, z1 = extremes(dot(z, q) for q in body)
    x0, x1 = extremes(dot(x, q) for q in body)
    y0, y1 = extremes(dot(y, q) for q in body)
    d = z1 - z0
    eta = mpf(case["excess"])
    result = {}
    if case["rule"] != "given":
        depths = [dot(forward, [a - b for a, b in zip(q, to_eye)]) for q in body]
        near, far = [max(depth, mpf(case["near"])) for depth in extremes(depths)]
        result["excess"] = float(excess(case["rule"], near, far, d, sine))

    def w(q):
        return 1 + eta * (dot(z, q) - z0) / d

    if case["axes"] == "view":
        axes, centre = (x, z), (min(max(dot(x, to_eye), x0), x1), z0)
    else:
        axes = fixed_axes(y)
        centre = [sum(extremes(dot(axis, q) for q in body)) / 2 for axis in axes]
    middle = (y0 + y1) / 2

    def plane(q):
        sides = [(dot(axis, q) - c) / w(q) for axis, c in zip(axes, centre)]
        return sides + [(dot(y, q) - middle) / w(q)]

    ends = [extremes(values) for values in zip(*[plane(q) for q in body])]

    def ndc(q):
        a, b, h = plane(q)
        (a0, a1), (b0, b1), (h0, h1) = ends
        return [float((2 * a - a0 - a1) / (a1 - a0)), float((2 * b - b0 - b1) / (b1 - b0)), float((h1 - h) / (h1 - h0))]

    result["probes"] = [ndc(vec(q)) for q in case["probes"]]
    result["probes_from_eye"] = [ndc([a + b for a, b in zip(vec(q), to_eye)]) for q in case["probes_from_eye"]]
    return result


def pair(value):
    """A double and what is left over."""
    high = float(value)
    return [high, float(value - mpf(high))]


def functions():
    rng = random.Random(1)

    def spread(low, high):
        return float(mp.exp(rng.uniform(float(mp.log(low)), float(mp.log(high)))))

    warps = [(eta, t) for eta in (0.0, 1e-300, 1.0, 1e8) for t in (0.0, 1e-12, 0.5, 1.0)]
    for _ in range(300):
        t = rng.choice([rng.random(), spread(1e-12, 1), 1 - spread(1e-12, 1)])
        warps.append((spread(1e-12, 1e8), t))
    table = {"map_from_body": [], "body_from_map": [], "density": []}
    for x in warps:
        eta, t = mpf(x[0]), mpf(x[1])
        table["map_from_body"].append({"x": x, "y": pair((1 + eta) * t / (1 + eta * t))})
        table["body_from_map"].append({"x": x, "y": pair(t / (1 + eta - eta * t))})
        table["density"].append({"x": x, "y": pair((1 + eta) / (1 + eta * t) ** 2)})
    slabs = []
    for _ in range(300):
        near = spread(1e-6, 1e6)
        slabs.append((near, near * spread(1, 1e12), near * spread(1e-12, 1e12), rng.choice([1.0, spread(1e-16, 1)])))
    for rule in ("extent", "damped", "view depth", "depth"):
        table["excess " + rule] = [{"x": x, "y": pair(excess(rule, *vec(x)))} for x in slabs]
    return table


def frames(rows):
    for row in rows:
        x, y, z, sine = frame(row["forward"], row["up"], row["to_light"])
        x_fixed, z_fixed = fixed_axes(y)
        axes = {"x": x, "y": y, "z": z, "x_fixed": x_fixed, "z_fixed": z_fixed}
        yield {"sin_gamma": pair(sine), **{name: [pair(c) for c in axis] for name, axis in axes.items()}}


def main():
    with open(os.path.join(HERE, "accuracy_inputs.json")) as file:
        inputs = json.load(file)
    results = {
        "maps": [solve(case) for case in inputs["maps"]],
        "frames": list(frames(inputs["frames"])),
        "functions": functions(),
    }
    rows = lambda items: "[\n" + ",\n".join(json.dumps(item) for item in items) + "\n]"
    parts = [f'"maps": {rows(results["maps"])}', f'"frames": {rows(results["frames"])}']
    tables = ",\n".join(f'"{name}": {rows(items)}' for name, items in results["functions"].items())
    with open(os.path.join(HERE, "accuracy.json"), "w") as file:
        file.write("{\n" + ",\n".join(parts) + ',\n"functions": {\n' + tables + "\n}\n}\n")


if __name__ == "__main__":
    main()
