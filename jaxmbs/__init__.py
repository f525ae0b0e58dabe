"""jaxmbs: differentiable multibody and structural dynamics.  A `System` is a pytree; functions question it."""

from . import forces as forces
from . import joints as joints
from .builder import SystemBuilder as SystemBuilder
from .design import minimise as minimise
from .dynamics.energy import kinetic_energy as kinetic_energy
from .dynamics.energy import potential_energy as potential_energy
from .dynamics.newton_euler import forward_dynamics as forward_dynamics
from .dynamics.newton_euler import inverse_dynamics as inverse_dynamics
from .dynamics.newton_euler import mass_matrix as mass_matrix
from .dynamics.points import acceleration as acceleration
from .dynamics.points import angular_acceleration as angular_acceleration
from .dynamics.reactions import reactions as reactions
from .errors import AssemblyError as AssemblyError
from .errors import ModelError as ModelError
from .errors import SimulationError as SimulationError
from .forces import *  # noqa: F403
from .joints import *  # noqa: F403
from .kinematics.constraints import constraint_jacobian as constraint_jacobian
from .kinematics.constraints import constraint_residual as constraint_residual
from .kinematics.kic import kic as kic
from .kinematics.kic_second import kic_rate as kic_rate
from .kinematics.kic_second import kic_second as kic_second
from .kinematics.points import angular_velocity as angular_velocity
from .kinematics.points import jacobian as jacobian
from .kinematics.points import position as position
from .kinematics.points import rotation as rotation
from .kinematics.points import velocity as velocity
from .kinematics.state import State as State
from .model import Pose as Pose
from .model import System as System
from .model import inertia as inertia
from .simulate import Motion as Motion
from .simulate import SemiImplicitEuler as SemiImplicitEuler
from .simulate import simulate as simulate
