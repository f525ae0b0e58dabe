"""The pictures of the catalogue's joints, constraints, laws and signals: one function each, by name.

Grey is the parent, frame A or the ground; blue the child or frame B; red is what the coordinates or laws are.
"""

import math

from pen import BLUE, GREEN, INK, PALE, RED

X, Y, Z = (1, 0, 0), (0, 1, 0), (0, 0, 1)


def revolute(p):
    p.tube((0, 0, -1.0), (0, 0, -0.1), 0.25)
    p.tube((0, 0, -0.1), (0, 0, 0.35), 0.25, BLUE)
    p.tube((1.6, 0, 0.12), (0.2, 0, 0.12), 0.12, BLUE)
    p.axis((0, 0, -1.3), (0, 0, 1.3))
    p.turn((0, 0, 0.8), Z, 0.5, "angle", shift=(-24, 0))


def prismatic(p):
    p.box((0, 0, -0.25), (3.2, 0.4, 0.25), PALE)
    p.box((-0.2, 0, 0.1), (0.9, 0.6, 0.45), BLUE)
    p.arrow((0.55, 0, 0.2), (1.6, 0, 0.2), "distance", shift=(-16, -8))


def cylindrical(p):
    p.tube((1.7, 0, 0), (-1.7, 0, 0), 0.14)
    p.tube((0.5, 0, 0), (-0.5, 0, 0), 0.32, BLUE)
    p.tube((0, 0, 0.3), (0, 0, 0.95), 0.09, BLUE)
    p.arrow((0.7, 0, -0.55), (1.6, 0, -0.55), "distance", shift=(-14, 11))
    p.turn((-1.05, 0, 0), X, 0.5, "angle", shift=(-6, -34))


def screw(p):
    p.tube((1.7, 0, 0), (-1.7, 0, 0), 0.17)
    for i in range(17):
        x = -1.55 + 0.19 * i
        p.line((x, 0, -0.17), (x + 0.1, 0, 0.17), width=0.9)
    p.tube((0.35, 0, 0), (-0.35, 0, 0), 0.36, BLUE)
    p.turn((-0.95, 0, 0), X, 0.5, "angle", shift=(-6, -34))
    p.arrow((0.5, 0, 0.55), (1.5, 0, 0.55), "pitch x angle", INK, shift=(-24, -8))


def universal(p):
    p.tube((-1.7, 0, 0), (-0.7, 0, 0), 0.14)
    p.line((-0.7, 0, 0), (-0.4, 0, 0.5), (0, 0, 0.5), width=5, color="#9aa0a6")
    p.line((-0.7, 0, 0), (-0.4, 0, -0.5), (0, 0, -0.5), width=5, color="#9aa0a6")
    p.line((0.75, 0, 0), (0.4, -0.55, 0), (0, -0.55, 0), width=5, color=BLUE)
    p.line((0.75, 0, 0), (0.4, 0.55, 0), (0, 0.55, 0), width=5, color=BLUE)
    p.tube((1.7, 0, 0), (0.75, 0, 0), 0.14, BLUE)
    p.line((0, 0, -0.5), (0, 0, 0.5), width=3)
    p.line((0, -0.55, 0), (0, 0.55, 0), width=3)
    p.turn((0, 0, 0.85), Z, 0.3, "first", shift=(-18, 0))
    p.turn((0, -1.1, 0), Y, 0.26, "second", shift=(24, 10))


def spherical(p):
    p.path(p.circle((0, 0, 0), Y, 0.55, 2.4, 7.0), width=6, color="#9aa0a6")
    p.line((0, 0, -0.6), (0, 0, -1.2), width=6, color="#9aa0a6")
    p.tube((0.2, 0, 0.2), (1.2, 0, 1.0), 0.12, BLUE)
    p.ball((0, 0, 0), 0.4)
    p.turn((1.0, 0, -0.35), X, 0.25)
    p.turn((-1.0, 0.3, 0), Y, 0.25)
    p.turn((-0.75, 0, 0.85), Z, 0.28)
    p.text((1.1, 0, -1.0), "w x y z", RED)


def planar(p):
    p.plane((-1.7, -1.0, -0.3), (1.3, -1.0, -0.3), (1.7, 1.2, -0.3), (-1.3, 1.2, -0.3))
    p.box((0.1, 0, -0.1), (0.8, 0.8, 0.35), BLUE)
    p.arrow((-1.4, -0.7, -0.3), (-0.6, -0.7, -0.3), "x", shift=(4, 8))
    p.arrow((-1.4, -0.7, -0.3), (-1.4, 0.3, -0.3), "y", shift=(-6, -4))
    p.axis((0.1, 0, 0), (0.1, 0, 1.2))
    p.turn((0.1, 0, 0.65), Z, 0.42, "angle", shift=(-24, 0))


def free(p):
    p.frame((-1.2, 0, -0.6), 0.5)
    p.box((0.75, 0, 0.3), (0.8, 0.5, 0.5), BLUE)
    p.arrow((-1.2, 0, -0.6), (0.72, 0, 0.28), "x y z", shift=(-44, 8))
    p.turn((0.75, 0, 0.95), Z, 0.3, "qw qx qy qz", shift=(-8, -8))


def weld(p):
    p.box((-0.7, 0, 0), (1.3, 0.6, 0.5), PALE)
    p.box((0.65, 0, 0), (1.3, 0.6, 0.5), BLUE)
    p.line((0, -0.3, -0.25), (0, -0.3, 0.25), (0, 0.3, 0.25), width=4, color=INK)


def coupler(p):
    for x, r, name in ((-0.7, 0.5, "q1"), (0.75, 0.95, "q2")):
        p.path(p.circle((x, 0, 0), Y, r), fill=BLUE if x > 0 else PALE, closed=True)
        p.path(p.circle((x, 0, 0), Y, r + 0.06), dash="3 3")
        p.dot((x, 0, 0))
        p.turn((x, 0, 0), Y, r * 0.55, name, shift=(0, 12), first=3.6, last=7.4)
    p.text((0, 0, 1.25), "c1 q1 + c2 q2 = offset")


def distance(p):
    p.box((-1.2, 0, -0.5), (0.7, 0.5, 0.5), PALE)
    p.box((1.2, 0, 0.4), (0.7, 0.5, 0.5), BLUE)
    p.line((-0.95, 0, -0.3), (0.95, 0, 0.25), width=3)
    p.ball((-0.95, 0, -0.3), 0.1, "white")
    p.ball((0.95, 0, 0.25), 0.1, "white")
    p.text((0, 0, 0.15), "length", shift=(-8, -4))
    p.arrow((0.95, 0, -0.25), (1.6, 0, -0.06), "+", shift=(4, 9))
    p.arrow((-0.95, 0, 0.2), (-1.6, 0, 0.01), "+", shift=(-4, -8))


def point_on_plane(p):
    p.plane((-1.7, -1.0, -0.4), (1.2, -1.0, -0.4), (1.7, 1.2, -0.4), (-1.2, 1.2, -0.4))
    p.line((0.2, 0, -0.4), (0.9, 0, 0.75), width=5, color=BLUE)
    p.dot((0.2, 0, -0.4), RED)
    p.text((0.2, 0, -0.4), "B", RED, (-9, -4))
    p.arrow((-1.1, -0.4, -0.4), (-1.1, -0.4, 0.35), "z of A", INK)


def point_on_line(p):
    p.line((-1.6, 0, -0.8), (1.5, 0, 0.75), width=2, color="#888888")
    p.head(p.at((1.5, 0, 0.75)), p.at((0, 0, 0)), "#888888")
    p.text((1.5, 0, 0.75), "z of A", shift=(-4, -8))
    p.line((0.2, 0, 0.1), (0.9, 0, -0.9), width=5, color=BLUE)
    p.dot((0.2, 0, 0.1), RED)
    p.text((0.2, 0, 0.1), "B", RED, (-8, -6))


def frame_path(p):
    curve = [(-1.6 + 0.08 * i, 0, 0.5 * math.sin(0.11 * i - 0.6)) for i in range(37)]
    p.line(*curve, dash="4 3", color=RED)
    p.frame((-0.9, 0, -1.0), 0.4, "#777777")
    p.box((0.37, 0, 0.45), (0.5, 0.4, 0.4), BLUE)
    p.dot(curve[25], RED)
    p.text((1.25, 0, 0.15), "path(t)", RED, (0, 14))


def knife_edge(p):
    p.plane((-1.7, -1.0, -0.4), (1.2, -1.0, -0.4), (1.7, 1.2, -0.4), (-1.2, 1.2, -0.4))
    p.path(
        [p.at(c) for c in ((-0.5, 0, -0.4), (0.5, 0, -0.4), (0.6, 0, 0.3), (-0.6, 0, 0.3))], fill=BLUE, closed=True
    )
    p.arrow((0.6, 0, -0.4), (1.35, 0, -0.4), "along", GREEN, (4, -8))
    p.arrow((0.35, -0.3, -0.4), (0.35, -0.95, -0.4), "0", RED, (-8, 0))


def rolling_disk(p):
    p.plane((-1.7, -1.0, -0.7), (1.2, -1.0, -0.7), (1.7, 1.2, -0.7), (-1.2, 1.2, -0.7))
    p.path(p.circle((0, 0, 0), Y, 0.7), fill=BLUE, closed=True)
    p.axis((0, -1.0, 0), (0, 1.2, 0))
    p.text((0, -1.0, 0), "axle", shift=(-14, 2))
    p.line((0, 0, 0), (0.5, 0, 0.5), width=1)
    p.text((0.35, 0, 0.3), "radius", shift=(4, 12), anchor="start")
    p.dot((0, 0, -0.7), RED)
    p.turn((0, 0, 0), Y, 0.85, first=1.9, last=3.6)


def rolling_sphere(p):
    p.plane((-1.7, -1.0, -0.7), (1.2, -1.0, -0.7), (1.7, 1.2, -0.7), (-1.2, 1.2, -0.7))
    p.ball((0, 0, 0), 0.7)
    p.line((0, 0, 0), (0, 0, -0.7), width=1)
    p.text((0, 0, -0.3), "radius", shift=(4, 0), anchor="start")
    p.dot((0, 0, -0.7), RED)
    p.turn((0, 0, 0), Y, 0.85, first=1.9, last=3.6)


def rows(p):
    p.text((0, 0, 0.7), "f(q, t) = 0", RED)
    p.line(*[(1.1 * math.cos(0.2 * i), 0, -0.35 + 0.6 * math.sin(0.2 * i)) for i in range(33)], color=RED)
    p.dot((0.78, 0, 0.07))
    p.text((0.78, 0, 0.07), "q", shift=(9, -5))


def velocity_rows(p):
    p.text((0, 0, 0.8), "f(q, u, t) = 0", RED)
    p.dot((-0.6, 0, -0.3))
    p.arrow((-0.6, 0, -0.3), (0.5, 0, 0.1), "u", GREEN, (8, 0))
    p.arrow((-0.6, 0, -0.3), (-0.85, 0, 0.4), "0", RED, (0, -7))


JOINTS = {
    "Coupler": coupler,
    "Cylindrical": cylindrical,
    "Distance": distance,
    "FramePath": frame_path,
    "Free": free,
    "KnifeEdge": knife_edge,
    "Planar": planar,
    "PointOnLine": point_on_line,
    "PointOnPlane": point_on_plane,
    "Prismatic": prismatic,
    "Revolute": revolute,
    "RollingDisk": rolling_disk,
    "RollingSphere": rolling_sphere,
    "PositionRows": rows,
    "Screw": screw,
    "Spherical": spherical,
    "Universal": universal,
    "VelocityRows": velocity_rows,
    "Weld": weld,
}
