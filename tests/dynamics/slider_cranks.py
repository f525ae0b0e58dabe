"""The slider-crank of case FR2 without drive, for tests of friction in its joints."""

import jaxmbs as mbs


def slider_crank(load):
    """Builder of the bodies and joints A, B, C and guide, with a force [N] on the slider."""
    b = mbs.SystemBuilder(gravity=(0, -9.81, 0))
    b.body("crank", mass=0.5, com=(0.05, 0, 0), inertia=(1e-3, 1e-3, 1e-3))
    b.body("rod", mass=1.0, com=(0.12, 0, 0), inertia=(1e-4, 0.01, 0.01))
    b.body("slider", mass=2.0, inertia=(1e-3, 1e-3, 1e-3))
    b.joint("A", mbs.Revolute("z"), "ground", "crank")
    b.joint("B", mbs.Revolute("z"), "crank", "rod", parent_frame=(0.1, 0, 0))
    b.joint("guide", mbs.Prismatic("x"), "ground", "slider")
    b.joint("C", mbs.Revolute("z"), "rod", "slider", parent_frame=(0.3, 0, 0))
    b.force("load", mbs.Force((load, 0, 0)), on="slider")
    return b
