"""Random trees and loops, repeatable by a seed, for the library and for the judge at the same pose and motion.

Bodies and joint frames are drawn in the world, the child's frame of every joint where the joint's own motion takes
the parent's: every loop is closed by construction, whatever its coordinates are.
"""

from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np
from scipy.spatial.transform import Rotation

import jaxmbs as mbs

from . import reference

GRAVITY = np.array([0.3, -0.5, -9.81])
REVERSIBLE = ("revolute", "prismatic", "cylindrical", "screw", "weld")
ROWS = {"revolute": 5, "prismatic": 5, "cylindrical": 4, "universal": 4, "spherical": 3, "planar": 3, "screw": 5}
SPATIAL = (*ROWS, "weld")
FLAT = ("revolute", "revolute", "revolute", "prismatic", "cylindrical", "spherical")
SHAPES = ("tree", "flat", "spatial", "both", "twin")
IDENTITY = (np.eye(3), np.zeros(3))


@dataclass(frozen=True)
class Topology:
    """Joints (kind, parent, child, twin of joint ... or -1) between n bodies and the ground -1."""

    seed: int
    shape: str
    bodies: int
    joints: tuple


def after(a, b):
    """Pose a, then b given in a."""
    return a[0] @ b[0], a[0] @ b[1] + a[1]


def back(a):
    """Inverse of a pose."""
    return a[0].T, -a[0].T @ a[1]


def topology(seed) -> Topology:
    """A random structure; the seed's remainder by five says whether it is a tree, planar loops, spatial loops,
    spatial loops with a joint doubled, or a tree with joints doubled."""
    random, shape = np.random.default_rng([7, seed]), SHAPES[seed % 5]
    n = int(
        random.integers(*{"tree": (2, 7), "flat": (3, 7), "spatial": (2, 6), "both": (2, 5), "twin": (2, 5)}[shape])
    )
    parents, path = [], [-1]
    for k in range(n):
        if shape in ("tree", "twin"):
            del path[1 + random.integers(0, len(path)) :]
        parents.append(path[-1])
        path.append(k)
    kinds = [str(random.choice(FLAT if shape == "flat" else SPATIAL)) for _ in range(n)]
    if shape == "tree" and random.random() < 0.4:
        kinds[0] = "free"
    joints = [(kind, p, k, -1) for k, (kind, p) in enumerate(zip(kinds, parents, strict=True))]
    joints += {"tree": _nothing, "flat": _flat, "spatial": _spatial, "both": _both, "twin": _twins}[shape](
        random, joints
    )
    joints = [_turned(random, j) for j in joints]
    if shape == "flat" and all(kind in REVERSIBLE for kind, *_ in joints):
        joints = [joints[k] for k in random.permutation(len(joints))]
    return Topology(seed, shape, n, tuple(joints))


def _nothing(random, joints):
    return []


def _flat(random, joints):
    """Bodies of a planar chain closed once or twice by pins: three rows of each are redundant."""
    n, found = len(joints), [("revolute", -1, len(joints) - 1, -1)]
    if n > 4:
        found.append(("revolute", int(random.integers(0, n - 3)), n - 2, -1))
    return found


def _spatial(random, joints):
    """Closures that leave at least one freedom, as far as freedoms are to be had."""
    freedoms, found, n = sum(reference.num_rates(kind) for kind, *_ in joints), [], len(joints)
    for _ in range(2):
        kind = str(random.choice(list(ROWS)))
        parent = int(random.integers(-1, n - 1))
        if freedoms - ROWS[kind] < 1 and found:
            break
        kind = kind if freedoms - ROWS[kind] >= 1 else "spherical"
        found.append((kind, parent, n - 1, -1))
        freedoms -= ROWS[kind]
    return found


def _twins(random, joints):
    """One or two joints doubled: a door on two hinges."""
    doubled = random.permutation(len(joints))[: random.integers(1, 3)]
    return [(*joints[k][:3], int(k)) for k in doubled]


def _both(random, joints):
    """Spatial closures, and one joint of the tree doubled."""
    return _spatial(random, joints) + _twins(random, joints)[:1]


def _turned(random, joint):
    """Some joints are declared the other way round."""
    kind, parent, child, twin = joint
    turn = kind in REVERSIBLE and twin < 0 and random.random() < 0.3
    return (kind, child, parent, twin) if turn else joint


def _motion(kind, q, pitch):
    """Pose of the child's frame in the parent's, canonical axes, at the coordinates q."""
    about = lambda axis, angle: Rotation.from_euler(axis, angle).as_matrix()
    x, y, z = np.eye(3)
    turned = lambda q: Rotation.from_quat(q[[1, 2, 3, 0]]).as_matrix()
    return {
        "revolute": lambda: (about("z", q[0]), np.zeros(3)),
        "prismatic": lambda: (np.eye(3), q[0] * z),
        "cylindrical": lambda: (about("z", q[1]), q[0] * z),
        "universal": lambda: (about("x", q[0]) @ about("y", q[1]), np.zeros(3)),
        "spherical": lambda: (turned(q), np.zeros(3)),
        "planar": lambda: (about("z", q[2]), q[0] * x + q[1] * y),
        "screw": lambda: (about("z", q[0]), pitch * q[0] * z),
        "free": lambda: (turned(q[3:]), q[:3]),
        "weld": lambda: IDENTITY,
    }[kind]()


def _coordinates(random, kind, spread, flat):
    """Random coordinates (7,) of a joint, unit quaternions (about z where flat); the neutral ones at spread 0."""
    q = spread * random.uniform(-1.0, 1.0, 7)
    quaternion = np.r_[1.0, spread * random.normal(size=3) * ([0, 0, 1] if flat else [1, 1, 1])]
    q[{"cylindrical": [0], "prismatic": [0], "planar": [0, 1], "free": [0, 1, 2]}.get(kind, [])] *= 0.3
    if kind in ("spherical", "free"):
        at = 0 if kind == "spherical" else 3
        q[at : at + 4] = quaternion / np.linalg.norm(quaternion)
    return q


class Drawn:
    """The numbers of one mechanism of a topology: `numbers` for the library, `mechanism` and `twist` for the judge.

    Args:
        setting: "plain"; "masses" spread over twelve decades; "positions" over six; "far" 10 km from the origin;
            "fast" rates of 200 rad/s.
        spread: of the coordinates, at most this many radians; 0 for the pose that all joints call zero.
    """

    def __init__(self, top: Topology, seed, setting="plain", spread=1.5):
        self.top, self.random, self.setting = top, np.random.default_rng([seed, top.seed]), setting
        self.flat, n = top.shape == "flat", top.bodies
        self.offset = np.array([6e3, -8e3, 0.0]) if setting == "far" else np.zeros(3)
        poses = [(self._rotation(), self._point()) for _ in range(n)]
        mass = self.random.uniform(0.5, 2.0, n) * (
            10.0 ** self.random.uniform(-6, 6, n) if setting == "masses" else 1
        )
        com = 0.3 * self.random.normal(size=(n, 3))
        inertia = mass[:, None, None] * np.array([self._box() for _ in range(n)])
        self.coordinates, joints = np.zeros((len(top.joints), 7)), []
        self.poses, self.frames = poses, []
        for k, (kind, parent, child, twin) in enumerate(top.joints):
            joints.append(self._joint(k, kind, parent, child, twin, spread))
        spring = n - 1, self._point(), 0.3 * self.random.normal(size=3), 30.0 * mass[-1], 0.5 * mass[-1], 0.4
        R, x = (np.array(v) for v in zip(*poses, strict=True))
        self.mechanism = reference.Mechanism(mass, com, inertia, R, x, tuple(joints), GRAVITY, spring)
        self.twist = reference.random_motion(self.mechanism, self.random, 200.0 if setting == "fast" else 2.0)

    def _rotation(self):
        if self.flat:
            return Rotation.from_euler("z", self.random.uniform(-3, 3)).as_matrix()
        return Rotation.random(random_state=self.random).as_matrix()

    def _point(self):
        scale = 10.0 ** self.random.uniform(-3, 3) if self.setting == "positions" else 0.7
        return scale * self.random.normal(size=3) * ([1, 1, 0] if self.flat else [1, 1, 1]) + self.offset

    def _box(self):
        a, b, c = 0.1 * self.random.uniform(0.5, 1.5, 3)
        R = Rotation.random(random_state=self.random).as_matrix()
        return R @ np.diag([b + c, c + a, a + b]) @ R.T

    def _turn(self, kind):
        """Canonical axes in the joint's frame: they choose its axis."""
        if kind in ("planar", "spherical", "free", "weld"):
            return np.eye(3)
        if not self.flat:
            return Rotation.random(random_state=self.random).as_matrix()
        along = Rotation.from_euler("z", self.random.uniform(-3, 3)).as_matrix()
        return along[:, [1, 2, 0]] if kind == "prismatic" else np.eye(3)

    def _joint(self, k, kind, parent, child, twin, spread):
        turn, pitch = self._turn(kind), self.random.uniform(0.05, 0.3)
        A = self._rotation(), self._point()
        self.coordinates[k] = q = _coordinates(self.random, kind, spread, self.flat)
        step = _motion(kind, q, pitch)
        B = after(A, after(after((turn, np.zeros(3)), step), (turn.T, np.zeros(3))))
        if twin >= 0:
            A, B, turn, pitch = self._shifted(twin, kind)
        self.frames.append((A, B, turn, pitch))
        world = [IDENTITY if b < 0 else self.poses[b] for b in (parent, child)]
        ends = [after(back(pose), frame) for pose, frame in zip(world, (A, B), strict=True)]
        return reference.Joint(kind, parent, child, *ends, turn, pitch)

    def _shifted(self, twin, kind):
        """The frames of another joint moved along its axis, where that changes nothing."""
        A, B, turn, pitch = self.frames[twin]
        along = 0.0 if kind in ("spherical", "universal") else self.random.uniform(0.3, 1.0)
        shift = np.eye(3), along * turn[:, 2]
        return after(A, shift), after(B, shift), turn, pitch

    @property
    def numbers(self):
        """Arrays for the library: the leaves of a batch."""
        m, joints = self.mechanism, self.mechanism.joints
        rates = np.zeros((len(joints), 6))
        for k, u in enumerate(reference.joint_rates(m, self.twist)):
            rates[k, : len(u)] = u
        frames = {
            f"{end}_{what}": np.array([getattr(j, f"{end}_frame")[part] for j in joints])
            for end in ("parent", "child")
            for part, what in enumerate(("rotation", "position"))
        }
        arrays = {"mass": m.mass, "com": m.com, "inertia": m.inertia, "coordinates": self.coordinates, "rates": rates}
        arrays |= {"turn": np.array([j.turn for j in joints]), "pitch": np.array([j.pitch for j in joints])}
        _, ground, point, stiffness, damping, free = m.spring
        spring = {"ground": ground, "point": point, "law": np.array([stiffness, damping, free])}
        return arrays | frames | spring


def kind_of(kind, turn, pitch):
    """The library's joint."""
    z = {"revolute": mbs.Revolute, "prismatic": mbs.Prismatic, "cylindrical": mbs.Cylindrical}
    if kind in z:
        return z[kind](axis=turn[:, 2])
    if kind == "screw":
        return mbs.Screw(axis=turn[:, 2], pitch=pitch)
    if kind == "universal":
        return mbs.Universal(axes=(turn[:, 0], turn[:, 1]))
    return {"spherical": mbs.Spherical, "planar": mbs.Planar, "free": mbs.Free, "weld": mbs.Weld}[kind]()


def build(top: Topology, numbers, like=None):
    """The library's system; body k is "b<k>", its joints "j<k>" in the order of the topology."""
    d, name = numbers, lambda k: "ground" if k < 0 else f"b{k}"
    b = mbs.SystemBuilder(gravity=GRAVITY)
    for k in range(top.bodies):
        b.body(name(k), mass=d["mass"][k], com=d["com"][k], inertia=d["inertia"][k])
    for k, (kind, parent, child, _) in enumerate(top.joints):
        ends = (mbs.Pose(d[f"{e}_position"][k], d[f"{e}_rotation"][k]) for e in ("parent", "child"))
        law = kind_of(kind, d["turn"][k], d["pitch"][k])
        b.joint(f"j{k}", law, name(parent), name(child), *ends)
    spring = mbs.SpringDamper(*d["law"])
    b.force("spring", spring, between=(("ground", d["ground"]), (name(top.bodies - 1), d["point"])))
    return b.build(like=like)


def state(system, top: Topology, numbers, assembled=True):
    """The state at the coordinates and rates drawn, assembled or written down."""
    guess, rates = {}, {}
    for k, (kind, *_) in enumerate(top.joints):
        record = system.topology.joints[system.topology.joint_index[f"j{k}"]]
        if not record.is_cut and reference.num_rates(kind):
            guess[f"j{k}"] = numbers["coordinates"][k, : reference.num_coordinates(kind)]
            rates[f"j{k}"] = numbers["rates"][k, : reference.num_rates(kind)]
    if assembled:
        return mbs.State.at(system, guess=guess, velocities=rates)
    t, record = system.topology, lambda name: system.topology.joints[system.topology.joint_index[name]]
    psi, u = jnp.zeros(t.num_coordinates), jnp.zeros(t.num_velocities)
    for name in guess:
        psi = psi.at[record(name).coordinates].set(guess[name])
        u = u.at[record(name).velocities].set(rates[name])
    return mbs.State(jnp.zeros(()), psi, u)
