"""The pictures of the catalogue's force laws and signals: one function each, by name."""

import math

from pen import BLUE, GREEN, INK, PALE, RED


def _ends(p, x=1.55):
    p.box((-x, 0, 0), (0.35, 0.5, 0.8), PALE)
    p.box((x, 0, 0), (0.35, 0.5, 0.8), BLUE)


def _x(p, z=-0.85):
    p.arrow((-1.3, 0, z), (1.3, 0, z), "x", INK, (-4, 10))


def spring_damper(p):
    _ends(p)
    p.spring((-1.35, 0, 0.25), (1.3, 0, 0.25))
    p.damper((-1.35, 0, -0.25), (1.3, 0, -0.25))
    p.text((0, 0, 0.6), "k, free_length")
    p.text((0.55, 0, -0.25), "c", shift=(0, 9))
    _x(p)


def maxwell(p):
    _ends(p)
    p.spring((-1.35, 0, 0), (0.0, 0, 0))
    p.damper((0.0, 0, 0), (1.3, 0, 0))
    p.dot((0.0, 0, 0))
    p.text((-0.65, 0, 0.3), "k, z")
    p.text((0.6, 0, 0.3), "c")
    _x(p)


def zener(p):
    _ends(p)
    p.spring((-1.35, 0, 0.3), (1.3, 0, 0.3))
    p.spring((-1.35, 0, -0.25), (0.0, 0, -0.25))
    p.damper((0.0, 0, -0.25), (1.3, 0, -0.25))
    p.dot((0.0, 0, -0.25))
    p.text((0, 0, 0.6), "static_stiffness")
    p.text((-0.65, 0, -0.25), "k, z", shift=(0, 12))
    p.text((0.6, 0, -0.25), "c", shift=(0, 12))


def prony(p):
    _ends(p)
    p.spring((-1.35, 0, 0.5), (1.3, 0, 0.5))
    for z, name in ((0.0, "k1, T1"), (-0.5, "k2, T2")):
        p.spring((-1.35, 0, z), (0.0, 0, z))
        p.damper((0.0, 0, z), (1.3, 0, z))
        p.text((-0.65, 0, z), name, shift=(0, 11))
    p.text((0, 0, 0.75), "stiffness")


def prony_bushing(p):
    p.tube((-0.2, 0.9, 0), (-0.2, -0.9, 0), 0.75)
    p.tube((-0.2, 1.0, 0), (-0.2, -1.0, 0), 0.28, BLUE)
    p.text((-0.2, -0.9, -0.5), "k1, T1 ...", RED)
    p.arrow((-0.6, -0.9, -0.1), (0.9, -0.9, -0.1), "x rx", RED, (12, -2))


def lugre(p):
    p.box((0, 0, 0.6), (2.2, 0.5, 0.4), BLUE)
    p.box((0, 0, -0.7), (2.8, 0.5, 0.3), PALE)
    for k in range(7):
        p.line((-0.9 + 0.3 * k, 0, -0.55), (-0.75 + 0.3 * k, 0, 0.0), (-0.65 + 0.3 * k, 0, 0.4))
    p.arrow((0.3, 0, 0.95), (1.3, 0, 0.95), "v", INK)
    p.text((1.35, 0, 0.0), "z", RED)


def elasto_plastic(p):
    loop = ((-1.2, 0, -0.6), (-0.8, 0, 0.45), (1.2, 0, 0.65), (0.8, 0, -0.4))
    p.line(*loop, loop[0], color=RED)
    p.line((-1.5, 0, 0), (1.5, 0, 0), width=0.9)
    p.line((0, 0, -0.9), (0, 0, 0.9), width=0.9)
    p.text((1.5, 0, 0), "x", shift=(4, 10))
    p.text((-0.75, 0, 0.6), "yield_force", shift=(0, -4))


def cable(p, word="tension"):
    p.box((-1.5, 0, -0.7), (0.5, 0.5, 0.4), PALE)
    p.box((1.3, 0, -0.7), (0.7, 0.5, 0.5), BLUE)
    for x, z in ((-0.6, 0.4), (0.6, -0.1)):
        p.path(p.circle((x, 0, z), (0, 1, 0), 0.4))
        p.dot((x, 0, z))
    p.line((-1.5, 0, -0.5), (-0.99, 0, 0.48), color=RED)
    p.line((-0.36, 0, 0.72), (0.33, 0, -0.4), color=RED)
    p.line((0.98, 0, -0.2), (1.3, 0, -0.45), color=RED)
    p.text((0.1, 0, 0.45), word, RED)


def inextensible_cable(p):
    cable(p, "length")


def path_force(p):
    cable(p, "any law")


def polynomial_spring(p):
    _ends(p)
    p.spring((-1.35, 0, 0.25), (1.3, 0, 0.25))
    p.damper((-1.35, 0, -0.25), (1.3, 0, -0.25))
    p.text((0, 0, 0.6), "k d + k d^2 + ...")
    _x(p)


def gear_pair(p):
    p.path(p.circle((-0.7, 0, 0), (0, 1, 0), 0.6))
    p.path(p.circle((0.75, 0, 0), (0, 1, 0), 0.85))
    for x in (-0.7, 0.75):
        p.dot((x, 0, 0))
    p.line((-0.43, 0, -0.9), (0.23, 0, 0.9), color=RED, dash="4 3")
    p.arrow((-0.1, 0, 0), (0.16, 0, 0.72), "N", RED, (14, 4))
    p.text((-0.7, 0, -0.3), "A")
    p.text((0.75, 0, -0.3), "B")


def bevel_gear(p):
    p.tube((0.0, 0, 0.35), (0.0, 0, 0.0), 0.9, BLUE)
    p.tube((-1.35, 0, -0.4), (-0.95, 0, -0.4), 0.38)
    p.line((-0.95, 0, -0.02), (0, 0, -0.4), width=0.9, dash="4 3")
    p.line((-0.95, 0, -0.78), (0, 0, -0.4), width=0.9, dash="4 3")
    p.dot((0, 0, -0.4))
    p.arrow((-0.95, 0, -0.02), (-0.5, 0, -0.65), "N", RED, (4, 12))
    p.text((-1.65, 0, -0.4), "A")
    p.text((0.3, 0, 0.65), "B")


def worm_gear(p):
    p.tube((-1.3, 0, 0.75), (1.3, 0, 0.75), 0.3)
    for x in (-0.8, -0.4, 0.0, 0.4, 0.8):
        p.line((x - 0.1, 0, 0.45), (x + 0.1, 0, 1.05))
    p.path(p.circle((0, 0, -0.35), (0, 1, 0), 0.8))
    p.dot((0, 0, -0.35))
    p.arrow((0, 0, 0.45), (-0.7, 0, 0.2), "N", RED, (-8, 8))
    p.text((1.5, 0, 0.75), "A")
    p.text((0.0, 0, -0.65), "B")


def motor(p):
    p.tube((-0.7, 0, 0), (0.5, 0, 0), 0.6)
    p.tube((0.5, 0, 0), (1.2, 0, 0), 0.12, BLUE)
    p.turn((1.1, 0, 0), (1, 0, 0), 0.4, "kt i", shift=(18, -8))
    p.line((-1.6, 0, 0.3), (-0.7, 0, 0.3))
    p.line((-1.6, 0, -0.3), (-0.7, 0, -0.3))
    p.text((-1.55, 0, 0), "voltage", RED)


def hydraulic_cylinder(p):
    p.tube((0.6, 0, 0), (-1.4, 0, 0), 0.35)
    p.tube((1.6, 0, 0), (-0.4, 0, 0), 0.1, BLUE)
    p.text((-0.95, 0, 0), "p0", RED)
    p.text((0.25, 0, 0.2), "p1", RED)
    for x in (-1.1, 0.3):
        p.line((x, 0, -0.35), (x, 0, -0.8))
    p.box((-0.4, 0, -0.95), (1.9, 0.3, 0.25), PALE)
    p.text((-0.4, 0, -0.95), "valve")


def air_spring(p):
    p.tube((0, 0, -0.8), (0, 0, 0.1), 0.6)
    p.tube((0, 0, 0.1), (0, 0, 0.25), 0.55, BLUE)
    p.tube((0, 0, 0.25), (0, 0, 0.9), 0.12, BLUE)
    p.text((0, 0, -0.4), "pressure", RED)
    p.arrow((0.9, 0, -0.2), (0.9, 0, 0.6), "x", INK)


def actuator(p):
    _ends(p)
    p.tube((0.3, 0, 0), (-1.3, 0, 0), 0.2)
    p.tube((1.3, 0, 0), (0.3, 0, 0), 0.08, BLUE)
    p.text((-0.4, 0, 0.45), "f(x, v, t)", RED)
    p.arrow((1.0, 0, 0.3), (1.75, 0, 0.75), "+", RED)
    p.arrow((-1.0, 0, 0.3), (-1.75, 0, 0.75), "+", RED)
    _x(p)


def pd(p):
    _ends(p)
    p.spring((-1.35, 0, 0), (0.5, 0, 0))
    p.text((-0.4, 0, 0.35), "kp, kd")
    p.line((0.5, 0, -0.5), (0.5, 0, 0.5), color=RED, dash="4 3")
    p.text((0.5, 0, 0.7), "target(t)", RED)
    _x(p)


def bump_stop(p):
    lower, upper = -0.5, 0.4
    effort = lambda x: max(lower - x, 0) ** 2 * 4 - max(x - upper, 0) ** 2 * 4
    p.graph(effort, -1.0, 0.9, "x", "effort")
    for x, name in ((lower, "lower"), (upper, "upper")):
        place = -1.6 + 3.1 * (x + 1.0) / 1.9
        p.dot((place, 0, 0))
        p.text((place, 0, 0), name, shift=(0, 11))


def bushing(p):
    p.tube((-0.2, 0.9, 0), (-0.2, -0.9, 0), 0.75)
    p.tube((-0.2, 1.0, 0), (-0.2, -1.0, 0), 0.28, BLUE)
    for e, name in (((1, 0, 0), "x rx"), ((0, 1, 0), "y ry"), ((0, 0, 1), "z rz")):
        p.arrow(
            (-0.6, -0.9, -0.1),
            tuple(a + 1.5 * b for a, b in zip((-0.6, -0.9, -0.1), e, strict=True)),
            name,
            RED,
            (12, -2),
        )


def coulomb_friction(p):
    p.graph(lambda v: -0.6 * math.tanh(8 * v) * (1 + 0.5 * math.exp(-((v / 0.3) ** 2))), -1, 1, "v", "effort")
    p.text((1.1, 0, -0.6), "load", shift=(-4, 12))


def force(p):
    p.box((0.2, 0, -0.3), (1.5, 0.8, 0.7), BLUE)
    p.dot((0, 0, -0.2))
    p.arrow((0, 0, -0.2), (-0.9, 0, 0.85), "value [N]", shift=(0, -8))


def torque(p):
    p.box((0.2, 0, -0.3), (1.5, 0.8, 0.7), BLUE)
    p.turn((0.1, 0, 0.65), (0, 0, 1), 0.5, "value [N m]", shift=(-30, -8))


def wrench(p):
    p.box((0.2, 0, -0.3), (1.5, 0.8, 0.7), BLUE)
    p.dot((0, 0, -0.2))
    p.arrow((0, 0, -0.2), (-0.9, 0, 0.85), "force", shift=(0, -8))
    p.turn((0.55, 0, 0.65), (0, 0, 1), 0.4, "moment", shift=(24, -14))


def generalised_effort(p):
    for x, q in ((-1.3, "q1"), (-0.1, "q2"), (1.0, "q3")):
        p.box((x, 0, -0.3), (0.7, 0.5, 0.5), BLUE)
        p.arrow((x - 0.1, 0, 0.4), (x + 0.45, 0, 0.4), f"Q({q})")


def table(p):
    shape = lambda x: -0.5 * x - 0.5 * x**3
    p.graph(shape, -1, 1, "x", "effort", points=(-1, -0.6, -0.2, 0.2, 0.6, 1))


def constant(p):
    p.graph(lambda t: 0.5, 0, 1, "t", "value", zero=-0.9)


def ramp(p):
    p.graph(lambda t: -0.5 + 1.3 * t, 0, 1, "t", "start + rate t", zero=-0.9)


def harmonic(p):
    p.graph(lambda t: 0.1 + 0.7 * math.sin(9 * t + 0.5), 0, 1, "t", "mean + amplitude sin(...)", zero=-0.9)
    p.line((-1.6, 0, 0.1), (1.5, 0, 0.1), dash="3 3", width=0.9)


def trapezoid(p):
    def value(t):  # constant acceleration, speed, deceleration: quarters, halves
        s = min(max((t - 0.15) / 0.7, 0), 1)
        if s > 0.5:
            return -0.5 + 1.2 * (1 - moved(1 - s))
        return -0.5 + 1.2 * moved(s)

    moved = lambda s: s**2 / 0.42 if s < 0.3 else (0.09 + 0.6 * (s - 0.3)) / 0.42
    p.graph(value, 0, 1, "t", "value", zero=-0.9, points=(0.15, 0.85))
    p.text((-1.3, 0, -0.5), "before", shift=(0, -8))
    p.text((1.25, 0, 0.7), "distance", shift=(0, -8))


def cam_rise(p):
    p.graph(lambda t: -0.5 + 1.2 * (t - math.sin(2 * math.pi * t) / (2 * math.pi)), 0, 1, "t", "value", zero=-0.9)
    p.text((1.25, 0, 0.7), "rise", shift=(0, -8))


def chirp(p):
    p.graph(lambda t: 0.1 + 0.7 * math.sin(4 * t + 16 * t**2), 0, 1, "t", "mean + amplitude sin(...)", zero=-0.9)


def multisine(p):
    p.graph(
        lambda t: 0.1 + 0.22 * sum(math.sin(6 * k * t - math.pi * k * (k - 1) / 4) for k in (1, 2, 3, 4)),
        *(0, 1, "t", "mean + sum of sines"),
        zero=-0.9,
    )


def polynomial(p):
    p.graph(lambda t: -0.4 + 2.4 * t - 4.4 * t**2 + 3.0 * t**3, 0, 1, "t", "c0 + c1 t + c2 t^2 ...", zero=-0.9)


def step(p):
    def value(t):
        s = min(max((t - 0.3) / 0.4, 0), 1)
        return -0.5 + 1.2 * s**3 * (10 - s * (15 - 6 * s))

    p.graph(value, 0, 1, "t", "value", zero=-0.9)
    p.text((-1.1, 0, -0.5), "before", shift=(0, -8))
    p.text((1.1, 0, 0.7), "after", shift=(0, -8))
    for t in (0.3, 0.7):
        p.line((-1.6 + 3.1 * t, 0, -0.9), (-1.6 + 3.1 * t, 0, value(t)), dash="3 3", width=0.9, color=GREEN)
    p.text((-0.05, 0, -0.9), "duration", GREEN, (0, -6))


def spline(p):
    p.graph(
        lambda t: 0.55 * math.sin(7 * t) + 0.3 * t, 0, 1, "t", "values", zero=-0.9, points=(0, 0.2, 0.45, 0.7, 1.0)
    )


def beam_element(p):
    p.graph(lambda x: 0.5 * (1 - math.cos(1.4 * x)), 0, 1, "x", "", zero=0.0, points=(0, 1))
    p.text((-1.2, 0, -0.3), "A")
    p.text((1.2, 0, 0.6), "B", BLUE)
    p.text((0, 0, 0.6), "screw", RED)


LAWS = {
    "Actuator": actuator,
    "AirSpring": air_spring,
    "BeamElement": beam_element,
    "BumpStop": bump_stop,
    "Bushing": bushing,
    "Cable": cable,
    "CamRise": cam_rise,
    "Chirp": chirp,
    "Constant": constant,
    "FrictionForce": coulomb_friction,
    "ElastoPlastic": elasto_plastic,
    "Force": force,
    "BevelGear": bevel_gear,
    "GearPair": gear_pair,
    "WormGear": worm_gear,
    "GeneralisedEffort": generalised_effort,
    "Harmonic": harmonic,
    "HydraulicCylinder": hydraulic_cylinder,
    "InextensibleCable": inextensible_cable,
    "LuGre": lugre,
    "Maxwell": maxwell,
    "Motor": motor,
    "Multisine": multisine,
    "PathForce": path_force,
    "PD": pd,
    "Polynomial": polynomial,
    "PolynomialSpring": polynomial_spring,
    "Prony": prony,
    "PronyBushing": prony_bushing,
    "Ramp": ramp,
    "Spline": spline,
    "SpringDamper": spring_damper,
    "Step": step,
    "Table": table,
    "Torque": torque,
    "Trapezoid": trapezoid,
    "Wrench": wrench,
    "Zener": zener,
}
