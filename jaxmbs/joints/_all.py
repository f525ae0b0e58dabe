"""All joints of the library that connect two frames, for what is asked of each kind."""

from ._cylindrical import Cylindrical
from ._free import Free
from ._planar import Planar
from ._prismatic import Prismatic
from ._revolute import Revolute
from ._screw import Screw
from ._spherical import Spherical
from ._universal import Universal
from ._weld import Weld

ALL = (Revolute, Prismatic, Cylindrical, Screw, Universal, Spherical, Planar, Free, Weld)
