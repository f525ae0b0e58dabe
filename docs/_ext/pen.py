"""A pen for the small pictures of the catalogue: SVG of lines, arrows, tubes, boxes, springs and curves."""

import math

INK, PALE, BLUE, RED, GREEN = "#333333", "#c4c8cc", "#8fb3d9", "#c0392b", "#3a7d44"
WIDTH, HEIGHT, UNIT = 180, 130, 42


def cross(a, b):
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def plus(a, b, factor=1.0):
    return tuple(x + factor * y for x, y in zip(a, b, strict=True))


def unit(a):
    size = math.sqrt(sum(x * x for x in a))
    return tuple(x / size for x in a)


def across(axis):
    """Two unit vectors that make a right-handed frame with the axis."""
    axis = unit(axis)
    first = unit(cross((0, 0, 1) if abs(axis[2]) < 0.9 else (0, -1, 0), axis))
    return first, cross(axis, first)


class Pen:
    """Points are (x, y, z): x to the right, y into the page, z up; the middle of the picture is the origin."""

    def __init__(self):
        self.parts = []

    def at(self, point):
        x, y, z = point
        return WIDTH / 2 + UNIT * (x + 0.45 * y), HEIGHT / 2 - UNIT * (z + 0.32 * y)

    def path(self, places, color=INK, width=1.5, fill="none", dash="", closed=False):
        steps = "L".join(f"{x:.1f} {y:.1f}" for x, y in places)
        extra = f' stroke-dasharray="{dash}"' if dash else ""
        self.parts.append(
            f'<path d="M{steps}{"Z" * closed}" stroke="{color}" stroke-width="{width}" fill="{fill}"{extra}/>'
        )

    def line(self, *points, **look):
        self.path([self.at(p) for p in points], **look)

    def axis(self, a, b):
        self.line(a, b, width=0.9, dash="5 2 1 2")

    def text(self, point, words, color=INK, shift=(0, 0), anchor="middle"):
        x, y = self.at(point)
        place = f'x="{x + shift[0]:.1f}" y="{y + shift[1] + 3:.1f}"'
        self.parts.append(f'<text {place} fill="{color}" text-anchor="{anchor}">{words}</text>')

    def head(self, end, before, color):
        (x, y), (u, v) = end, before
        size = math.hypot(x - u, y - v) or 1.0
        c, s = (x - u) / size, (y - v) / size
        corners = [(x, y), (x - 7 * c + 3 * s, y - 7 * s - 3 * c), (x - 7 * c - 3 * s, y - 7 * s + 3 * c)]
        self.path(corners, color=color, width=0.5, fill=color, closed=True)

    def arrow(self, a, b, words="", color=RED, shift=(0, -7)):
        self.line(a, b, color=color)
        self.head(self.at(b), self.at(a), color)
        if words:
            self.text(b, words, color, shift)

    def circle(self, centre, axis, radius, first=0.0, last=2 * math.pi):
        """Places on a circle, right-handed about its axis."""
        e, f = across(axis)
        angles = [first + (last - first) * i / 28 for i in range(29)]
        return [self.at(plus(plus(centre, e, radius * math.cos(a)), f, radius * math.sin(a))) for a in angles]

    def turn(self, centre, axis, radius=0.42, words="", color=RED, shift=(0, -8), first=0.4, last=5.0):
        places = self.circle(centre, axis, radius, first, last)
        self.path(places, color=color)
        self.head(places[-1], places[-3], color)
        if words:
            x, y = places[-1]
            self.text(centre, words, color, (x - self.at(centre)[0] + shift[0], y - self.at(centre)[1] + shift[1]))

    def tube(self, a, b, radius=0.2, fill=PALE):
        axis = plus(b, a, -1.0)
        ends = self.circle(a, axis, radius), self.circle(b, axis, radius)
        self.path(hull([*ends[0], *ends[1]]), fill=fill, closed=True)
        seen = ends[1] if axis[1] - 0.01 < 0 or (axis[1] < 0.01 and axis[0] + axis[2] > 0) else ends[0]
        self.path(seen, fill=fill, width=0.9, closed=True)

    def box(self, centre, size, fill=BLUE):
        corner = lambda i, j, k: self.at(plus(centre, (i * size[0] / 2, j * size[1] / 2, k * size[2] / 2)))
        for face in (
            ((-1, -1, -1), (1, -1, -1), (1, -1, 1), (-1, -1, 1)),
            ((-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)),
            ((1, -1, -1), (1, 1, -1), (1, 1, 1), (1, -1, 1)),
        ):
            self.path([corner(*c) for c in face], fill=fill, width=1.1, closed=True)

    def ball(self, centre, radius, fill=BLUE):
        x, y = self.at(centre)
        place = f'cx="{x:.1f}" cy="{y:.1f}" r="{radius * UNIT:.1f}"'
        self.parts.append(f'<circle {place} stroke="{INK}" stroke-width="1.2" fill="{fill}"/>')

    def dot(self, point, color=INK):
        x, y = self.at(point)
        self.parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="2.6" fill="{color}"/>')

    def plane(self, *corners, fill="#eceef0"):
        self.path([self.at(c) for c in corners], color="#888888", width=0.9, fill=fill, closed=True)

    def frame(self, origin, size=0.45, color=INK, axes=((1, 0, 0), (0, 1, 0), (0, 0, 1)), names="xyz"):
        for e, name in zip(axes, names, strict=True):
            self.arrow(origin, plus(origin, e, size), name, color, (5, -4))

    def spring(self, a, b, width=0.13, coils=5):
        e, n = plus(b, a, -1.0), 2 * coils
        side = unit((-e[2], 0, e[0]) if abs(e[0]) + abs(e[2]) > 0 else (1, 0, 0))
        inner = [plus(plus(a, e, 0.2 + 0.6 * (i + 0.5) / n), side, width * (-1) ** i) for i in range(n)]
        self.line(a, plus(a, e, 0.2), *inner, plus(a, e, 0.8), b)

    def damper(self, a, b, width=0.13):
        e = plus(b, a, -1.0)
        side = unit((-e[2], 0, e[0]))
        at = lambda s, w=0.0: plus(plus(a, e, s), side, w)
        self.line(a, at(0.4))
        self.line(at(0.65, width), at(0.4, width), at(0.4, -width), at(0.65, -width))
        self.line(at(0.55, width * 0.8), at(0.55, -width * 0.8))
        self.line(at(0.55), b)

    def hatch(self, a, b, below=(0, 0, -0.12)):
        """Fixed ground along a line."""
        self.line(a, b, width=2.0)
        for i in range(9):
            start = plus(a, plus(b, a, -1.0), (i + 0.5) / 9)
            self.line(start, plus(plus(start, below), plus(b, a, -1.0), -0.04), width=0.8)

    def graph(self, function, low=-1.0, high=1.0, across_name="t", up_name="", zero=0.0, color=RED, points=()):
        """A curve over an axis; values between -1 and 1 fill the picture."""
        self.arrow((-1.75, 0, zero), (1.75, 0, zero), color=INK)
        self.text((1.75, 0, zero), across_name, shift=(0, 10))
        origin = -1.6 if low >= 0 else 0.0
        self.arrow((origin, 0, -1.15), (origin, 0, 1.25), color=INK)
        self.text((origin, 0, 1.25), up_name, shift=(6, 2), anchor="start")
        place = lambda t: -1.6 + 3.1 * (t - low) / (high - low)
        ts = [low + (high - low) * i / 80 for i in range(81)]
        self.line(*[(place(t), 0, function(t)) for t in ts], color=color, width=2.0)
        for t in points:
            self.dot((place(t), 0, function(t)))

    def svg(self):
        look = 'font-family="sans-serif" font-size="10" stroke-linejoin="round" stroke-linecap="round"'
        text = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}" {look}>']
        text += [f'<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>', *self.parts, "</svg>"]
        return "\n".join(text) + "\n"


def hull(places):
    """The convex hull of places, in order."""
    places = sorted(set(places))
    found = []
    for run in (places, places[::-1]):
        part = []
        for p in run:
            while len(part) > 1 and _bend(part[-2], part[-1], p) <= 0:
                part.pop()
            part.append(p)
        found += part[:-1]
    return found


def _bend(a, b, c):
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
