"""The mechanisms of the reference cases, one function each, with the parameters of the case as defaults."""

import jax.numpy as jnp
import numpy as np
from scipy.integrate import solve_ivp

import jaxmbs as mbs

DOWN_Y = (0.0, -9.81, 0.0)  # gravity of the planar cases, which live in the plane z = 0
NO_GRAVITY = (0.0, 0.0, 0.0)


def simple_pendulum(mass=1.0, length=1.0):
    """A01: a point on a massless rod; angle from the downward vertical, about z."""
    b = mbs.SystemBuilder(gravity=DOWN_Y)
    b.body("bob", mass=mass, com=(0.0, -length, 0.0))
    b.joint("pivot", mbs.Revolute(axis="z"), parent="ground", child="bob")
    b.frame("tip", on="bob", position=(0.0, -length, 0.0))
    return b.build()


def n_four_bar(n, linear_solver="auto"):
    """A02: n windows of cranks and couplers, uniform rods of 1 kg, 1 m; coordinates are zero, cranks up."""
    b = mbs.SystemBuilder(gravity=DOWN_Y)
    upright, level = mbs.inertia.rod(1.0, 1.0, axis="y"), mbs.inertia.rod(1.0, 1.0, axis="x")
    for i in range(n + 1):
        b.body(f"crank_{i}", mass=1.0, com=(0.0, 0.5, 0.0), inertia=upright, position=(float(i), 0.0, 0.0))
    for i in range(n):
        b.body(f"coupler_{i}", mass=1.0, com=(0.5, 0.0, 0.0), inertia=level, position=(float(i), 1.0, 0.0))
    pin = mbs.Revolute(axis="z")
    for i in range(n + 1):
        b.joint(f"A{i}", pin, parent="ground", child=f"crank_{i}", at=(float(i), 0.0, 0.0))
    for i in range(n):
        b.joint(f"left_{i}", pin, parent=f"crank_{i}", child=f"coupler_{i}", at=(float(i), 1.0, 0.0))
        b.joint(f"right_{i}", pin, parent=f"coupler_{i}", child=f"crank_{i + 1}", at=(i + 1.0, 1.0, 0.0))
    b.frame("B0", on="crank_0", position=(0.0, 1.0, 0.0))
    return b.build(linear_solver=linear_solver)


def n_four_bar_state(system, angle, rate=-1.0):
    """The state of a row whose cranks have one angle and rate, the couplers level."""
    value = {"A": (angle, rate), "l": (-angle, -rate)}
    psi, u = np.array([value[name[0]] for name, *_ in system.topology.structure]).T
    return mbs.State(jnp.zeros(()), jnp.array(psi), jnp.array(u), structure=system.topology.structure)


def n_four_bar_acceleration(n, angle):
    """Of the cranks, by the one equation of a row: rods of 1 kg and 1 m."""
    return 9.81 * ((n + 1) / 2 + n) / ((n + 1) / 3 + n) * np.sin(angle)


def n_four_bar_angle(n, start, end, rate=-1.0):
    """The cranks' angle at a time, or at increasing times, by this equation and SciPy's DOP853."""
    slope = lambda t, y: [y[1], n_four_bar_acceleration(n, y[0])]
    times = np.atleast_1d(end)
    angles = solve_ivp(slope, (0.0, times[-1]), [start, rate], "DOP853", times, rtol=1e-13, atol=1e-13).y[0]
    return angles if np.ndim(end) else angles[0]


ANDREWS = {
    "masses": (0.04325, 0.00365, 0.02373, 0.00706, 0.0705, 0.00706, 0.05498),
    "inertias": (2.194e-6, 4.41e-7, 5.255e-6, 5.667e-7, 1.169e-5, 5.667e-7, 1.912e-5),
}


def andrews(torque=0.033, stiffness=4530.0, free_length=0.07785):
    """A03: Andrews' squeezing mechanism.

    Joint coordinates are the angles of the IVP test set: beta and Theta along K1, K2; gamma of K3; delta
    and Phi along K5, K4; epsilon and Omega along K7, K6.  The pins E3, E4, E6 at the end E of K2 close the
    loops, so the multipliers (1, 2), (3, 4), (5, 6) are the forces of K2 on K3, K4 and K6 there.
    """
    b = mbs.SystemBuilder(gravity=NO_GRAVITY)
    coms = {  # in body axes
        "K1": (0.00092, 0.0, 0.0),
        "K2": (-0.0115, 0.0, 0.0),
        "K3": (0.01043, -0.01874, 0.0),
        "K4": (0.0, -(0.02 - 0.01421), 0.0),
        "K5": (0.02308, 0.00916, 0.0),
        "K6": (0.02 - 0.01421, 0.0, 0.0),
        "K7": (-0.00449, -0.01228, 0.0),
    }
    for (name, com), mass, inertia in zip(coms.items(), ANDREWS["masses"], ANDREWS["inertias"], strict=True):
        b.body(name, mass=mass, com=com, inertia=inertia * np.ones(3))
    A, B, C = (-0.06934, -0.00227, 0.0), (-0.03635, 0.03273, 0.0), (0.014, 0.072, 0.0)
    E_on_K2 = (-0.028, 0.0, 0.0)

    def pin(name, parent, child, parent_frame=None, child_frame=None):
        b.joint(name, mbs.Revolute(axis="z"), parent, child, parent_frame, child_frame)

    pin("beta", "ground", "K1")
    pin("Theta", "K1", "K2", parent_frame=(0.007, 0.0, 0.0))
    pin("gamma", "ground", "K3", parent_frame=B)
    pin("delta", "ground", "K5", parent_frame=A)
    pin("Phi", "K5", "K4", parent_frame=(0.04, 0.0, 0.0))
    pin("epsilon", "ground", "K7", parent_frame=A)
    pin("Omega", "K7", "K6", parent_frame=(0.0, -0.04, 0.0))
    pin("E3", "K2", "K3", parent_frame=E_on_K2, child_frame=(0.0, -0.035, 0.0))
    pin("E4", "K2", "K4", parent_frame=E_on_K2, child_frame=(0.0, -0.02, 0.0))
    pin("E6", "K2", "K6", parent_frame=E_on_K2, child_frame=(0.02, 0.0, 0.0))
    b.force("motor", mbs.SpringDamper(preload=-torque), joint="beta")  # a constant effort of +torque
    spring = mbs.SpringDamper(stiffness=stiffness, free_length=free_length)
    b.force("spring", spring, between=(("ground", C), ("K3", (0.02, -0.018, 0.0))))
    return b.build(cut=("E3", "E4", "E6"))


BRICARD_CORNERS = np.array(
    ((0.0, 0, 0), (1, 0, 0), (1, -1, 0), (1, -1, 1), (0, -1, 1), (0, 0, 1))
)  # of a cube, at the start: rod i joins corner i to the next, the ground the last to the first
BRICARD_AXES = ("y", "z", "x", "y", "z", "x")  # each normal to the two edges that meet there


def bricard():
    """A04: five uniform rods of 1 kg, 1 m and six revolutes; one freedom although one row is redundant."""
    b = mbs.SystemBuilder(gravity=DOWN_Y)
    for i, (start, end) in enumerate(zip(BRICARD_CORNERS[:-1], BRICARD_CORNERS[1:], strict=True)):
        along = end - start
        inertia = (np.eye(3) - np.outer(along, along)) / 12.0
        b.body(f"rod_{i}", mass=1.0, com=along / 2.0, inertia=inertia, position=start)
    bodies = ("ground", *(f"rod_{i}" for i in range(5)), "ground")
    for i, (axis, corner) in enumerate(zip(BRICARD_AXES, BRICARD_CORNERS, strict=True)):
        b.joint(f"corner_{i}", mbs.Revolute(axis=axis), parent=bodies[i], child=bodies[i + 1], at=corner)
    b.frame("P3", on="rod_3")
    return b.build(cut=("corner_5",))


def flyball_governor(stiffness=8e5, damping=4e4):
    """A05: slider on a spinning shaft, held by two stiff springs to the middles of two hinged rods.

    Bodies as composed in the benchmark's models: shaft and rods are 1 x 0.01 x 0.01 m, the slider a cube of
    0.1 m, all of 3000 kg/m^3 (0.3, 0.3 and 3 kg); the tips are points of 5 kg.  A rod's coordinate is its
    angle below horizontal.  (A hand Lagrangian with these inertias meets the printed rows within 1e-12;
    without the slider's own inertia or the rods' thickness it misses them.)
    """
    b = mbs.SystemBuilder()
    b.body("shaft", mass=0.3, com=(0.0, 0.0, 0.5), inertia=mbs.inertia.box(0.3, (0.01, 0.01, 1.0)))
    b.joint("spin", mbs.Revolute(axis="z"), parent="ground", child="shaft")
    b.body("slider", mass=3.0, inertia=mbs.inertia.box(3.0, (0.1, 0.1, 0.1)))
    b.joint("slide", mbs.Prismatic(axis="z"), parent="shaft", child="slider")
    for side, axis, sign in (("right", "y", 1.0), ("left", "-y", -1.0)):
        rod = (0.3, (0.5 * sign, 0.0, 0.0), mbs.inertia.box(0.3, (1.0, 0.01, 0.01)))
        b.body(f"rod_{side}", **mbs.inertia.combine([rod, (5.0, (sign, 0.0, 0.0), mbs.inertia.point())]))
        hinge = (0.05 * sign, 0.0, 1.0)
        b.joint(side, mbs.Revolute(axis=axis), parent="shaft", child=f"rod_{side}", parent_frame=hinge)
        spring = mbs.SpringDamper(stiffness=stiffness, damping=damping, free_length=0.5)
        ends = (("slider", (0.05 * sign, 0.0, 0.0)), (f"rod_{side}", (0.5 * sign, 0.0, 0.0)))
        b.force(f"spring_{side}", spring, between=ends)
    return b.build()


def slider_crank(drive=None, gas_force=0.0):
    """C1: crank 0.15 m, rod 0.5 m, slider along x; `drive` gives the crank angle as a function of time."""
    b = mbs.SystemBuilder(gravity=DOWN_Y)
    b.body("crank", mass=1.2, com=(0.075, 0.0, 0.0), inertia=(0.004, 0.004, 0.004))
    b.body("rod", mass=2.0, com=(0.25, 0.0, 0.0), inertia=(0.06, 0.06, 0.06))
    b.body("slider", mass=3.0, inertia=(0.01, 0.01, 0.01))
    pin = mbs.Revolute(axis="z")
    b.joint("main", pin, parent="ground", child="crank", drive=drive)
    b.joint("crank_pin", pin, parent="crank", child="rod", parent_frame=(0.15, 0.0, 0.0))
    b.joint("wrist", pin, parent="rod", child="slider", parent_frame=(0.5, 0.0, 0.0))
    b.joint("slide", mbs.Prismatic(axis="x"), parent="ground", child="slider")
    b.frame("crank_com", on="crank", position=(0.075, 0.0, 0.0))
    b.frame("rod_com", on="rod", position=(0.25, 0.0, 0.0))
    b.force("gas", mbs.Force((gas_force, 0.0, 0.0)), on="slider")
    return b.build(cut=("wrist",))


def slider_crank_guess(theta):
    """Coordinates of the other joints of `slider_crank` with the slider to the right of the crank."""
    rod = -np.arcsin(0.15 * np.sin(theta) / 0.5)
    return {"crank_pin": rod - theta, "slide": 0.15 * np.cos(theta) + 0.5 * np.cos(rod)}


def hexagon(radius, angles):
    """(6, 3) points on a circle in the plane z = 0 at the angles [degrees]."""
    angles = np.radians(np.asarray(angles, float))
    return radius * np.stack([np.cos(angles), np.sin(angles), np.zeros(6)], axis=1)


GOUGH_BASE = hexagon(1.0, [10.0, 110.0, 130.0, 230.0, 250.0, 350.0])
GOUGH_PLATFORM = hexagon(0.6, [50.0, 70.0, 170.0, 190.0, 290.0, 310.0])
GOUGH_POSITION = np.array([0.1, -0.05, 1.0])
GOUGH_ROTATION = np.array(
    [
        [0.9856086976293272, -0.1565801350993442, -0.063703661195355],
        [0.14896018543636058, 0.9826391001792261, -0.1105950358457656],
        [0.0799146939691727, 0.09951412005957863, 0.9918218497273497],
    ]
)


def gough_lengths():
    """Leg lengths (6,) in the pose of the case [m]."""
    return np.linalg.norm(GOUGH_POSITION + GOUGH_PLATFORM @ GOUGH_ROTATION.T - GOUGH_BASE, axis=1)


def gough_pose():
    """Coordinates (7,) of the free joint in the pose of the case: position, quaternion (w, x, y, z)."""
    w = np.sqrt(1.0 + np.trace(GOUGH_ROTATION)) / 2.0
    skew = GOUGH_ROTATION - GOUGH_ROTATION.T
    vector = np.array([skew[2, 1], skew[0, 2], skew[1, 0]]) / (4.0 * w)
    return np.concatenate([GOUGH_POSITION, [w], vector])


def gough_platform(legs="rigid", stiffness=2e4, damping=50.0):
    """C4: 6-6 platform; legs are fixed distances ("rigid"), springs ("spring") or absent ("none")."""
    b = mbs.SystemBuilder()
    b.body("platform", mass=50.0, com=(0.0, 0.0, 0.1), inertia=(2.0, 2.5, 4.0))
    b.joint("platform", mbs.Free(), parent="ground", child="platform")
    b.frame("com", on="platform", position=(0.0, 0.0, 0.1))
    for i, (foot, head, length) in enumerate(zip(GOUGH_BASE, GOUGH_PLATFORM, gough_lengths(), strict=True)):
        ends = (("ground", tuple(foot)), ("platform", tuple(head)))
        b.frame(f"head_{i}", on="platform", position=tuple(head))
        if legs == "rigid":
            b.constraint(f"leg_{i}", mbs.joints.Distance(length), between=ends)
        elif legs == "spring":
            law = mbs.SpringDamper(stiffness=stiffness, damping=damping, free_length=length)
            b.force(f"leg_{i}", law, between=ends)
    return b.build()


def double_pendulum(mass_1=1.0, mass_2=1.0, length_1=1.0, length_2=1.0):
    """D1: two points on massless rods; the second coordinate is relative to the first rod."""
    b = mbs.SystemBuilder(gravity=DOWN_Y)
    b.body("upper", mass=mass_1, com=(0.0, -length_1, 0.0))
    b.body("lower", mass=mass_2, com=(0.0, -length_2, 0.0))
    pin = mbs.Revolute(axis="z")
    b.joint("shoulder", pin, parent="ground", child="upper")
    b.joint("elbow", pin, parent="upper", child="lower", parent_frame=(0.0, -length_1, 0.0))
    return b.build()


def free_rigid_body(kind="free", inertia=(1.0, 2.0, 3.0)):
    """D2: a body with no load, on a "free" or a "spherical" joint at its centre of mass."""
    b = mbs.SystemBuilder(gravity=NO_GRAVITY)
    b.body("body", mass=1.0, inertia=inertia)
    joint = mbs.Free() if kind == "free" else mbs.Spherical()
    b.joint("joint", joint, parent="ground", child="body")
    return b.build()


def panda(links, efforts=None):
    """D4: seven revolute joints; `links` as `panda_links.LINKS`, `efforts` (7,) constant torques [N m]."""
    b = mbs.SystemBuilder()
    parent = "ground"
    for i, link in enumerate(links):
        b.body(f"link_{i + 1}", mass=link["mass"], com=link["com"], inertia=np.asarray(link["inertia"]))
        pose = mbs.Pose(link["position"], np.asarray(link["rotation"], float))
        b.joint(f"joint_{i + 1}", mbs.Revolute(axis="z"), parent, f"link_{i + 1}", parent_frame=pose)
        parent = f"link_{i + 1}"
    if efforts is not None:
        efforts = np.asarray(efforts, float)
        b.force("motors", mbs.forces.GeneralisedEffort(lambda coordinates, velocities, t: jnp.asarray(efforts)))
    return b.build()


def chain_10(n=10, length=0.3, mass=0.3):
    """D5: n slender links hanging along -z, hinges about y, x, y, ..."""
    b = mbs.SystemBuilder()
    parent, hinge = "ground", None
    for i in range(n):
        b.body(f"link_{i}", mass=mass, com=(0.0, 0.0, -length / 2), inertia=(0.00225, 0.00225, 2.25e-5))
        axis = "y" if i % 2 == 0 else "x"
        b.joint(f"hinge_{i}", mbs.Revolute(axis=axis), parent, f"link_{i}", parent_frame=hinge)
        parent, hinge = f"link_{i}", (0.0, 0.0, -length)
    b.frame("tip", on=parent, position=hinge)
    return b.build()


def quarter_car(sprung=300.0, unsprung=60.0, spring=16e3, damper=1000.0, tyre=190e3, road=0.05):
    """F1: heights from the static position, so no gravity; the road step is the tyre spring's free length."""
    b = mbs.SystemBuilder(gravity=NO_GRAVITY)
    b.body("wheel", mass=unsprung)
    b.body("car", mass=sprung)
    b.joint("tyre", mbs.Prismatic(axis="z"), parent="ground", child="wheel")
    b.joint("suspension", mbs.Prismatic(axis="z"), parent="wheel", child="car")
    b.force("tyre_spring", mbs.SpringDamper(stiffness=tyre, free_length=road), joint="tyre")
    b.force("strut", mbs.SpringDamper(stiffness=spring, damping=damper), joint="suspension")
    return b.build()


def half_car(road_front=0.05, corner_front=165.0):
    """F2: exactly linear pitch and bounce, with couplers instead of small angles.

    The sprung mass is shared by four bodies: one at the centre of mass that heaves, one that only pitches,
    and two corners above the wheels (`corner_front` kg in front, the rear in the ratio a / b, so that the
    sums give mass, inertia and no static moment).  The couplers put a corner at heave - x * pitch.  No
    gravity, as in `quarter_car`.
    """
    mass, inertia, a, b_rear = 568.0, 1200.0, 1.15, 1.65
    corner_rear = corner_front * a / b_rear
    flywheel = inertia - corner_front * a**2 - corner_rear * b_rear**2
    b = mbs.SystemBuilder(gravity=NO_GRAVITY)
    up = mbs.Prismatic(axis="z")
    b.body("chassis", mass=mass - corner_front - corner_rear)
    b.joint("heave", up, parent="ground", child="chassis")
    b.body("flywheel", mass=1.0, inertia=(flywheel, flywheel, flywheel))
    b.joint("pitch", mbs.Revolute(axis="y"), parent="ground", child="flywheel")
    ends = {
        "front": (63.0, corner_front, 36297.0, 3921.0, road_front, a),
        "rear": (60.0, corner_rear, 19620.0, 2936.0, 0.0, -b_rear),
    }
    for end, (wheel, corner, stiffness, damping, road, x) in ends.items():
        b.body(f"wheel_{end}", mass=wheel)
        b.body(f"corner_{end}", mass=corner)
        b.joint(f"tyre_{end}", up, parent="ground", child=f"wheel_{end}")
        b.joint(f"strut_{end}", up, parent=f"wheel_{end}", child=f"corner_{end}")
        tyre = mbs.SpringDamper(stiffness=182470.0, free_length=road)
        strut = mbs.SpringDamper(stiffness=stiffness, damping=damping)
        b.force(f"tyre_{end}", tyre, joint=f"tyre_{end}")
        b.force(f"strut_{end}", strut, joint=f"strut_{end}")
        rigid = mbs.Coupler({f"tyre_{end}": 1.0, f"strut_{end}": 1.0, "heave": -1.0, "pitch": x})
        b.constraint(f"corner_{end}", rigid)
    return b.build()


CAR_AXIS_MASS = 10.0 * 0.01**2 / 2.0  # M eps^2 / 2 of the test set


def _wheel_x(t):
    return jnp.sqrt(1.0 - _wheel_y(t) ** 2)


def _wheel_y(t):
    return 0.1 * jnp.sin(10.0 * t)


def _axle_ends(b):
    """The two end masses; each slides in the plane and may turn, which nothing makes it do."""
    for name in ("left", "right"):
        b.body(name, mass=CAR_AXIS_MASS, inertia=CAR_AXIS_MASS * np.ones(3))
        b.joint(name, mbs.Planar(normal="z"), parent="ground", child=name)


def car_axis():
    """F4 in the test set's own terms: its two closure rows, the right spring to a point that time moves."""
    b = mbs.SystemBuilder(gravity=(0.0, -1.0, 0.0))
    _axle_ends(b)

    def closure(coordinates, t):
        left, right = coordinates[0:2], coordinates[3:5]
        axle = left - right
        upright = left[0] * _wheel_x(t) + left[1] * _wheel_y(t)
        return jnp.stack([upright, axle @ axle - 1.0])

    def right_spring(coordinates, velocities, t):
        d = coordinates[3:5] - jnp.stack([_wheel_x(t), _wheel_y(t)])
        length = jnp.sqrt(d @ d)
        return jnp.concatenate([jnp.zeros(3), (0.5 - length) * d / length, jnp.zeros(1)])

    b.force("left_spring", mbs.SpringDamper(stiffness=1.0, free_length=0.5), between=("ground", "left"))
    b.force("right_spring", mbs.forces.GeneralisedEffort(right_spring))
    b.constraint("closure", mbs.joints.PositionRows(closure))
    return b.build()


def car_axis_with_wheel():
    """F4 as a mechanism: the right wheel is a driven body with a two-point spring, the axle a distance.

    The left end stays on the normal of the line between the feet: a plane of the driven body "chassis".
    """
    b = mbs.SystemBuilder(gravity=(0.0, -1.0, 0.0))
    b.body("carriage", mass=1.0)
    b.body("wheel", mass=1.0)
    b.body("chassis", mass=1.0, inertia=(1.0, 1.0, 1.0))
    b.joint("wheel_x", mbs.Prismatic(axis="x"), parent="ground", child="carriage", drive=_wheel_x)
    b.joint("wheel_y", mbs.Prismatic(axis="y"), parent="carriage", child="wheel", drive=_wheel_y)
    b.joint("tilt", mbs.Revolute(axis="z"), "ground", "chassis", drive=lambda t: jnp.arcsin(_wheel_y(t)))
    _axle_ends(b)
    spring = mbs.SpringDamper(stiffness=1.0, free_length=0.5)
    b.force("left_spring", spring, between=("ground", "left"))
    b.force("right_spring", spring, between=("wheel", "right"))
    b.constraint("axle", mbs.joints.Distance(1.0), between=("left", "right"))
    across_x = mbs.Pose((0.0, 0.0, 0.0), np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]))
    b.constraint("upright", mbs.joints.PointOnPlane(), between=(("chassis", across_x), "left"))
    return b.build()


def knife_edge_incline(mass=1.0, inertia=0.1, slope=np.pi / 6):
    """E2: a skate on an inclined plane; x down the slope, y across, gravity inclined instead of the plane."""
    b = mbs.SystemBuilder(gravity=(9.81 * np.sin(slope), 0.0, -9.81 * np.cos(slope)))
    b.body("skate", mass=mass, inertia=(inertia, inertia, inertia))
    b.joint("plane", mbs.Planar(), parent="ground", child="skate")
    b.constraint("blade", mbs.joints.KnifeEdge(), between=("ground", "skate"))
    return b.build()


def chaplygin_sleigh(mass=1.2, inertia=0.15, ahead=0.3):
    """E3: a body on a horizontal plane with a blade at its origin, the centre of mass ahead of it."""
    b = mbs.SystemBuilder(gravity=NO_GRAVITY)
    b.body("sleigh", mass=mass, com=(ahead, 0.0, 0.0), inertia=(inertia, inertia, inertia))
    b.joint("plane", mbs.Planar(), parent="ground", child="sleigh")
    b.constraint("blade", mbs.joints.KnifeEdge(), between=("ground", "sleigh"))
    return b.build()
