"""Where the public models lie that ship in Python packages, and which of them are compared."""

import importlib.util
import sysconfig
from pathlib import Path

#: Arms, hands, quadrupeds, bipeds, humanoids; by name the file inside example-robot-data.
URDF = {
    "double_pendulum_simple": "double_pendulum_description/urdf/double_pendulum_simple.urdf",
    "ur5": "ur_description/urdf/ur5_robot.urdf",
    "panda": "panda_description/urdf/panda.urdf",
    "kinova": "kinova_description/robots/kinova.urdf",
    "xarm7": "xarm_description/urdf/xarm7.urdf",
    "z1": "z1_description/urdf/z1.urdf",
    "so101": "so_arm_description/urdf/so101.urdf",
    "allegro_hand": "allegro_hand_description/urdf/allegro_right_hand.urdf",
    "finger_edu": "finger_edu_description/robots/finger_edu.urdf",
    "solo12": "solo_description/robots/solo12.urdf",
    "hyq": "hyq_description/robots/hyq_no_sensors.urdf",
    "a1": "a1_description/urdf/a1.urdf",
    "go2": "go2_description/urdf/go2.urdf",
    "anymal": "anymal_b_simple_description/robots/anymal.urdf",
    "bolt": "bolt_description/robots/bolt.urdf",
    "simple_humanoid": "simple_humanoid_description/urdf/simple_humanoid.urdf",
    "icub": "icub_description/robots/icub.urdf",
    "baxter": "baxter_description/urdf/baxter.urdf",
    "tiago": "tiago_description/robots/tiago.urdf",
    "talos": "talos_data/robots/talos_full_v2.urdf",
    "romeo": "romeo_description/urdf/romeo_small.urdf",
    "centauro": "centauro_description/urdf/centauro.urdf",
    "human": "human_description/robots/human.urdf",
}
#: Of dm_control's suite.
MJCF = (
    *("acrobot", "cartpole", "pendulum", "reacher", "hopper", "walker", "cheetah", "humanoid", "humanoid_CMU"),
    *("swimmer", "finger", "fish", "manipulator", "stacker", "quadruped", "dog"),
)


def robot_descriptions() -> Path | None:
    """The folder of example-robot-data, None where it is not installed."""
    folder = Path(sysconfig.get_path("purelib")) / "cmeel.prefix/share/example-robot-data/robots"
    return folder if folder.exists() else None


def dm_control_suite() -> Path | None:
    """The folder of dm_control's suite, found without importing it; None where it is not installed."""
    found = importlib.util.find_spec("dm_control")
    return None if found is None or found.origin is None else Path(found.origin).parent / "suite"


def public_models() -> dict[str, Path]:
    """Files by name, of the packages that are installed."""
    robots, suite = robot_descriptions(), dm_control_suite()
    found = {} if robots is None else {name: robots / file for name, file in URDF.items()}
    return found | ({} if suite is None else {name: suite / f"{name}.xml" for name in MJCF})
